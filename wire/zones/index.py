"""The zones that count for a drone, found by place: grids over their bounding boxes. Pure; never changed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import floor
from typing import Final

from wire.zones.area import Box, Span
from wire.zones.kinds import HeightAbove
from wire.zones.zone import Zone

_CELLS_DEG: Final = (0.01, 0.1, 1.0, 10.0)
"""Some 1 km and more: a zone is kept in the finest grid in which it is in few cells."""
_MAX_CELLS: Final = 16
"""Of a zone in its grid. In the coarsest one there may be more."""
_MAX_LOOKED_AT: Final = 64
"""Of a box in a grid: beyond it, all zones of the grid are compared."""

Cell = tuple[int, int]


class _Grid:
    """`cell_deg`: the size of a cell."""

    def __init__(self, cell_deg: float) -> None:
        self._cell_deg = cell_deg
        self._zones: list[Zone] = []
        self._cells: dict[Cell, list[Zone]] = {}

    def size(self, box: Box) -> int:
        """How many cells the box is in."""
        south, west, north, east = self._ends(box)
        return (north - south + 1) * (east - west + 1)

    def add(self, zone: Zone) -> None:
        self._zones.append(zone)
        for cell in self._cells_of(zone.area.box):
            self._cells.setdefault(cell, []).append(zone)

    def near(self, box: Box) -> Iterable[Zone]:
        """A zone may come more than once, and need not meet the box."""
        if self.size(box) > _MAX_LOOKED_AT:
            return self._zones
        return [zone for cell in self._cells_of(box) for zone in self._cells.get(cell, ())]

    def _ends(self, box: Box) -> tuple[int, int, int, int]:
        cell_deg = self._cell_deg
        return (
            floor(box.south / cell_deg), floor(box.west / cell_deg),
            floor(box.north / cell_deg), floor(box.east / cell_deg),
        )  # fmt: skip

    def _cells_of(self, box: Box) -> Iterator[Cell]:
        south, west, north, east = self._ends(box)
        for row in range(south, north + 1):
            for column in range(west, east + 1):
                yield row, column

    def __bool__(self) -> bool:
        return bool(self._zones)


class ZoneIndex:
    """Corridors count wherever a drone is: it must be in one of them. `beside`: more zones, whose index is there."""

    def __init__(self, zones: Iterable[Zone] = (), *, beside: ZoneIndex | None = None) -> None:
        own = tuple(zones)
        self._beside = beside
        self.zones: tuple[Zone, ...] = own if beside is None else (*beside.zones, *own)
        self.corridors = tuple(zone for zone in self.zones if zone.is_corridor)
        grids = [_Grid(cell_deg) for cell_deg in _CELLS_DEG]
        for zone in own:
            if not zone.is_corridor:
                next((one for one in grids if one.size(zone.area.box) <= _MAX_CELLS), grids[-1]).add(zone)
        self._grids = [one for one in grids if one]

    def __bool__(self) -> bool:
        return bool(self.zones)

    def near(self, box: Box) -> list[Zone]:
        """Every zone whose bounding box meets this one, and all corridors."""
        return [*self._near(box).values(), *self.corridors] if self.zones else []

    def within(self, box: Box, heights_m: Mapping[HeightAbove, Span]) -> ZoneIndex:
        """Only the zones that a way inside this box and between these heights may enter, and all corridors. A way of
        many parts is judged among these: airspaces above it need not be looked at for each part."""

        def may_be_entered(zone: Zone) -> bool:
            (low_m, high_m), (least_m, most_m) = zone.heights_m, heights_m[zone.height_above]
            return low_m <= most_m and high_m >= least_m and zone.area.may_meet(box)

        return ZoneIndex([*filter(may_be_entered, self._near(box).values()), *self.corridors])

    def _near(self, box: Box) -> dict[int, Zone]:
        found = {zone.id: zone for grid in self._grids for zone in grid.near(box) if zone.area.box.meets(box)}
        return found if self._beside is None else self._beside._near(box) | found


NO_ZONES: Final = ZoneIndex()
