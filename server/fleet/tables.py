"""The tables of the fleet: drones, who owns them, and the number that grows with each change."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.database import Base, UtcDateTime


class DroneRow(Base):
    __tablename__ = "drones"
    # The id is the tag in front of every frame: that of a deleted drone must never come back for another one.
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64))
    name_key: Mapped[str] = mapped_column(String(256), unique=True)
    credential_hash: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)


class OwnershipRow(Base):
    __tablename__ = "ownerships"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True, index=True)


class FleetRevisionRow(Base):
    """One row. Whoever changes drones, ownerships or users adds one in the same transaction."""

    __tablename__ = "fleet_revision"
    __table_args__ = (CheckConstraint("id = 1", name="one_row"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    revision: Mapped[int]
