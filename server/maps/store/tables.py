"""Map layers from other servers, and the areas of them that are kept."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class MapLayerRow(Base):
    __tablename__ = "map_layers"
    __table_args__ = (
        CheckConstraint("role IN ('imagery', 'map', 'terrain')", name="role"),
        {"sqlite_autoincrement": True},
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64))
    role: Mapped[str] = mapped_column(String(16))
    template: Mapped[str] = mapped_column(String(1000))
    max_zoom: Mapped[int]
    tile_size: Mapped[int]
    attribution: Mapped[str] = mapped_column(String(200))
    may_be_private: Mapped[bool]
    may_be_kept: Mapped[bool]
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)


class MapAreaRow(Base):
    """Degrees. `done`: tiles stored so far, of `tiles`; kept up to date now and then."""

    __tablename__ = "map_areas"
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64))
    layer_id: Mapped[int] = mapped_column(ForeignKey("map_layers.id", ondelete="CASCADE"), index=True)
    south: Mapped[float]
    west: Mapped[float]
    north: Mapped[float]
    east: Mapped[float]
    max_zoom: Mapped[int]
    tiles: Mapped[int]
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
