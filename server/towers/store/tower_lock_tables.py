"""The table of the lock that makes a process the tower of its database: one row, number 1."""

from __future__ import annotations

from datetime import datetime
from typing import Final

from sqlalchemy import BigInteger, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime

THE_ROW: Final = 1


class TowerLockRow(Base):
    """`owner`, `renewals` and `looks` decide; the other columns are for people."""

    __tablename__ = "tower_lock"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    owner: Mapped[str] = mapped_column(String(32), default="", server_default="")
    """A random name of the process; empty: none."""
    renewals: Mapped[int] = mapped_column(BigInteger, default=0, server_default="0")
    looks: Mapped[int] = mapped_column(BigInteger, default=0, server_default="0")
    """Incremented by each waiting process whenever it checks the lock."""
    host: Mapped[str] = mapped_column(String(255), default="", server_default="")
    pid: Mapped[int] = mapped_column(default=0, server_default="0")
    address: Mapped[str] = mapped_column(String(255), default="", server_default="")
    taken_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    renewed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
