"""Recordings: who recorded which drone when, in which flights, and how the file is getting on."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import JSON, BigInteger, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.store.database import Base, UtcDateTime


class RecordingRow(Base):
    __tablename__ = "recordings"
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), index=True)
    store: Mapped[str] = mapped_column(String(32))
    """Which folder of files it is in: several towers may share a database."""
    file: Mapped[str] = mapped_column(String(32))
    """The beginning of the file's name: by chance, so that an older copy of the database brought back does not give the
    number and the file of one recording to another."""
    by_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"))
    by_name: Mapped[str] = mapped_column(String(64))
    quality: Mapped[str] = mapped_column(String(16))
    codec: Mapped[str] = mapped_column(String(16))
    state: Mapped[str] = mapped_column(String(16), index=True)
    """`recording`, `finishing`, `ready`, `failed`."""
    words: Mapped[str] = mapped_column(String(200), default="")
    """Why it ended by itself, or why it failed."""
    began_at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    flights: Mapped[list[str]] = mapped_column(JSON, default=list)
    """When each of the flights began that it shows, where that is known: ISO 8601, in order."""
    size_bytes: Mapped[int] = mapped_column(BigInteger, default=0)
    duration_s: Mapped[float | None]
    pictures: Mapped[int] = mapped_column(default=0)
    width: Mapped[int | None]
    height: Mapped[int | None]
