"""The table of the audit trail. Rows are only ever added; retention removes the oldest."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import JSON, ColumnElement, ForeignKey, Index, String, func, text
from sqlalchemy.orm import InstrumentedAttribute, Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


def folded_actor(name: InstrumentedAttribute[str] | Mapped[str]) -> ColumnElement[str]:
    """A name as the indexes hold it: searches ignore its case. SQLite folds only ASCII."""
    return func.lower(name)


class AuditEventRow(Base):
    """Each index but the last ends with the time: see `search.py`."""

    __tablename__ = "audit_events"

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    actor_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), index=True)
    actor_name: Mapped[str] = mapped_column(String(64))
    """Stored beside the id, because the trail outlives the account."""
    action: Mapped[str] = mapped_column(String(64))
    drone_id: Mapped[int | None] = mapped_column()
    """Not a foreign key: the trail outlives the drone, and its id is never used again."""
    detail: Mapped[dict[str, Any]] = mapped_column(JSON)
    address: Mapped[str] = mapped_column(String(64))
    request_id: Mapped[str] = mapped_column(String(64), default="", server_default="")
    """Of the request that caused it; empty: none did."""

    __table_args__ = (
        Index("ix_audit_events_action", action, at),
        Index("ix_audit_events_actor", func.lower(actor_name), action, at),
        Index("ix_audit_events_drone", drone_id, action, at),
        Index("ix_audit_events_drone_actor", drone_id, func.lower(actor_name), action, at),
        Index(
            "ix_audit_events_request",
            request_id,
            sqlite_where=text("request_id <> ''"),
            postgresql_where=text("request_id <> ''"),
        ),
        {"sqlite_autoincrement": True},
    )
