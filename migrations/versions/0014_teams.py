"""Teams of people and drones.

Revision 0014, after 0013.
"""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

_ROLES = "role IN ('observer', 'operator', 'admin')"


def upgrade() -> None:
    op.create_table(
        "teams",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("made_by", sa.Integer(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["made_by"], ["users.id"], name=op.f("fk_teams_made_by_users"), ondelete="SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_teams")),
    )
    op.create_index(op.f("ix_teams_made_by"), "teams", ["made_by"])
    op.create_table(
        "team_members",
        sa.Column("team_id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("role", sa.String(16), nullable=False),
        sa.CheckConstraint(_ROLES, name=op.f("ck_team_members_role")),
        sa.ForeignKeyConstraint(
            ["team_id"], ["teams.id"], name=op.f("fk_team_members_team_id_teams"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["user_id"], ["users.id"], name=op.f("fk_team_members_user_id_users"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("team_id", "user_id", name=op.f("pk_team_members")),
    )
    op.create_index(op.f("ix_team_members_user_id"), "team_members", ["user_id"])
    op.create_table(
        "team_drones",
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("team_id", sa.Integer(), nullable=False),
        sa.Column("since", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_team_drones_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["team_id"], ["teams.id"], name=op.f("fk_team_drones_team_id_teams"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("drone_id", name=op.f("pk_team_drones")),
    )
    op.create_index(op.f("ix_team_drones_team_id"), "team_drones", ["team_id"])
    op.create_table(
        "team_invitations",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("team_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("name_key", sa.String(256), nullable=False),
        sa.Column("role", sa.String(16), nullable=False),
        sa.Column("invited_by", sa.String(64), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("expires_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("declined", sa.Boolean(), server_default=sa.false(), nullable=False),
        sa.CheckConstraint(_ROLES, name=op.f("ck_team_invitations_role")),
        sa.ForeignKeyConstraint(
            ["team_id"], ["teams.id"], name=op.f("fk_team_invitations_team_id_teams"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_team_invitations")),
        sa.UniqueConstraint("team_id", "name_key", name=op.f("uq_team_invitations_team_id")),
    )
    op.create_index(op.f("ix_team_invitations_name_key"), "team_invitations", ["name_key"])
    with op.batch_alter_table("loans") as loans:
        loans.add_column(sa.Column("team_id", sa.Integer(), nullable=True))
        loans.create_foreign_key(op.f("fk_loans_team_id_teams"), "teams", ["team_id"], ["id"], ondelete="CASCADE")
        loans.create_index(op.f("ix_loans_team_id"), ["team_id"])


def downgrade() -> None:
    with op.batch_alter_table("loans") as loans:
        loans.drop_index(op.f("ix_loans_team_id"))
        loans.drop_constraint(op.f("fk_loans_team_id_teams"), type_="foreignkey")
        loans.drop_column("team_id")
    for table in ("team_invitations", "team_drones", "team_members", "teams"):
        op.drop_table(table)
