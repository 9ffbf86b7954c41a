"""First passwords that must be changed, second factors, loans of drones, enrolments.

Revision 0005, after 0004.
"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.add_column("users", sa.Column("must_change_password", sa.Boolean(), server_default=sa.false(), nullable=False))
    op.add_column("users", sa.Column("password_changed_at", _MOMENT, nullable=True))
    op.add_column("users", sa.Column("totp_secret", sa.String(64), nullable=True))
    op.add_column("users", sa.Column("totp_pending", sa.String(64), nullable=True))
    op.add_column("users", sa.Column("totp_last_step", sa.Integer(), nullable=True))
    op.create_table(
        "recovery_codes",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("code_hash", sa.String(64), nullable=False),
        sa.ForeignKeyConstraint(
            ["user_id"], ["users.id"], name=op.f("fk_recovery_codes_user_id_users"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_recovery_codes")),
    )
    op.create_index(op.f("ix_recovery_codes_user_id"), "recovery_codes", ["user_id"])
    op.create_table(
        "loans",
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("until", _MOMENT, nullable=False),
        sa.Column("may_arm", sa.Boolean(), nullable=False),
        sa.Column("max_height_m", sa.Double(), nullable=True),
        sa.Column("radius_m", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["drone_id"], ["drones.id"], name=op.f("fk_loans_drone_id_drones"), ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"], name=op.f("fk_loans_user_id_users"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("drone_id", "user_id", name=op.f("pk_loans")),
    )
    op.create_index(op.f("ix_loans_user_id"), "loans", ["user_id"])
    op.create_index(op.f("ix_loans_until"), "loans", ["until"])
    op.create_table(
        "enrolments",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("token_hash", sa.String(64), nullable=False),
        sa.Column("created_by", sa.String(64), nullable=False),
        sa.Column("created_at", _MOMENT, nullable=False),
        sa.Column("expires_at", _MOMENT, nullable=False),
        sa.Column("cancelled", sa.Boolean(), server_default=sa.false(), nullable=False),
        sa.Column("used_at", _MOMENT, nullable=True),
        sa.Column("used_from", sa.String(64), server_default="", nullable=False),
        sa.Column("agent_seen_at", _MOMENT, nullable=True),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_enrolments_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_enrolments")),
        sa.UniqueConstraint("token_hash", name=op.f("uq_enrolments_token_hash")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_enrolments_drone_id"), "enrolments", ["drone_id"])


def downgrade() -> None:
    op.drop_table("enrolments")
    op.drop_table("loans")
    op.drop_table("recovery_codes")
    # Not in batch mode: on SQLite it recreates the table, and dropping the old one would delete the rows that refer to
    # it.
    for name in ("totp_last_step", "totp_pending", "totp_secret", "password_changed_at", "must_change_password"):
        op.drop_column("users", name)
