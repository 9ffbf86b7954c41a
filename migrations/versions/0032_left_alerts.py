"""Why an alert was closed though nobody saw its end, and the name under which a tower keeps its own alerts.

Revision 0032, after 0031.
"""

import sqlalchemy as sa
from alembic import op

revision = "0032"
down_revision = "0031"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("alerts", sa.Column("closed_why", sa.String(200), server_default="", nullable=False))
    op.add_column("tower_members", sa.Column("alerts_as", sa.String(64), server_default="", nullable=False))


def downgrade() -> None:
    op.drop_column("tower_members", "alerts_as")
    op.drop_column("alerts", "closed_why")
