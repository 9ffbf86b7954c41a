"""Several towers on one database: the running towers, and the home of each drone.

Revision 0020, after 0019.
"""

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "tower_members",
        sa.Column("tower", sa.String(32), nullable=False),
        sa.Column("renewals", sa.BigInteger(), server_default="0", nullable=False),
        sa.Column("host", sa.String(255), server_default="", nullable=False),
        sa.Column("pid", sa.Integer(), server_default="0", nullable=False),
        sa.Column("address", sa.String(255), server_default="", nullable=False),
        sa.Column("joined_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("tower", name=op.f("pk_tower_members")),
    )
    op.create_table(
        "drone_homes",
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("tower", sa.String(32), nullable=False),
        sa.Column("claim", sa.BigInteger(), server_default="1", nullable=False),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_drone_homes_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("drone_id", name=op.f("pk_drone_homes")),
    )
    op.create_index(op.f("ix_drone_homes_tower"), "drone_homes", ["tower"])


def downgrade() -> None:
    op.drop_table("drone_homes")
    op.drop_table("tower_members")
