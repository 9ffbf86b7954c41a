"""Maintenance of drones that is due after so many hours in the air."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class MaintenanceTaskRow(Base):
    __tablename__ = "maintenance_tasks"
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), index=True)
    title: Mapped[str] = mapped_column(String(80))
    interval_h: Mapped[float]
    """Hours in the air."""
    done_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """When it was done last, or when counting begins."""
    done_by: Mapped[str] = mapped_column(String(64))
    """Empty: it was not done yet."""
