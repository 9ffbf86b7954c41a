"""The mission library: plans that users store on the tower, independent of the plans on board."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class MissionRow(Base):
    __tablename__ = "missions"
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    owner_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(64))
    document: Mapped[str] = mapped_column(Text, deferred=True)
    """JSON as sent; deferred, because a list of five hundred must not read them all."""
    mission_items: Mapped[int]
    fence_items: Mapped[int]
    rally_items: Mapped[int]
    shared: Mapped[bool] = mapped_column(default=False)
    version: Mapped[int] = mapped_column(default=1)
    """Incremented with each change."""
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
