"""The tables of several towers on one database: which towers there are, and which is the home of each drone."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import BigInteger, ForeignKey, String, false
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class TowerMemberRow(Base):
    """A running tower. `tower` and `renewals` decide; the other columns are for people."""

    __tablename__ = "tower_members"

    tower: Mapped[str] = mapped_column(String(32), primary_key=True)
    """A random name of the process."""
    renewals: Mapped[int] = mapped_column(BigInteger, default=0, server_default="0")
    host: Mapped[str] = mapped_column(String(255), default="", server_default="")
    pid: Mapped[int] = mapped_column(default=0, server_default="0")
    address: Mapped[str] = mapped_column(String(255), default="", server_default="")
    joined_at: Mapped[datetime] = mapped_column(UtcDateTime)
    url: Mapped[str] = mapped_column(String(255), default="", server_default="")
    """Where agents reach this tower and no other one (TOWER_OWN_URL). Empty: through a proxy only."""
    bus_version: Mapped[int] = mapped_column(default=0, server_default="0")
    """Which messages it understands on the bus (server.towers.core.messages)."""
    draining: Mapped[bool] = mapped_column(default=False, server_default=false())
    """Somebody has asked it to end its work (`tower drain`)."""
    doing: Mapped[str] = mapped_column(String(255), default="", server_default="")
    """How far it is with that, for people."""
    alerts_as: Mapped[str] = mapped_column(String(64), default="", server_default="")
    """The subject of this tower's own alerts. Empty: not known, or an older version."""


class DroneHomeRow(Base):
    """The tower that alone changes the drone's lease. Towers come and go, so it is no foreign key."""

    __tablename__ = "drone_homes"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    tower: Mapped[str] = mapped_column(String(32), index=True)
    claim: Mapped[int] = mapped_column(BigInteger, default=1, server_default="1")
    """Grows with each claim: the higher one is the later one."""
