"""Flights that the tower records.

Revision 0018, after 0017.
"""

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "flights",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("store", sa.String(32), nullable=False),
        sa.Column("file", sa.String(32), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("words", sa.String(200), nullable=False),
        sa.Column("began_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("frames", sa.BigInteger(), nullable=False),
        sa.Column("lost_frames", sa.BigInteger(), nullable=False),
        sa.Column("size_bytes", sa.BigInteger(), nullable=False),
        sa.Column("distance_m", sa.Double(), nullable=True),
        sa.Column("max_height_m", sa.Double(), nullable=True),
        sa.Column("track", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_flights_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_flights")),
        sa.UniqueConstraint("file", name=op.f("uq_flights_file")),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_flights_began_at", "flights", ["began_at", "id"])
    op.create_index("ix_flights_drone_id", "flights", ["drone_id", "began_at", "id"])
    op.create_index(op.f("ix_flights_state"), "flights", ["state"])
    op.create_table(
        "flight_pilots",
        sa.Column("flight_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("name_key", sa.String(256), nullable=False),
        sa.ForeignKeyConstraint(
            ["flight_id"], ["flights.id"], name=op.f("fk_flight_pilots_flight_id_flights"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["user_id"], ["users.id"], name=op.f("fk_flight_pilots_user_id_users"), ondelete="SET NULL"
        ),
        sa.PrimaryKeyConstraint("flight_id", "number", name=op.f("pk_flight_pilots")),
    )
    for column in ("user_id", "name_key"):
        op.create_index(op.f(f"ix_flight_pilots_{column}"), "flight_pilots", [column])


def downgrade() -> None:
    op.drop_table("flight_pilots")
    op.drop_table("flights")
