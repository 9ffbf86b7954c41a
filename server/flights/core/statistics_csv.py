"""Statistics and log book as CSV (RFC 4180) with a line of names. Pure."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from typing import Final

from server.flights.core.statistics import KeptFlight, LogBookView, StatisticsView

_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")
"""What spreadsheets take for the beginning of a formula, in a name that anybody chose."""
_FLIGHT: Final = (
    "duration_s",
    "air_s",
    "distance_m",
    "max_height_m",
    "max_speed_m_s",
    "battery_start_v",
    "battery_end_v",
    "used_mah",
    "landings",
    "holds",
    "hand_overs",
    "alerts",
    "critical_alerts",
    "link_losses",
    "link_lost_s",
    "rtt_mean_ms",
    "rtt_max_ms",
    "loss_mean",
)


def drones_csv(view: StatisticsView) -> str:
    """One row for each drone."""
    rows = [one.model_dump() for one in view.drones]
    return _table(("drone_id", "drone"), rows)


def pilots_csv(view: StatisticsView) -> str:
    """One row for each pilot."""
    rows = []
    for one in view.pilots:
        about = one.model_dump(exclude={"pilot"})
        rows.append({"pilot_id": one.pilot.id, "pilot": one.pilot.name} | about)
    return _table(("pilot_id", "pilot"), rows)


def flights_csv(flights: Iterable[KeptFlight], names: Mapping[int, str]) -> str:
    """One row for each flight, newest first."""
    rows: list[dict[str, object]] = []
    for one in flights:
        about: dict[str, object] = {
            "flight_id": one.flight_id,
            "began_at": one.began_at.isoformat(timespec="seconds"),
            "drone_id": one.drone_id,
            "drone": names[one.drone_id],
            "pilots": "; ".join(share.name for share in one.figures.pilots),
        }
        rows.append(about | {name: getattr(one.figures, name) for name in _FLIGHT})
    return _table(("flight_id", "began_at", "drone_id", "drone", "pilots", *_FLIGHT), rows)


def log_book_csv(view: LogBookView) -> str:
    """One row for each flight, newest first."""
    rows = []
    for one in view.entries:
        about = one.model_dump() | {
            "began_at": one.began_at.isoformat(timespec="seconds"),
            "ended_at": one.ended_at.isoformat(timespec="seconds"),
            "is_incident": int(one.is_incident),
            "with_others": "; ".join(one.with_others),
        }
        rows.append(about)
    return _table(("flight_id", "began_at", "ended_at", "drone_id", "drone", "held_s", "air_s"), rows)


def _table(first: tuple[str, ...], rows: list[dict[str, object]]) -> str:
    """The columns `first`, then the others as they come. Without rows the names of `first` alone."""
    others = [name for name in (rows[0] if rows else {}) if name not in first]
    out = io.StringIO()
    writer = csv.DictWriter(out, fieldnames=[*first, *others], lineterminator="\r\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _safe(value) for name, value in row.items()})
    return out.getvalue()


def _safe(value: object) -> object:
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value
