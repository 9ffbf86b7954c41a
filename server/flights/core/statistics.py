"""Sums of flights by drone, by pilot and by month, and a pilot's log book. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from server.flights.core.figures import FlightFigures, PilotShare
from server.flights.core.views import PilotView

SECONDS_AN_HOUR: Final = 3600.0


@dataclass(frozen=True)
class KeptFlight:
    """The figures of one flight, as they are kept. The flight itself may be gone."""

    flight_id: int
    drone_id: int
    began_at: datetime
    figures: FlightFigures


class SumView(BaseModel):
    """Sums of several flights; the greatest of heights and speeds."""

    model_config = ConfigDict(frozen=True)

    flights: int
    hours: Annotated[float, Field(description="In the air; from arming to disarming where that is not known")]
    distance_m: Annotated[float, Field(description="Over ground")]
    landings: int
    incidents: Annotated[int, Field(description="Flights with a hold, a lost link or a critical alert")]
    max_height_m: Annotated[float | None, Field(description="Above home")]
    max_speed_m_s: Annotated[float | None, Field(description="Over ground")]


class DroneSumView(SumView):
    """What one drone flew."""

    drone_id: int
    drone: str
    used_mah: Annotated[float | None, Field(description="From its battery; null: of no flight known")]
    holds: int
    hand_overs: int
    alerts: int
    critical_alerts: int
    link_losses: int
    link_lost_s: float
    rtt_mean_ms: Annotated[float | None, Field(description="Mean of the flights' means")]
    loss_mean: Annotated[float | None, Field(description="0 to 1, mean of the flights' means")]


class PilotSumView(SumView):
    """What one person flew: hours, distance and landings while they had the controls. Heights and speeds are those of
    the whole flights."""

    pilot: PilotView
    held_hours: Annotated[float, Field(description="With the controls, also on the ground")]


class MonthView(BaseModel):
    """One calendar month, UTC; months without a flight are missing."""

    model_config = ConfigDict(frozen=True)

    month: Annotated[str, Field(description="As 2026-05")]
    flights: int
    hours: float


class StatisticsView(BaseModel):
    """Drones and pilots with the most hours first, months in order."""

    total: SumView
    drones: list[DroneSumView]
    pilots: list[PilotSumView]
    months: list[MonthView]
    is_whole: Annotated[bool, Field(description="False: only the newest flights of the period are in it")]


class LogBookEntry(BaseModel):
    """One's own part in one flight."""

    model_config = ConfigDict(frozen=True)

    flight_id: Annotated[int, Field(description="The recorded flight, which may be gone")]
    drone_id: int
    drone: str
    began_at: Annotated[datetime, Field(description="Armed")]
    ended_at: Annotated[datetime, Field(description="Disarmed")]
    held_s: Annotated[float, Field(description="With the controls")]
    air_s: Annotated[float | None, Field(description="Of it in the air; null: not known")]
    distance_m: float
    landings: int
    max_height_m: Annotated[float | None, Field(description="Of the whole flight")]
    is_incident: bool
    with_others: Annotated[list[str], Field(description="Names of others who had the controls in it")]


class LogBookView(BaseModel):
    """Newest first."""

    total: SumView
    entries: list[LogBookEntry]
    is_whole: Annotated[bool, Field(description="False: there are older flights in the period")]


def statistics(flights: Sequence[KeptFlight], names: Mapping[int, str], *, is_whole: bool) -> StatisticsView:
    """`names`: of the drones."""
    by_drone: dict[int, list[FlightFigures]] = {}
    by_pilot: dict[tuple[int | None, str], list[tuple[FlightFigures, PilotShare]]] = {}
    by_month: dict[str, list[FlightFigures]] = {}
    newest_name: dict[int, str] = {}
    for flight in flights:  # newest first
        figures = flight.figures
        by_drone.setdefault(flight.drone_id, []).append(figures)
        by_month.setdefault(f"{flight.began_at.astimezone(UTC):%Y-%m}", []).append(figures)
        for share in figures.pilots:
            if share.user_id is None:
                key: tuple[int | None, str] = (None, share.name)
            else:
                key = (share.user_id, newest_name.setdefault(share.user_id, share.name))
            by_pilot.setdefault(key, []).append((figures, share))
    drones = [_drone_sum(drone_id, names[drone_id], found) for drone_id, found in by_drone.items()]
    pilots = [_pilot_sum(PilotView(id=key[0], name=key[1]), found) for key, found in by_pilot.items()]
    return StatisticsView(
        total=SumView.model_validate(_sums([flight.figures for flight in flights])),
        drones=sorted(drones, key=lambda one: (-one.hours, one.drone)),
        pilots=sorted(pilots, key=lambda one: (-one.hours, one.pilot.name)),
        months=[
            MonthView(month=month, flights=len(found), hours=_hours(one.flown_s for one in found))
            for month, found in sorted(by_month.items())
        ],
        is_whole=is_whole,
    )


