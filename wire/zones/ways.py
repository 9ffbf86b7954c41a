"""Which zones a straight way enters, and what to say of it. The tower and the agent judge by this alike. Pure.

A way out of a zone is free, and so is one towards its edge.
"""

from collections.abc import Sequence
from typing import Final

from wire.zones.index import ZoneIndex
from wire.zones.kinds import HeightAbove, ZoneKind
from wire.zones.track import Crossing, Spot, Track, crossings, depths
from wire.zones.zone import Zone

NEAR_M: Final = 10.0
"""From the edge of a zone: people are told, and a way this near is judged."""


def crossings_of(index: ZoneIndex, here: Spot, to: Spot) -> list[Crossing]:
    """The parts of the straight way that zones forbid, the first one first."""
    track = Track(here, to)
    zones = index.near(track.box.widened(NEAR_M))
    return [one for one in crossings(zones, track) if not _leaves(one, zones, track)]


def words_of(zone: Zone) -> str:
    """What a way into the zone does: ends a sentence about it."""
    why = f" ({zone.reason})" if zone.reason else ""
    if zone.kind is ZoneKind.CORRIDOR:
        return f"leads out of {zone.words}{why}"
    if zone.kind is ZoneKind.HEIGHT_LIMIT:
        above = "above sea level" if zone.height_above is HeightAbove.SEA else "above home"
        return f"goes above the {zone.ceiling_m or 0:.0f} m {above} of the zone {zone.name}{why}"
    return f"leads into {zone.words}{why}"


def _leaves(one: Crossing, zones: Sequence[Zone], track: Track) -> bool:
    """Begins where it should not be, and leads out, or towards the edge."""
    if not one.starts_there:
        return False
    if not one.ends_there:
        return True
    others = [zone for zone in zones if zone.is_corridor and one.zone.is_corridor and zone.team_id == one.zone.team_id]
    ground_m, height_m = depths(one.zone, track.start, others)
    to_ground_m, to_height_m = depths(one.zone, track.end, others)
    return (to_ground_m, to_height_m) != (ground_m, height_m) and to_ground_m <= ground_m and to_height_m <= height_m
