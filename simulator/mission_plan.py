"""The three plans that a vehicle stores (mission, fence, rally points), as plain items."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import IntEnum

from simulator.geodesy import Place, e7

WAYPOINT = 16
"""MAV_CMD_NAV_WAYPOINT; home is listed with it."""


class Frame(IntEnum):
    """The MAV_FRAMEs in which an altitude may be given."""

    GLOBAL = 0
    MISSION = 2
    GLOBAL_RELATIVE = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_INT = 6


class PlanKind(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


@dataclass(frozen=True, slots=True)
class Item:
    command: int
    frame: int = Frame.GLOBAL_RELATIVE
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    x: int = 0
    """Latitude, 1e-7 degree."""
    y: int = 0
    z: float = 0.0
    autocontinue: int = 1

    def number(self, index: int) -> float:
        """Returns one of the four parameters for flight; NaN ("unchanged") is 0."""
        value = self.params[index]
        return 0.0 if math.isnan(value) else value

    @property
    def has_place(self) -> bool:
        return self.x != 0 or self.y != 0


def home_item(home: Place) -> Item:
    return Item(WAYPOINT, Frame.GLOBAL, x=e7(home.lat_deg), y=e7(home.lon_deg), z=home.alt_amsl_m)


@dataclass(slots=True)
class Plans:
    """The stored plans. With a home slot, item 0 of the mission is home, whatever was uploaded there."""

    home_slot: bool = True
    items: dict[PlanKind, list[Item]] = field(default_factory=lambda: {kind: [] for kind in PlanKind})
    changes: dict[PlanKind, int] = field(default_factory=lambda: dict.fromkeys(PlanKind, 0))
    current: int = 0

    @property
    def first(self) -> int:
        """The first item of a mission that is flown."""
        return 1 if self.home_slot else 0

    @property
    def mission(self) -> list[Item]:
        return self.items[PlanKind.MISSION]

    @property
    def has_mission(self) -> bool:
        return len(self.mission) > self.first

    def store(self, kind: PlanKind, items: list[Item], home: Place | None) -> None:
        self.items[kind] = items
        self.changes[kind] += 1
        if kind is PlanKind.MISSION:
            self.current = self.first if self.has_mission else 0
            self.home_moved(home)

    def begin_in_place(self, kind: PlanKind, count: int) -> None:
        """Truncates the stored plan to the new length, as ArduPilot does on a MISSION_COUNT."""
        self.items[kind] = self.items[kind][:count]
        self.changes[kind] += 1

    def write_in_place(self, kind: PlanKind, seq: int, item: Item, home: Place | None) -> None:
        """Writes one item over the old one of that number or behind the last."""
        items = self.items[kind]
        self.items[kind] = [*items[:seq], item, *items[seq + 1 :]]
        self.changes[kind] += 1
        if kind is PlanKind.MISSION:
            self.home_moved(home)

    def home_moved(self, home: Place | None) -> None:
        if self.mission and self.home_slot:
            slot = home_item(home) if home is not None else replace(self.mission[0], command=WAYPOINT)
            self.mission[0] = slot
