"""The library of missions.

Revision 0007, after 0006.
"""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "missions",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("owner_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("document", sa.Text(), nullable=False),
        sa.Column("mission_items", sa.Integer(), nullable=False),
        sa.Column("fence_items", sa.Integer(), nullable=False),
        sa.Column("rally_items", sa.Integer(), nullable=False),
        sa.Column("shared", sa.Boolean(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("updated_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["owner_id"], ["users.id"], name=op.f("fk_missions_owner_id_users"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_missions")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_missions_owner_id"), "missions", ["owner_id"])


def downgrade() -> None:
    op.drop_index(op.f("ix_missions_owner_id"), "missions")
    op.drop_table("missions")
