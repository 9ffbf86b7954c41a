"""What the refusals of maps are in HTTP."""

from typing import Final

from server.http.problem_kinds import INVALID, Kind, Problems
from server.maps.core import (
    BadMapFile,
    BadMapLayer,
    MapTileUnavailable,
    TooManyMapLayers,
    UnknownMapArea,
    UnknownMapLayer,
)
from server.maps.io.tile_source import NoTileFile

PROBLEMS: Final[Problems] = {
    NoTileFile: Kind("no-tiles", 404, "No map tiles here"),
    UnknownMapLayer: Kind("unknown-map-layer", 404, "No such map layer"),
    UnknownMapArea: Kind("unknown-map-area", 404, "No such area"),
    TooManyMapLayers: Kind("too-many-map-layers", 409, "Too many map layers"),
    BadMapLayer: INVALID,
    BadMapFile: INVALID,
    MapTileUnavailable: Kind("map-tile-unavailable", 503, "The tile is not to be had now"),
}
