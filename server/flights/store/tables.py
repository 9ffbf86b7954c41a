"""Flights that the tower recorded, and who flew them. The files have everything; these rows are their catalogue."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import JSON, BigInteger, ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class FlightRow(Base):
    __tablename__ = "flights"
    __table_args__ = (
        Index("ix_flights_began_at", "began_at", "id"),
        Index("ix_flights_drone_id", "drone_id", "began_at", "id"),
        {"sqlite_autoincrement": True},
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"))
    store: Mapped[str] = mapped_column(String(32))
    """The folder that contains the files: several towers may share a database."""
    file: Mapped[str] = mapped_column(String(32), unique=True)
    """The stem of the file names: random, as that of a recording."""
    state: Mapped[str] = mapped_column(String(16), index=True)
    """`recording`, `ready`, `failed`."""
    words: Mapped[str] = mapped_column(String(200), default="")
    began_at: Mapped[datetime] = mapped_column(UtcDateTime)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    frames: Mapped[int] = mapped_column(BigInteger, default=0)
    lost_frames: Mapped[int] = mapped_column(BigInteger, default=0)
    size_bytes: Mapped[int] = mapped_column(BigInteger, default=0)
    distance_m: Mapped[float | None]
    max_height_m: Mapped[float | None]
    track: Mapped[list[list[float]]] = mapped_column(JSON, default=list)
    """Positions in degrees, for a picture of the way."""


class FlightPilotRow(Base):
    """Somebody who had the controls during a flight, in order."""

    __tablename__ = "flight_pilots"

    flight_id: Mapped[int] = mapped_column(ForeignKey("flights.id", ondelete="CASCADE"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    user_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), index=True)
    name: Mapped[str] = mapped_column(String(64))
    name_key: Mapped[str] = mapped_column(String(256), index=True)
    """The name as it is compared."""


class FlightGapRow(Base):
    """A stretch of a flight that did not come over the link, and what became of it. Times by the clock of its file."""

    __tablename__ = "flight_gaps"

    id: Mapped[int] = mapped_column(primary_key=True)
    flight_id: Mapped[int] = mapped_column(ForeignKey("flights.id", ondelete="CASCADE"), index=True)
    from_us: Mapped[int] = mapped_column(BigInteger)
    to_us: Mapped[int] = mapped_column(BigInteger)
    state: Mapped[str] = mapped_column(String(16), index=True)
    """`wanted`, `fetched` (not in the file yet), `merged`, `missing`."""
    shift_us: Mapped[int] = mapped_column(BigInteger, default=0)
    """What added to the fetched times gives those of the file, as far as is known."""
    words: Mapped[str] = mapped_column(String(200), default="")
    frames: Mapped[int] = mapped_column(BigInteger, default=0)
    """That the file has got."""


class FlightFiguresRow(Base):
    """The figures of a flight (server/flights/core/figures.py). They stay when its files go by age or to make room:
    log book and maintenance count on them. So `flight_id` names a flight that may be gone; ids are never used again."""

    __tablename__ = "flight_figures"
    __table_args__ = (Index("ix_flight_figures_drone_id", "drone_id", "began_at"),)

    flight_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"))
    began_at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    ended_at: Mapped[datetime] = mapped_column(UtcDateTime)
    air_s: Mapped[float | None]
    flown_s: Mapped[float]
    """As `air_s`, else from arming to disarming: what hours are counted by."""
    distance_m: Mapped[float]
    max_height_m: Mapped[float | None]
    max_speed_m_s: Mapped[float | None]
    battery_start_v: Mapped[float | None]
    battery_end_v: Mapped[float | None]
    used_mah: Mapped[float | None]
    landings: Mapped[int]
    holds: Mapped[int]
    hand_overs: Mapped[int]
    alerts: Mapped[int]
    critical_alerts: Mapped[int]
    link_losses: Mapped[int]
    link_lost_s: Mapped[float]
    rtt_mean_ms: Mapped[float | None]
    rtt_max_ms: Mapped[float | None]
    loss_mean: Mapped[float | None]


class FlightShareRow(Base):
    """One person's part in a flight, in the order in which they had the controls."""

    __tablename__ = "flight_shares"

    flight_id: Mapped[int] = mapped_column(
        ForeignKey("flight_figures.flight_id", ondelete="CASCADE"), primary_key=True, autoincrement=False
    )
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    user_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), index=True)
    name: Mapped[str] = mapped_column(String(64))
    held_s: Mapped[float]
    air_s: Mapped[float | None]
    distance_m: Mapped[float]
    landings: Mapped[int]
