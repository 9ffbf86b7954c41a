"""How good the link was where: the reports of many flights, by cells of a grid. Pure."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from statistics import median
from typing import Annotated, Any, Final, Literal

import msgspec
from pydantic import BaseModel, Field

METRES_PER_DEGREE: Final = 111_319.49
MAX_CELLS: Final = 20_000
MAX_TIMES: Final = 2_000
"""Round trips kept of a cell: the median of so many is that of all, near enough."""
_MIN_COSINE: Final = 0.01
"""At the poles cells become narrow, not endless."""
_MARK: Final = b'"link'
"""Most lines of an index are about something else."""
COLUMNS: Final = ("lat_deg", "lon_deg", "reports", "losses", "loss_mean", "rtt_median_ms", "rtt_max_ms")


class CellProperties(BaseModel):
    """`reports`: one every five seconds of flight."""

    reports: int
    losses: Annotated[int, Field(description="How often the link was lost here")]
    loss_mean: Annotated[float | None, Field(description="0 to 1; null: not measured")]
    rtt_median_ms: float | None
    rtt_max_ms: float | None


class CellPolygon(BaseModel):
    type: Literal["Polygon"] = "Polygon"
    coordinates: Annotated[list[list[tuple[float, float]]], Field(description="Longitude and latitude in degrees")]


class CellFeature(BaseModel):
    type: Literal["Feature"] = "Feature"
    geometry: CellPolygon
    properties: CellProperties


class LinkPlacesView(BaseModel):
    """A FeatureCollection of GeoJSON (RFC 7946)."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[CellFeature]
    cell_m: float
    flights: Annotated[int, Field(description="That have a report with a place")]
    is_whole: Annotated[bool, Field(description="False: older flights, or cells, are left out")]


class _Report(msgspec.Struct):
    kind: str = ""
    lat: float | None = None
    lon: float | None = None
    rtt_ms: float | None = None
    loss: float | None = None


@dataclass
class _Cell:
    south_deg: float
    west_deg: float
    north_deg: float
    east_deg: float
    reports: int = 0
    losses: int = 0
    times_ms: list[float] = field(default_factory=list)
    max_ms: float | None = None
    lost_parts: float = 0.0
    measured: int = 0

    def properties(self) -> CellProperties:
        return CellProperties(
            reports=self.reports,
            losses=self.losses,
            loss_mean=round(self.lost_parts / self.measured, 4) if self.measured else None,
            rtt_median_ms=round(median(self.times_ms), 1) if self.times_ms else None,
            rtt_max_ms=None if self.max_ms is None else round(self.max_ms, 1),
        )


class LinkPlaces:
    """Give it the index of each flight, the newest first, then ask. `cell_m`: the side of a cell."""

    def __init__(self, cell_m: float) -> None:
        self._cell_m = cell_m
        self._cells: dict[tuple[int, int], _Cell] = {}
        self._decoder = msgspec.json.Decoder(_Report)
        self._flights = 0
        self.is_whole = True

    def take(self, lines: Iterable[bytes]) -> None:
        """The lines of an index. Lines that say nothing of link and place are left out."""
        counts = False
        for line in lines:
            if _MARK not in line:
                continue
            try:
                report = self._decoder.decode(line)
            except msgspec.DecodeError:
                continue
            if report.kind in ("link", "link_lost") and report.lat is not None and report.lon is not None:
                counts |= self._add(report, report.lat, report.lon)
        self._flights += counts

    def _add(self, report: _Report, lat_deg: float, lon_deg: float) -> bool:
        if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
            return False
        cell = self._cell(lat_deg, lon_deg)
        if cell is None:
            self.is_whole = False
            return False
        if report.kind == "link_lost":
            cell.losses += 1
            return True
        cell.reports += 1
        if report.loss is not None:
            cell.lost_parts += report.loss
            cell.measured += 1
        if report.rtt_ms is not None:
            cell.max_ms = max(report.rtt_ms, cell.max_ms or 0.0)
            if len(cell.times_ms) < MAX_TIMES:
                cell.times_ms.append(report.rtt_ms)
        return True

    def _cell(self, lat_deg: float, lon_deg: float) -> _Cell | None:
        """None: there are too many. Rows are as high everywhere; how wide their cells are, the latitude says."""
        high = self._cell_m / METRES_PER_DEGREE
        row = math.floor(lat_deg / high)
        wide = high / max(_MIN_COSINE, math.cos(math.radians((row + 0.5) * high)))
        column = math.floor(lon_deg / wide)
        found = self._cells.get((row, column))
        if found is None and len(self._cells) < MAX_CELLS:
            west, south = column * wide, row * high
            found = self._cells[row, column] = _Cell(south, west, south + high, west + wide)
        return found

    def view(self) -> LinkPlacesView:
        return LinkPlacesView(
            features=[_feature(cell) for _, cell in sorted(self._cells.items())],
            cell_m=self._cell_m,
            flights=self._flights,
            is_whole=self.is_whole,
        )


def _feature(cell: _Cell) -> CellFeature:
    west, south, east, north = (
        round(min(max(one, -limit), limit), 6)
        for one, limit in ((cell.west_deg, 180), (cell.south_deg, 90), (cell.east_deg, 180), (cell.north_deg, 90))
    )
    ring = [(west, south), (east, south), (east, north), (west, north), (west, south)]
    return CellFeature(geometry=CellPolygon(coordinates=[ring]), properties=cell.properties())


def link_places_csv(view: LinkPlacesView) -> str:
    """RFC 4180, with a line of names: a row for each cell, by its middle."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(COLUMNS)
    for feature in view.features:
        (west, south), _, (east, north), *_ = feature.geometry.coordinates[0]
        about: dict[str, Any] = feature.properties.model_dump()
        middle = round((south + north) / 2, 6), round((west + east) / 2, 6)
        writer.writerow((*middle, *("" if about[name] is None else about[name] for name in COLUMNS[2:])))
    return out.getvalue()
