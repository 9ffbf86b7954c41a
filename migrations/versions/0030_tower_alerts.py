"""Alerts about the tower itself have no drone.

Revision 0030, after 0029.
"""

import sqlalchemy as sa
from alembic import op

revision = "0030"
down_revision = "0029"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("alerts") as alerts:
        alerts.alter_column("drone_id", existing_type=sa.Integer(), nullable=True)


def downgrade() -> None:
    op.execute("DELETE FROM alerts WHERE drone_id IS NULL")
    with op.batch_alter_table("alerts") as alerts:
        alerts.alter_column("drone_id", existing_type=sa.Integer(), nullable=False)
