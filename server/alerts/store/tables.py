"""The table of alerts: what was wrong with which drone from when to when, and who acknowledged it."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import BigInteger, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class AlertRow(Base):
    """No foreign keys: a row is written in the background, and its drone or its person may be gone by then."""

    __tablename__ = "alerts"
    __table_args__ = (Index("ix_alerts_drone", "drone_id", "opened_at"),)

    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    """Random: a counted one would tell how many alerts others have."""
    rule: Mapped[str] = mapped_column(String(40))
    subject: Mapped[str] = mapped_column(String(64))
    severity: Mapped[str] = mapped_column(String(16))
    """Stored beside the rule, which a later version may not know."""
    badge: Mapped[str] = mapped_column(String(64))
    drone_id: Mapped[int | None]
    """None: about the tower itself; `subject` says which."""
    other_id: Mapped[int | None]
    about_stranger: Mapped[bool] = mapped_column(default=False)
    words: Mapped[str] = mapped_column(String(600))
    opened_at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    acknowledged_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    acknowledged_by_id: Mapped[int | None]
    acknowledged_by_name: Mapped[str] = mapped_column(String(64), default="")
    closed_at: Mapped[datetime | None] = mapped_column(UtcDateTime, index=True)
    closed_why: Mapped[str] = mapped_column(String(200), default="", server_default="")
    """Why it was closed though nobody saw that it is over; empty: it is over."""
