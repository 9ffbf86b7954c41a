"""The table of zones: where drones may not be, not above a height, or only."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class ZoneRow(Base):
    """Its id is random, so that it does not reveal how many zones other teams have."""

    __tablename__ = "zones"
    __table_args__ = (
        CheckConstraint("kind IN ('no-fly', 'height-limit', 'corridor')", name="kind"),
        CheckConstraint("rule IN ('refuse', 'warn')", name="rule"),
        CheckConstraint("height_above IN ('home', 'sea')", name="height_above"),
    )

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    team_id: Mapped[int | None] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"), index=True)
    """NULL: for the whole tower."""
    name: Mapped[str] = mapped_column(String(64))
    kind: Mapped[str] = mapped_column(String(16))
    rule: Mapped[str] = mapped_column(String(16))
    points: Mapped[str] = mapped_column(Text)
    """JSON: latitude and longitude of each."""
    width_m: Mapped[float | None]
    """Of a line; NULL: the points are the corners of an area."""
    floor_m: Mapped[float | None]
    ceiling_m: Mapped[float | None]
    height_above: Mapped[str] = mapped_column(String(8))
    valid_from: Mapped[datetime | None] = mapped_column(UtcDateTime)
    valid_until: Mapped[datetime | None] = mapped_column(UtcDateTime)
    reason: Mapped[str] = mapped_column(String(200))
    made_by: Mapped[str] = mapped_column(String(64))
    version: Mapped[int] = mapped_column(default=1)
    """Incremented with each change."""
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
