"""Recordings: who recorded which drone when, in which flights, and the state of the file."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import JSON, BigInteger, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class RecordingRow(Base):
    __tablename__ = "recordings"
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), index=True)
    store: Mapped[str] = mapped_column(String(32))
    """The folder that contains the file: several towers may share a database."""
    file: Mapped[str] = mapped_column(String(32))
    """The stem of the file name: random, so that a restored older copy of the database does not assign one recording's
    id and file to another."""
    by_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"))
    by_name: Mapped[str] = mapped_column(String(64))
    quality: Mapped[str] = mapped_column(String(16))
    codec: Mapped[str] = mapped_column(String(16))
    state: Mapped[str] = mapped_column(String(16), index=True)
    """`recording`, `finishing`, `ready`, `failed`."""
    words: Mapped[str] = mapped_column(String(200), default="")
    """Why it ended, if no user ended it, or why it failed."""
    began_at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    first_picture_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """When the first picture of the file was taken; null: none came yet, or the recording is older than this column."""
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    flights: Mapped[list[str]] = mapped_column(JSON, default=list)
    """When each of the flights that it shows began, if known: ISO 8601, in order."""
    size_bytes: Mapped[int] = mapped_column(BigInteger, default=0)
    duration_s: Mapped[float | None]
    pictures: Mapped[int] = mapped_column(default=0)
    width: Mapped[int | None]
    height: Mapped[int | None]

    @property
    def shows_from(self) -> datetime:
        """The moment at which its file begins, as far as it is known. A camera may begin long after `began_at`, and a
        stream that runs already begins before it."""
        return self.first_picture_at or self.began_at
