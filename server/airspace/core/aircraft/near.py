"""Aircraft that come near a drone, by the geometry of the separation watch, and the words about it. Pure."""

import math
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from server.airspace.core.aircraft.decode import Kind, Report
from server.airspace.core.aircraft.table import Aircraft, Heard, Trusts
from server.airspace.core.separation.approach import conflict_ahead
from server.airspace.core.separation.motion import Motion, Relative
from wire.ids import DroneId

STALE_S: Final = 15.0
"""An aircraft that has not been heard for this long is no longer where its course puts it."""
GLANCE_DEG: Final = 0.15
"""Some 16 km: 60 s at the speed of an airliner, and more."""


class Bounds(NamedTuple):
    horizontal_m: float
    vertical_m: float
    ahead_s: float


MANNED: Final = Bounds(600.0, 150.0, 60.0)
"""A helicopter at 70 m/s needs 60 s for four kilometres: time to go down and land."""
UNMANNED: Final = Bounds(60.0, 30.0, 20.0)
BESIDE_M: Final = 30.0
ALONG_M_S: Final = 3.0
LEVEL_M: Final = 60.0
"""A transponder tells the height by air pressure."""
OWN_AFTER_S: Final = 15.0
_DIRECTIONS: Final = (
    "north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west",
)  # fmt: skip


class Near(NamedTuple):
    """What comes near one drone: words without its name; empty: nothing."""

    manned: str = ""
    unmanned: str = ""


NOTHING: Final = Near()


def near(drone_id: DroneId, own: Motion, aircraft: Iterable[Aircraft], trusts: Trusts, now: float) -> Near:
    """The nearest in time of each kind, by the reports that count for this drone."""
    soonest: dict[Kind, tuple[float, str]] = {}
    for one in aircraft:
        heard = one.heard_for(trusts)
        if heard is None or heard.report.on_ground or now - heard.report.motion.at > STALE_S:
            continue
        report, motion = heard.report, heard.report.motion
        if abs(motion.lat_deg - own.lat_deg) > GLANCE_DEG or is_own(one, heard, trusts, now):
            continue
        if not report.has_height:
            motion = motion._replace(alt_amsl_m=own.alt_amsl_m, up_m_s=own.up_m_s)
        kind = report.kind
        bounds = MANNED if kind is Kind.MANNED else UNMANNED
        seen = Relative.of(own, motion, now)
        approach = conflict_ahead(
            seen, horizontal_m=bounds.horizontal_m, vertical_m=bounds.vertical_m, ahead_s=bounds.ahead_s
        )
        threat = one.threat_to(drone_id, now)
        if approach is not None:
            in_s = approach.in_s
        elif threat is not None and threat.level > 0:
            in_s = threat.in_s
        else:
            continue
        known = soonest.get(kind)
        if known is None or in_s < known[0]:
            soonest[kind] = in_s, _words(report, one.label_of(heard), seen, in_s)
    found = {kind: words for kind, (_, words) in soonest.items()}
    return Near(found.get(Kind.MANNED, ""), found.get(Kind.UNMANNED, ""))


def _words(report: Report, name: str, seen: Relative, in_s: float) -> str:
    """Rounded, so that they do not change all the time."""
    what = "an aircraft" if report.kind is Kind.MANNED else "a drone of somebody else"
    label = f" ({name})" if name else ""
    step = 100 if seen.distance_m >= 500 else 20
    away = f"{step * max(1, round(seen.distance_m / step))} m to the {_direction(seen.bearing_deg)}"
    up = 10 * round(seen.up_m / 10)
    height = "height not known" if not report.has_height else (
        "at the same height" if up == 0 else f"{abs(up)} m {'higher' if up > 0 else 'lower'}")  # fmt: skip
    soon = f", closest in about {max(5, 5 * round(in_s / 5))} s" if in_s >= 2.5 else ""
    return f"{what}{label} comes near: {away}, {height}{soon}"


def _direction(bearing_deg: float) -> str:
    return _DIRECTIONS[round(bearing_deg % 360 / 45) % len(_DIRECTIONS)]


def judge_along(one: Aircraft, drones: Mapping[DroneId, Motion], now: float) -> None:
    """Notes which of the tower's own drones are where each report has this aircraft."""
    before, one.along_since = one.along_since, {}
    for by, report in one.reports.items():
        since = before.get(by, {})
        along = {number: since.get(number, now) for number, own in drones.items() if _flies_along(report, own, now)}
        if along:
            one.along_since[by] = along


def is_own(one: Aircraft, heard: Heard, trusts: Trusts, now: float) -> bool:
    """Whether this is one of the tower's own drones, by its Remote ID or by its transponder.

    Remote ID is of drones: being there is enough, and the separation watch looks after the two. A transponder may be
    that of a manned aircraft: a drone whose word counts must fly along for OWN_AFTER_S, which no aircraft does so close
    without a word.
    """
    along = one.along_since.get(heard.by, {})
    if heard.report.kind is Kind.UNMANNED:
        return bool(along)
    return any(now - since >= OWN_AFTER_S and trusts(drone_id) for drone_id, since in along.items())


def _flies_along(report: Report, own: Motion, now: float) -> bool:
    if abs(own.lat_deg - report.motion.lat_deg) >= 0.001:
        return False
    seen = Relative.of(own, report.motion, now)
    if report.kind is Kind.UNMANNED:
        return seen.distance_m < BESIDE_M
    is_level = not report.has_height or abs(seen.up_m) < LEVEL_M
    return is_level and seen.distance_m < BESIDE_M and math.hypot(seen.east_m_s, seen.north_m_s) < ALONG_M_S
