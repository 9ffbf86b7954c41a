"""Figures of flights, each pilot's part, and maintenance of drones by flight hours.

Revision 0028, after 0027.
"""

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "flight_figures",
        sa.Column("flight_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("began_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("air_s", sa.Double(), nullable=True),
        sa.Column("flown_s", sa.Double(), nullable=False),
        sa.Column("distance_m", sa.Double(), nullable=False),
        sa.Column("max_height_m", sa.Double(), nullable=True),
        sa.Column("max_speed_m_s", sa.Double(), nullable=True),
        sa.Column("battery_start_v", sa.Double(), nullable=True),
        sa.Column("battery_end_v", sa.Double(), nullable=True),
        sa.Column("used_mah", sa.Double(), nullable=True),
        sa.Column("landings", sa.Integer(), nullable=False),
        sa.Column("holds", sa.Integer(), nullable=False),
        sa.Column("hand_overs", sa.Integer(), nullable=False),
        sa.Column("alerts", sa.Integer(), nullable=False),
        sa.Column("critical_alerts", sa.Integer(), nullable=False),
        sa.Column("link_losses", sa.Integer(), nullable=False),
        sa.Column("link_lost_s", sa.Double(), nullable=False),
        sa.Column("rtt_mean_ms", sa.Double(), nullable=True),
        sa.Column("rtt_max_ms", sa.Double(), nullable=True),
        sa.Column("loss_mean", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_flight_figures_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("flight_id", name=op.f("pk_flight_figures")),
    )
    op.create_index("ix_flight_figures_drone_id", "flight_figures", ["drone_id", "began_at"])
    op.create_index(op.f("ix_flight_figures_began_at"), "flight_figures", ["began_at"])
    op.create_table(
        "flight_shares",
        sa.Column("flight_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("held_s", sa.Double(), nullable=False),
        sa.Column("air_s", sa.Double(), nullable=True),
        sa.Column("distance_m", sa.Double(), nullable=False),
        sa.Column("landings", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["flight_id"],
            ["flight_figures.flight_id"],
            name=op.f("fk_flight_shares_flight_id_flight_figures"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["user_id"], ["users.id"], name=op.f("fk_flight_shares_user_id_users"), ondelete="SET NULL"
        ),
        sa.PrimaryKeyConstraint("flight_id", "number", name=op.f("pk_flight_shares")),
    )
    op.create_index(op.f("ix_flight_shares_user_id"), "flight_shares", ["user_id"])
    op.create_table(
        "maintenance_tasks",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("drone_id", sa.Integer(), nullable=False),
        sa.Column("title", sa.String(80), nullable=False),
        sa.Column("interval_h", sa.Double(), nullable=False),
        sa.Column("done_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("done_by", sa.String(64), nullable=False),
        sa.ForeignKeyConstraint(
            ["drone_id"], ["drones.id"], name=op.f("fk_maintenance_tasks_drone_id_drones"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_maintenance_tasks")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_maintenance_tasks_drone_id"), "maintenance_tasks", ["drone_id"])


def downgrade() -> None:
    op.drop_table("maintenance_tasks")
    op.drop_table("flight_shares")
    op.drop_table("flight_figures")
