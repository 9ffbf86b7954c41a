"""Map layers from other servers, and the areas of them that are kept.

Revision 0026, after 0025.
"""

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "map_layers",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("role", sa.String(16), nullable=False),
        sa.Column("template", sa.String(1000), nullable=False),
        sa.Column("max_zoom", sa.Integer(), nullable=False),
        sa.Column("tile_size", sa.Integer(), nullable=False),
        sa.Column("attribution", sa.String(200), nullable=False),
        sa.Column("may_be_private", sa.Boolean(), nullable=False),
        sa.Column("may_be_kept", sa.Boolean(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.CheckConstraint("role IN ('imagery', 'map', 'terrain')", name=op.f("ck_map_layers_role")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_map_layers")),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "map_areas",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("layer_id", sa.Integer(), nullable=False),
        sa.Column("south", sa.Double(), nullable=False),
        sa.Column("west", sa.Double(), nullable=False),
        sa.Column("north", sa.Double(), nullable=False),
        sa.Column("east", sa.Double(), nullable=False),
        sa.Column("max_zoom", sa.Integer(), nullable=False),
        sa.Column("tiles", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["layer_id"], ["map_layers.id"], name=op.f("fk_map_areas_layer_id_map_layers"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_map_areas")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_map_areas_layer_id"), "map_areas", ["layer_id"])


def downgrade() -> None:
    op.drop_table("map_areas")
    op.drop_table("map_layers")
