"""Alert channels of browsers (web push), and the tower's key for them.

Revision 0029, after 0028.
"""

import sqlalchemy as sa
from alembic import context, op

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None

_KIND = "ck_alert_channels_kind"
_SESSION = "fk_alert_channels_session_id_sessions"


def upgrade() -> None:
    op.create_table(
        "push_key",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("sealed_key", sa.String(255), nullable=False),
        sa.CheckConstraint("id = 1", name=op.f("ck_push_key_one_row")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_push_key")),
    )
    _change_channels("kind IN ('mail', 'webhook', 'push')", up=True)
    op.create_index(op.f("ix_alert_channels_session_id"), "alert_channels", ["session_id"])


def downgrade() -> None:
    op.execute("DELETE FROM alert_channels WHERE kind = 'push'")
    op.drop_index(op.f("ix_alert_channels_session_id"), "alert_channels")
    _change_channels("kind IN ('mail', 'webhook')", up=False)
    op.drop_table("push_key")


def _change_channels(kinds: str, *, up: bool) -> None:
    """SQLite copies the table for this. Dropping the old one deletes the deliveries that refer to it, so they are put
    aside; and the copy continues the old id sequence, so that no id is ever used twice."""
    is_sqlite = op.get_context().dialect.name == "sqlite"
    last = is_sqlite and not context.is_offline_mode() and _last_id()
    if is_sqlite:
        op.execute("CREATE TEMPORARY TABLE kept_deliveries AS SELECT * FROM alert_deliveries")
    with op.batch_alter_table("alert_channels", table_kwargs={"sqlite_autoincrement": True}) as channels:
        channels.drop_constraint(op.f(_KIND), type_="check")
        channels.create_check_constraint(op.f(_KIND), kinds)
        old, new = (255, 500) if up else (500, 255)
        channels.alter_column("secret_sealed", existing_type=sa.String(old), type_=sa.String(new))
        if up:
            channels.add_column(sa.Column("session_id", sa.Integer(), nullable=True))
            channels.add_column(sa.Column("browser", sa.String(60), server_default="", nullable=False))
            channels.create_foreign_key(op.f(_SESSION), "sessions", ["session_id"], ["id"], ondelete="SET NULL")
        else:
            channels.drop_constraint(op.f(_SESSION), type_="foreignkey")
            channels.drop_column("browser")
            channels.drop_column("session_id")
    if not is_sqlite:
        return
    op.execute("DELETE FROM alert_deliveries")
    op.execute("INSERT INTO alert_deliveries SELECT * FROM kept_deliveries")
    op.execute("DROP TABLE kept_deliveries")
    if last:
        op.execute("DELETE FROM sqlite_sequence WHERE name = 'alert_channels'")
        kept = sa.text("INSERT INTO sqlite_sequence (name, seq) VALUES ('alert_channels', :last)")
        op.execute(kept.bindparams(last=last))


def _last_id() -> int:
    found = op.get_bind().exec_driver_sql("SELECT seq FROM sqlite_sequence WHERE name = 'alert_channels'").scalar()
    return int(found or 0)
