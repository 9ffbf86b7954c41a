"""Map layers that an admin adds: raster tiles of other servers, and the known ones to choose from. Plain values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from server.kernel.refusal import Refusal

LayerRole = Literal["imagery", "map", "terrain"]
MAX_LAYERS: Final = 40
MAX_AREAS: Final = 50


class UnknownMapLayer(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no such map layer")


class UnknownMapArea(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no such area")


class TooManyMapLayers(Refusal):
    def __init__(self) -> None:
        super().__init__(f"at most {MAX_LAYERS} layers and {MAX_AREAS} areas are kept")


class BadMapLayer(Refusal):
    """The message says what is wrong."""


class BadMapFile(Refusal):
    """The message says what is wrong."""


class MapTileUnavailable(Refusal):
    """The tile is not stored, and its server does not give it now."""


@dataclass(frozen=True, slots=True)
class Preset:
    """A public source. `may_be_kept`: its terms allow an area to be downloaded ahead."""

    key: str
    name: str
    role: LayerRole
    template: str
    max_zoom: int
    attribution: str
    terms_url: str
    terms: str
    may_be_kept: bool


PRESETS: Final = (
    Preset(
        "osm",
        "OpenStreetMap",
        "map",
        "https://tile.openstreetmap.org/{z}/{x}/{y}.png",
        19,
        "© OpenStreetMap contributors",
        "https://operations.osmfoundation.org/policies/tiles/",
        "For light use. Downloading areas ahead is not allowed.",
        may_be_kept=False,
    ),
    Preset(
        "opentopomap",
        "OpenTopoMap",
        "map",
        "https://tile.opentopomap.org/{z}/{x}/{y}.png",
        17,
        "© OpenStreetMap contributors, SRTM | OpenTopoMap (CC-BY-SA)",
        "https://opentopomap.org/about",
        "For light use, CC-BY-SA. Downloading areas ahead is not allowed.",
        may_be_kept=False,
    ),
    Preset(
        "sentinel2",
        "Sentinel-2 cloudless 2020",
        "imagery",
        "https://tiles.maps.eox.at/wmts/1.0.0/s2cloudless-2020_3857/default/g/{z}/{y}/{x}.jpg",
        15,
        "Sentinel-2 cloudless by EOX (contains modified Copernicus Sentinel data 2020)",
        "https://s2maps.eu/",
        "CC BY-NC-SA 4.0: not for commercial use without a licence of EOX.",
        may_be_kept=False,
    ),
    Preset(
        "esri",
        "Esri World Imagery",
        "imagery",
        "https://server.arcgisonline.com/ArcGIS/rest/services/World_Imagery/MapServer/tile/{z}/{y}/{x}",
        19,
        "Powered by Esri. Sources: Esri, Maxar, Earthstar Geographics, and the GIS User Community",
        "https://www.esri.com/en-us/legal/overview",
        "Needs an agreement with Esri. Downloading areas ahead is not allowed.",
        may_be_kept=False,
    ),
    Preset(
        "usgs",
        "USGS imagery (United States)",
        "imagery",
        "https://basemap.nationalmap.gov/arcgis/rest/services/USGSImageryOnly/MapServer/tile/{z}/{y}/{x}",
        16,
        "U.S. Geological Survey",
        "https://www.usgs.gov/faqs/what-are-terms-uselicensing-map-services-and-data-national-map",
        "Public domain. Credit is asked for.",
        may_be_kept=True,
    ),
    Preset(
        "terrain-tiles",
        "Terrain Tiles (heights of the whole world)",
        "terrain",
        "https://s3.amazonaws.com/elevation-tiles-prod/terrarium/{z}/{x}/{y}.png",
        14,
        "Terrain Tiles: Mapzen, and the sources named there",
        "https://github.com/tilezen/joerd/blob/master/docs/attribution.md",
        "Open data. Credit is required. About 30 m between points in most of the world.",
        may_be_kept=True,
    ),
)
