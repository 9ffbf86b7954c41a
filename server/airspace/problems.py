"""What the refusals of airspace are in HTTP."""

from typing import Final

from server.airspace.core.zones.imports import UnreadableFile
from server.airspace.core.zones.zone import BadZone
from server.airspace.store.zones import TooManyZones, UnknownZone, ZoneChangedMeanwhile
from server.http.problem_kinds import INVALID, Kind, Problems

PROBLEMS: Final[Problems] = {
    UnknownZone: Kind("unknown-zone", 404, "No such zone"),
    TooManyZones: Kind("too-many-zones", 409, "Too many zones"),
    ZoneChangedMeanwhile: Kind("changed-meanwhile", 412, "Changed meanwhile"),
    BadZone: INVALID.at("points"),
    UnreadableFile: INVALID.at("text"),
}
