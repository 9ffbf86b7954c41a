"""Own lines of the preflight checklist, for kinds of drones and for single drones.

Revision 0022, after 0021.
"""

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "checklists",
        sa.Column("scope", sa.String(48), nullable=False),
        sa.Column("drone_id", sa.Integer(), nullable=True),
        sa.Column("lines", sa.JSON(), nullable=False),
        sa.Column("changed_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("changed_by", sa.String(64), nullable=False),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_checklists_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scope", name=op.f("pk_checklists")),
    )
    op.create_index(op.f("ix_checklists_drone_id"), "checklists", ["drone_id"])


def downgrade() -> None:
    op.drop_table("checklists")
