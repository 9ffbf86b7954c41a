"""Several towers: the address of each, and which of them is to end its work.

Revision 0021, after 0020.
"""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

_COLUMNS = (
    sa.Column("url", sa.String(255), server_default="", nullable=False),
    sa.Column("bus_version", sa.Integer(), server_default="0", nullable=False),
    sa.Column("draining", sa.Boolean(), server_default=sa.false(), nullable=False),
    sa.Column("doing", sa.String(255), server_default="", nullable=False),
)


def upgrade() -> None:
    for column in _COLUMNS:
        op.add_column("tower_members", column)


def downgrade() -> None:
    for column in _COLUMNS:
        op.drop_column("tower_members", column.name)
