"""The zones that count for a drone, found by place: a grid over their bounding boxes. Pure; never changed."""

from collections.abc import Iterable, Iterator
from math import floor
from typing import Final

from wire.zones.area import Box
from wire.zones.zone import Zone

_CELL_DEG: Final = 0.01
"""Some 1 km: a zone of a street is in a few cells."""
_MAX_CELLS: Final = 64
"""A larger zone is looked at for every drone: to compare two boxes costs less than to keep it in many cells."""


class ZoneIndex:
    """Corridors count wherever a drone is: it must be in one of them."""

    def __init__(self, zones: Iterable[Zone] = ()) -> None:
        self.zones = tuple(zones)
        self.corridors = tuple(zone for zone in self.zones if zone.is_corridor)
        self._wide: list[Zone] = []
        self._cells: dict[tuple[int, int], list[Zone]] = {}
        for zone in self.zones:
            if zone.is_corridor:
                continue
            cells = list(_cells(zone.area.box))
            if len(cells) > _MAX_CELLS:
                self._wide.append(zone)
            else:
                for cell in cells:
                    self._cells.setdefault(cell, []).append(zone)

    def __bool__(self) -> bool:
        return bool(self.zones)

    def near(self, box: Box) -> list[Zone]:
        """Every zone whose bounding box meets this one, and all corridors."""
        if not self.zones:
            return []
        found = {zone.id: zone for zone in self._wide if zone.area.box.meets(box)}
        for number, cell in enumerate(_cells(box)):
            if number > _MAX_CELLS:
                found |= {zone.id: zone for zone in self.zones if zone.area.box.meets(box)}
                break
            for zone in self._cells.get(cell, ()):
                if zone.area.box.meets(box):
                    found[zone.id] = zone
        return [*found.values(), *self.corridors]


def _cells(box: Box) -> Iterator[tuple[int, int]]:
    columns = range(floor(box.west / _CELL_DEG), floor(box.east / _CELL_DEG) + 1)
    for row in range(floor(box.south / _CELL_DEG), floor(box.north / _CELL_DEG) + 1):
        for column in columns:
            yield row, column


NO_ZONES: Final = ZoneIndex()
