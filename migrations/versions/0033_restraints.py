"""What admins do about a drone that sends more than its share.

Revision 0033, after 0032.
"""

import sqlalchemy as sa
from alembic import op

revision = "0033"
down_revision = "0032"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "drone_restraints",
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("measure", sa.String(16), nullable=False),
        sa.Column("reason", sa.String(200), nullable=False),
        sa.Column("by_name", sa.String(64), nullable=False),
        sa.Column("by_admin", sa.Boolean(), nullable=False),
        sa.Column("since", sa.DateTime(timezone=True), nullable=False),
        sa.CheckConstraint("measure IN ('muted', 'limited', 'quarantined')", name=op.f("ck_drone_restraints_measure")),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_drone_restraints_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("drone_id", name=op.f("pk_drone_restraints")),
    )


def downgrade() -> None:
    op.drop_table("drone_restraints")
