"""Offers, assistance and excluded viewers in leases; settings per drone; acknowledged loss checks.

Revision 0002, after 0001.
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_MOMENT = sa.DateTime(timezone=True)
_ASSISTANT = "fk_control_leases_assistant_id_users"


def upgrade() -> None:
    with op.batch_alter_table("control_leases") as leases:
        leases.add_column(sa.Column("offered", sa.Boolean(), server_default=sa.false(), nullable=False))
        leases.add_column(sa.Column("assistant_id", sa.Integer(), nullable=True))
        leases.add_column(sa.Column("blind", sa.Boolean(), server_default=sa.false(), nullable=False))
        leases.create_foreign_key(op.f(_ASSISTANT), "users", ["assistant_id"], ["id"], ondelete="SET NULL")
    op.create_table(
        "drone_settings",
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("chosen", sa.JSON(), nullable=False),
        sa.Column("changed_at", _MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_drone_settings_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("drone_id", name=op.f("pk_drone_settings")),
    )
    op.create_table(
        "loss_acknowledgements",
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("findings_hash", sa.String(64), nullable=False),
        sa.Column("acknowledged_at", _MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_loss_acknowledgements_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["user_id"], ["users.id"], name=op.f("fk_loss_acknowledgements_user_id_users"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("drone_id", "user_id", name=op.f("pk_loss_acknowledgements")),
    )


def downgrade() -> None:
    op.drop_table("loss_acknowledgements")
    op.drop_table("drone_settings")
    # The holder and the epoch stay; an offer becomes an ordinary taking again.
    with op.batch_alter_table("control_leases") as leases:
        leases.drop_constraint(op.f(_ASSISTANT), type_="foreignkey")
        for column in ("blind", "assistant_id", "offered"):
            leases.drop_column(column)
