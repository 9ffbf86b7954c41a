"""The tables of alert channels: where a person wants to be told of alerts, and what is on its way there."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import JSON, BigInteger, CheckConstraint, ForeignKey, Index, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class AlertChannelRow(Base):
    __tablename__ = "alert_channels"
    __table_args__ = (
        CheckConstraint("kind IN ('mail', 'webhook', 'push')", name="kind"),
        CheckConstraint("drones IN ('all', 'own')", name="drones"),
        # An id identifies a channel in the audit trail: it is never assigned twice.
        {"sqlite_autoincrement": True},
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    kind: Mapped[str] = mapped_column(String(16))
    target: Mapped[str] = mapped_column(String(1000))
    """An e-mail address, the address of a webhook, or what a push service gave a browser as its address."""
    secret_sealed: Mapped[str | None] = mapped_column(String(500))
    """Of a webhook, or the keys of a browser, sealed by `server/runtime/vault.py`."""
    severity: Mapped[str] = mapped_column(String(16))
    """The least severe alerts that it gets."""
    drones: Mapped[str] = mapped_column(String(16))
    """`all` that its user may see, or only those that the user owns."""
    code_hash: Mapped[str | None] = mapped_column(String(64))
    """Of the code that proves that its user reads the mail; None: proved."""
    code_tries: Mapped[int] = mapped_column(default=0)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    sent_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """The last success."""
    problem: Mapped[str] = mapped_column(String(200), default="")
    """Of the last attempt; empty: it succeeded."""
    session_id: Mapped[int | None] = mapped_column(ForeignKey("sessions.id", ondelete="SET NULL"), index=True)
    """Of a browser: the session with which it was here last; its sign-out ends the channel. None: that one expired."""
    browser: Mapped[str] = mapped_column(String(60), default="", server_default="")
    """Name of a browser, for its user."""


class PushKeyRow(Base):
    """One row: the key by which push services recognise this tower. The private half is sealed."""

    __tablename__ = "push_key"
    __table_args__ = (CheckConstraint("id = 1", name="one_row"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sealed_key: Mapped[str] = mapped_column(String(255))


class AlertDeliveryRow(Base):
    """One announcement to one channel. The unique key makes it at most one, whatever is repeated."""

    __tablename__ = "alert_deliveries"
    __table_args__ = (
        UniqueConstraint("channel_id", "alert_id", "happening"),
        Index("ix_alert_deliveries_due", "ended_at", "due_at"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    channel_id: Mapped[int] = mapped_column(ForeignKey("alert_channels.id", ondelete="CASCADE"), index=True)
    alert_id: Mapped[int] = mapped_column(BigInteger)
    happening: Mapped[str] = mapped_column(String(16))
    content: Mapped[dict[str, Any]] = mapped_column(JSON)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    due_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """Not before; a tower that takes it on moves this ahead, so that no other one does."""
    attempts: Mapped[int] = mapped_column(default=0)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """When it was sent or given up; None: it waits."""
    problem: Mapped[str] = mapped_column(String(200), default="")
    """Of the last attempt; empty: none, or it succeeded."""
