"""An admin who takes the controls may take the video too.

Revision 0008, after 0007.
"""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("control_leases") as leases:
        leases.add_column(sa.Column("video_moved", sa.Boolean(), server_default=sa.false(), nullable=False))


def downgrade() -> None:
    with op.batch_alter_table("control_leases") as leases:
        leases.drop_column("video_moved")
