"""Aircraft as towers tell each other of them: what receivers of the drones at one tower have heard. No I/O."""

from collections.abc import Iterable
from typing import Final

import msgspec

from server.airspace.core.aircraft.decode import Kind, Report
from server.airspace.core.aircraft.table import Aircraft
from server.airspace.core.separation.motion import Motion
from wire.ids import DroneId

MAX_TOLD: Final = 300
"""Reports in one message. The newest."""
FRESH_S: Final = 15.0
_KINDS: Final = {kind.value: kind for kind in Kind}


class SharedAircraft(msgspec.Struct, frozen=True, array_like=True):
    """Degrees, metres above the sea, metres a second. `heard_by`: drones of the sender."""

    key: str
    kind: str
    name: str
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    north_m_s: float
    east_m_s: float
    up_m_s: float
    age_ms: int
    has_height: bool
    course_deg: float | None
    speed_m_s: float | None
    squawk: int | None
    on_ground: bool
    heard_by: list[int]


def shared(aircraft: Iterable[Aircraft], here: Iterable[DroneId], now: float) -> list[SharedAircraft]:
    """What the drones that are at home here have heard lately: one entry for each receiver."""
    ours = frozenset(here)
    found = []
    for one in aircraft:
        for drone_id, report in one.reports.items():
            motion = report.motion
            if drone_id is None or drone_id not in ours or now - motion.at > FRESH_S:
                continue
            found.append(
                SharedAircraft(
                    report.key,
                    report.kind.value,
                    one.names.get(drone_id) or report.name,
                    *motion[:6],
                    max(0, round((now - motion.at) * 1000)),
                    report.has_height,
                    report.course_deg,
                    report.speed_m_s,
                    report.squawk,
                    report.on_ground,
                    [int(drone_id)],
                )
            )
    return sorted(found, key=lambda one: one.age_ms)[:MAX_TOLD]


def report_of(one: SharedAircraft, at: float) -> Report | None:
    """None: a kind that this version does not know."""
    kind = _KINDS.get(one.kind)
    if kind is None:
        return None
    return Report(
        key=one.key,
        kind=kind,
        name=one.name,
        motion=Motion(one.lat_deg, one.lon_deg, one.alt_amsl_m, one.north_m_s, one.east_m_s, one.up_m_s, at),
        has_height=one.has_height,
        course_deg=one.course_deg,
        speed_m_s=one.speed_m_s,
        squawk=one.squawk,
        on_ground=one.on_ground,
    )
