"""Own lines of the preflight checklist: for a kind of drone, and for single drones."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class ChecklistRow(Base):
    __tablename__ = "checklists"

    scope: Mapped[str] = mapped_column(String(48), primary_key=True)
    """`kind:` and the key of a profile, or `drone:` and its id."""
    drone_id: Mapped[int | None] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), index=True)
    """None: for a kind."""
    lines: Mapped[list[str]] = mapped_column(JSON)
    changed_at: Mapped[datetime] = mapped_column(UtcDateTime)
    changed_by: Mapped[str] = mapped_column(String(64))
