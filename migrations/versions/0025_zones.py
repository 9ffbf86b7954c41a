"""Zones: no-fly areas, height limits and corridors, of the tower or of a team.

Revision 0025, after 0024.
"""

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "zones",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("team_id", sa.Integer(), nullable=True),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("rule", sa.String(16), nullable=False),
        sa.Column("points", sa.Text(), nullable=False),
        sa.Column("width_m", sa.Double(), nullable=True),
        sa.Column("floor_m", sa.Double(), nullable=True),
        sa.Column("ceiling_m", sa.Double(), nullable=True),
        sa.Column("height_above", sa.String(8), nullable=False),
        sa.Column("valid_from", sa.DateTime(timezone=True), nullable=True),
        sa.Column("valid_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column("reason", sa.String(200), nullable=False),
        sa.Column("made_by", sa.String(64), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("updated_at", sa.DateTime(timezone=True), nullable=False),
        sa.CheckConstraint("kind IN ('no-fly', 'height-limit', 'corridor')", name=op.f("ck_zones_kind")),
        sa.CheckConstraint("rule IN ('refuse', 'warn')", name=op.f("ck_zones_rule")),
        sa.CheckConstraint("height_above IN ('home', 'sea')", name=op.f("ck_zones_height_above")),
        sa.ForeignKeyConstraint(["team_id"], ["teams.id"], name=op.f("fk_zones_team_id_teams"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_zones")),
    )
    op.create_index(op.f("ix_zones_team_id"), "zones", ["team_id"])


def downgrade() -> None:
    op.drop_table("zones")
