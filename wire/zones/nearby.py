"""The zones near a drone, for its agent: a message of the tower (no I/O).

Only for an agent that has sent ZONES in its hello: any other would not know the message, and close the channel. A newer
message replaces the one before. Times are relative to its arrival, because the drone's clock may be wrong.
"""

from typing import Annotated, Final

import msgspec

from wire.zones.kinds import HeightAbove, ZoneKind

ZONES: Final = "zones"
"""The entry in `takes` of a hello for this message."""

RADIUS_M: Final = 5_000.0
MAX_ZONES: Final = 200
MAX_BYTES: Final = 48_000
"""Of all zones of a message as JSON."""
_MAX_POINTS: Final = 500

_U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
_Lat = Annotated[int, msgspec.Meta(ge=-900_000_000, le=900_000_000)]
_Lon = Annotated[int, msgspec.Meta(ge=-1_800_000_000, le=1_800_000_000)]
_Height = Annotated[float, msgspec.Meta(ge=-1_000.0, le=20_000.0)]


class NearbyZone(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A zone that refuses. `points_e7`: latitude and longitude. `width_m`: of a line; None: the corners of an area.
    `group`: a drone stays within one corridor of each group. `begins_in_s`, `ends_in_s`: None: always."""

    id: _U32
    name: Annotated[str, msgspec.Meta(max_length=200)]
    kind: ZoneKind
    points_e7: Annotated[tuple[tuple[_Lat, _Lon], ...], msgspec.Meta(min_length=2, max_length=_MAX_POINTS)]
    width_m: Annotated[float, msgspec.Meta(gt=0.0, le=50_000.0)] | None = None
    group: _U32 = 0
    floor_m: _Height | None = None
    ceiling_m: _Height | None = None
    height_above: HeightAbove = HeightAbove.HOME
    reason: Annotated[str, msgspec.Meta(max_length=400)] = ""
    begins_in_s: Annotated[float, msgspec.Meta(ge=0.0)] | None = None
    ends_in_s: Annotated[float, msgspec.Meta(ge=0.0)] | None = None


class NearbyZones(msgspec.Struct, frozen=True, tag="nearby_zones", tag_field="type", kw_only=True):
    """Tower to agent: after the welcome, on each change, and when the drone has moved far.

    All zones within `radius_m` of the place that refuse, or will within `wire.controllers.MAX_FOR_S`. A radius of 0:
    there is no zone at all, wherever the drone is.
    """

    lat_e7: _Lat = 0
    lon_e7: _Lon = 0
    radius_m: Annotated[float, msgspec.Meta(ge=0.0, le=RADIUS_M)] = 0.0
    zones: Annotated[tuple[NearbyZone, ...], msgspec.Meta(max_length=MAX_ZONES)] = ()
