"""Keys of drones, and the tower's own key.

Revision 0012, after 0011.
"""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("drones", sa.Column("public_key", sa.String(43), nullable=True))
    op.add_column("drones", sa.Column("key_since", sa.DateTime(timezone=True), nullable=True))
    op.add_column("enrolments", sa.Column("public_key", sa.String(43), nullable=True))
    op.create_table(
        "tower_identity",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("public_key", sa.String(43), nullable=False),
        sa.Column("sealed_key", sa.String(255), nullable=False),
        sa.CheckConstraint("id = 1", name=op.f("ck_tower_identity_one_row")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_tower_identity")),
    )


def downgrade() -> None:
    """A drone with a key has no credential: it then needs a new one."""
    op.drop_table("tower_identity")
    # Not in a batch: SQLite would recreate the table, and dropping the old one would delete each drone's dependent
    # rows.
    op.drop_column("enrolments", "public_key")
    op.drop_column("drones", "key_since")
    op.drop_column("drones", "public_key")
