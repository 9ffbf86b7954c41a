"""Sessions record when the person last proved their identity; API tokens expire, and record the address of their use.

Revision 0011, after 0010.
"""

from datetime import UTC, datetime, timedelta

import sqlalchemy as sa
from alembic import context, op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_MOMENT = sa.DateTime(timezone=True)
_ENDLESS_END_AFTER = timedelta(days=90)
_LONGEST = timedelta(days=365)
_TOKENS = sa.table("api_tokens", sa.column("id", sa.Integer), sa.column("expires_at", _MOMENT))


def upgrade() -> None:
    op.add_column("sessions", sa.Column("proved_at", _MOMENT, nullable=True))
    op.add_column("api_tokens", sa.Column("last_used_address", sa.String(64), server_default="", nullable=False))
    now = datetime.now(UTC)
    if op.get_context().dialect.name == "sqlite":
        now = now.replace(tzinfo=None)  # SQLite stores times as UTC text
    ends = _TOKENS.c.expires_at
    op.execute(sa.update(_TOKENS).where(ends.is_(None)).values(expires_at=now + _ENDLESS_END_AFTER))
    op.execute(sa.update(_TOKENS).where(ends > now + _LONGEST).values(expires_at=now + _LONGEST))
    _let_end_be_unknown(False)


def downgrade() -> None:
    _let_end_be_unknown(True)
    op.drop_column("api_tokens", "last_used_address")
    op.drop_column("sessions", "proved_at")


def _let_end_be_unknown(nullable: bool) -> None:
    """SQLite copies the table for this; the copy continues the old id sequence, so that no id is ever used twice."""
    last = op.get_context().dialect.name == "sqlite" and not context.is_offline_mode() and _last_id()
    with op.batch_alter_table("api_tokens", table_kwargs={"sqlite_autoincrement": True}) as tokens:
        tokens.alter_column("expires_at", existing_type=_MOMENT, nullable=nullable)
    if last:
        op.execute("DELETE FROM sqlite_sequence WHERE name = 'api_tokens'")
        kept = sa.text("INSERT INTO sqlite_sequence (name, seq) VALUES ('api_tokens', :last)")
        op.execute(kept.bindparams(last=last))


def _last_id() -> int:
    found = op.get_bind().exec_driver_sql("SELECT seq FROM sqlite_sequence WHERE name = 'api_tokens'").scalar()
    return int(found or 0)