def log_book(flights: Sequence[KeptFlight], user_id: int, names: Mapping[int, str], *, is_whole: bool) -> LogBookView:
    """Of this user's flights. `names`: of the drones."""
    entries: list[LogBookEntry] = []
    own: list[tuple[FlightFigures, PilotShare]] = []
    for flight in flights:
        share = next((one for one in flight.figures.pilots if one.user_id == user_id), None)
        if share is None:
            continue
        own.append((flight.figures, share))
        entries.append(
            LogBookEntry(
                flight_id=flight.flight_id,
                drone_id=flight.drone_id,
                drone=names[flight.drone_id],
                began_at=flight.began_at,
                ended_at=datetime.fromtimestamp(flight.figures.ended_us / 1e6, UTC),
                held_s=share.held_s,
                air_s=share.air_s,
                distance_m=share.distance_m,
                landings=share.landings,
                max_height_m=flight.figures.max_height_m,
                is_incident=flight.figures.is_incident,
                with_others=sorted({one.name for one in flight.figures.pilots if one is not share}),
            )
        )
    return LogBookView(total=SumView.model_validate(_own_sums(own)), entries=entries, is_whole=is_whole)


def _sums(found: Sequence[FlightFigures]) -> dict[str, object]:
    return {
        "flights": len(found),
        "hours": _hours(one.flown_s for one in found),
        "distance_m": round(sum(one.distance_m for one in found), 1),
        "landings": sum(one.landings for one in found),
        "incidents": sum(one.is_incident for one in found),
        "max_height_m": _greatest(one.max_height_m for one in found),
        "max_speed_m_s": _greatest(one.max_speed_m_s for one in found),
    }


def _own_sums(found: Sequence[tuple[FlightFigures, PilotShare]]) -> dict[str, object]:
    """As `_sums`, with what is one person's part."""
    return _sums([figures for figures, _ in found]) | {
        "hours": _hours(share.flown_s for _, share in found),
        "distance_m": round(sum(share.distance_m for _, share in found), 1),
        "landings": sum(share.landings for _, share in found),
    }


def _drone_sum(drone_id: int, name: str, found: Sequence[FlightFigures]) -> DroneSumView:
    used = [one.used_mah for one in found if one.used_mah is not None]
    about = {
        "drone_id": drone_id,
        "drone": name,
        "used_mah": round(sum(used)) if used else None,
        "holds": sum(one.holds for one in found),
        "hand_overs": sum(one.hand_overs for one in found),
        "alerts": sum(one.alerts for one in found),
        "critical_alerts": sum(one.critical_alerts for one in found),
        "link_losses": sum(one.link_losses for one in found),
        "link_lost_s": round(sum(one.link_lost_s for one in found), 1),
        "rtt_mean_ms": _mean(one.rtt_mean_ms for one in found),
        "loss_mean": _mean(one.loss_mean for one in found),
    }
    return DroneSumView.model_validate(_sums(found) | about)


def _pilot_sum(pilot: PilotView, found: Sequence[tuple[FlightFigures, PilotShare]]) -> PilotSumView:
    held_hours = _hours(share.held_s for _, share in found)
    return PilotSumView.model_validate(_own_sums(found) | {"pilot": pilot, "held_hours": held_hours})


def _hours(seconds: Iterable[float]) -> float:
    return round(sum(seconds) / SECONDS_AN_HOUR, 4)


def _greatest(values: Iterable[float | None]) -> float | None:
    return max((one for one in values if one is not None), default=None)


def _mean(values: Iterable[float | None]) -> float | None:
    known = [one for one in values if one is not None]
    return round(sum(known) / len(known), 4) if known else None
