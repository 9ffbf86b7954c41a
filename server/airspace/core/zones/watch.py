"""One drone in flight and the zones that count for it: what people are told, and when it must hold. Pure.

Told: NEAR_S before it gets there as it flies now, or NEAR_M from an edge. Held, if it is flown by hand: when it could
otherwise no longer stop in front of the edge. Inside, it is told, and holds only when it goes deeper: the way out is
free. A drone around which a zone is drawn is inside.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, isfinite, radians
from typing import Final, NamedTuple

from server.airspace.core.separation.motion import Motion
from wire.zones.area import METRES_PER_DEGREE
from wire.zones.index import ZoneIndex
from wire.zones.track import Crossing, Spot, Track, crossings, depths
from wire.zones.ways import NEAR_M
from wire.zones.zone import Zone

NEAR_S: Final = 15.0
REACT_S: Final = 1.0
"""Until the order has reached the autopilot, and it brakes."""
BRAKE_M_S2: Final = 2.5
"""As a copter does in a hold."""
MIN_SPEED_M_S: Final = 0.5
"""Slower than that is drift."""
GROUND_STEP_M: Final = 5.0
HEIGHT_STEP_M: Final = 3.0
"""Inside, it holds again each time it is this much deeper."""


class Situation(NamedTuple):
    """What people are told. Words without the name of the drone; empty: nothing."""

    near: str = ""
    """It comes near a zone, or is in one that only warns."""
    breach: str = ""


CLEAR: Final = Situation()


@dataclass
class _Depth:
    ground_m: float
    height_m: float


class ZoneWatch:
    """For one drone. Call `check` with each new position."""

    def __init__(self) -> None:
        self.situation = CLEAR
        self.checked_at = float("-inf")
        self.setpoints_at = float("-inf")
        """When the last target, velocity or attitude of a program was passed on."""
        self._ordered: set[int] = set()
        """Zones for which a hold was ordered; not again until the drone has stopped, or turned."""
        self._inside: dict[int, _Depth] = {}
        """How deep it may be without another hold."""
        self._seen: set[int] = set()
        """Zones that counted at the last check."""

    def reset(self) -> None:
        """On the ground, or nothing counts for it."""
        self.situation = CLEAR
        self._ordered.clear()
        self._inside.clear()
        self._seen.clear()

    def check(self, index: ZoneIndex, here: Spot, motion: Motion, *, by_hand: bool) -> Zone | None:
        """Renews `situation`. Returns the zone because of which a drone that is flown by hand has to hold now."""
        speed_m_s = hypot(motion.north_m_s, motion.east_m_s, motion.up_m_s)
        moves = speed_m_s >= MIN_SPEED_M_S
        stop_s = REACT_S + speed_m_s / (2 * BRAKE_M_S2)
        ahead_s = max(NEAR_S, stop_s)
        track = Track(here, _moved(here, motion, ahead_s if moves else 0.0))
        zones = index.near(track.box.widened(NEAR_M))
        if not zones:
            self.reset()
            return None
        found = crossings(zones, track)
        inside = [one for one in found if one.starts_there]
        ahead = [one for one in found if not one.starts_there] if moves else []
        self.situation = _situation(zones, here, inside, ahead, ahead_s, track.length_m)
        held = self._deeper(inside, here, zones, by_hand=by_hand)
        stopping = {one.zone.id: one.zone for one in ahead if one.zone.binds and one.span[0] * ahead_s <= stop_s}
        self._ordered.intersection_update(stopping.keys() | {one.zone.id for one in inside})
        for zone_id, zone in stopping.items():
            if by_hand and held is None and zone_id not in self._ordered:
                self._ordered.add(zone_id)
                held = zone
        self._seen = {zone.id for zone in zones}
        return held

    def _deeper(self, inside: Sequence[Crossing], here: Spot, zones: Sequence[Zone], *, by_hand: bool) -> Zone | None:
        held = None
        now_inside: dict[int, _Depth] = {}
        for zone in {one.zone.id: one.zone for one in inside if one.zone.binds}.values():
            ground_m, height_m = depths(zone, here, [one for one in zones if one.team_id == zone.team_id
                                                     and one.is_corridor and zone.is_corridor])  # fmt: skip
            known = self._inside.get(zone.id)
            # It was outside a moment ago, while the zone counted already: it has flown in.
            came_in = known is None and zone.id in self._seen and zone.id not in self._ordered
            deeper = known is not None and (ground_m > known.ground_m or height_m > known.height_m)
            limit = _Depth(ground_m + GROUND_STEP_M, height_m + HEIGHT_STEP_M)
            if known is not None and not deeper:
                limit = _Depth(min(known.ground_m, limit.ground_m), min(known.height_m, limit.height_m))
            now_inside[zone.id] = limit
            if by_hand and (came_in or deeper) and held is None:
                self._ordered.add(zone.id)
                held = zone
        self._inside = now_inside
        return held


def _moved(here: Spot, motion: Motion, by_s: float) -> Spot:
    up_m = motion.up_m_s * by_s
    scale_m = METRES_PER_DEGREE * max(0.01, cos(radians(here.lat_deg)))
    return Spot(
        here.lat_deg + motion.north_m_s * by_s / METRES_PER_DEGREE,
        here.lon_deg + motion.east_m_s * by_s / scale_m,
        None if here.above_home_m is None else here.above_home_m + up_m,
        None if here.above_sea_m is None else here.above_sea_m + up_m,
    )


def _situation(
    zones: Sequence[Zone],
    here: Spot,
    inside: Sequence[Crossing],
    ahead: Sequence[Crossing],
    ahead_s: float,
    length_m: float,
) -> Situation:
    breach = next((where_words(one.zone) for one in inside if one.zone.binds), "")
    warned = next((where_words(one.zone) for one in inside if not one.zone.binds), "")
    soon = next((one for one in ahead if one.span[0] * ahead_s <= NEAR_S and one.zone not in
                 [other.zone for other in inside]), None)  # fmt: skip
    if soon is not None:
        in_s, away_m = soon.span[0] * ahead_s, soon.span[0] * length_m
        far = f", {_tens(away_m)} m ahead" if away_m >= NEAR_M else ""
        return Situation(warned or f"{reach_words(soon.zone)} in about {_fives(in_s)} s{far}", breach)
    if warned or breach:
        return Situation(warned, breach)
    for zone in zones:
        # A corridor along a road is narrow: there only the course tells.
        if zone.is_corridor or not _counts_at(zone, here):
            continue
        if zone.area.edge_m(here.lat_deg, here.lon_deg, NEAR_M) <= NEAR_M:
            return Situation(f"is within {NEAR_M:.0f} m of the edge of {zone.words}", "")
    return CLEAR


def _counts_at(zone: Zone, here: Spot) -> bool:
    """Whether one step over the edge would matter at this height."""
    height_m, (low, high) = here.height_m(zone.height_above), zone.heights_m
    return height_m is None or low < height_m < high


def where_words(zone: Zone) -> str:
    """Ends a sentence that begins with the name of a drone that is where it should not be."""
    why = f" ({zone.reason})" if zone.reason else ""
    if zone.is_corridor:
        return f"is outside of {zone.words}{why}"
    if zone.ceiling_m is not None and not isfinite(zone.heights_m[1]):
        return f"is above the {zone.ceiling_m:.0f} m of the zone {zone.name}{why}"
    return f"is in {zone.words}{why}"


def reach_words(zone: Zone) -> str:
    """Ends a sentence that begins with the name of a drone that will be there."""
    if zone.is_corridor:
        return f"leaves {zone.words}"
    if zone.ceiling_m is not None and not isfinite(zone.heights_m[1]):
        return f"goes above the {zone.ceiling_m:.0f} m of the zone {zone.name}"
    return f"reaches {zone.words}"


def hold_words(zone: Zone) -> str:
    """Why it holds: ends "Kestrel holds: "."""
    if zone.is_corridor:
        return f"at the edge of {zone.words}"
    if zone.ceiling_m is not None and not isfinite(zone.heights_m[1]):
        return f"at the {zone.ceiling_m:.0f} m of the zone {zone.name}"
    return f"at the edge of {zone.words}"


def _fives(seconds: float) -> int:
    """Rounded so that words do not change all the time."""
    return max(1, round(seconds)) if seconds < 5 else 5 * round(seconds / 5)


def _tens(metres: float) -> int:
    return 10 * max(1, round(metres / 10))
