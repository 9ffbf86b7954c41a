"""Fences: drawn areas (polygons and circles to stay in or out of), limits of height and distance, and breaches.

The flavour determines which limits apply and what a breach causes. A breach acts when it sets in, and again every
AGAIN_M farther out; it ends when the vehicle is inside again. A minimum height applies once the vehicle has been above
it, until it lands. Nothing here steers away from a fence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from itertools import pairwise

from simulator.flight_state import FlightState
from simulator.mission_plan import Item, PlanKind
from simulator.notices import Severity

POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT = 5001, 5002, 5003, 5004
CORNERS_MIN = 3
AGAIN_M = 20.0

Point = tuple[float, float]
"""North and east of the origin, metres."""


class Breach(IntEnum):
    """FENCE_BREACH."""

    NONE = 0
    MIN_ALT = 1
    MAX_ALT = 2
    BOUNDARY = 3


@dataclass(frozen=True, slots=True)
class Area:
    """A polygon, or with a radius a circle around its only point."""

    corners: tuple[Point, ...]
    inclusion: bool
    radius_m: float | None = None

    def contains(self, point: Point) -> bool:
        if self.radius_m is not None:
            return math.dist(point, self.corners[0]) <= self.radius_m
        inside, (north, east) = False, point
        for (n1, e1), (n2, e2) in pairwise((*self.corners, self.corners[0])):
            if (n1 > north) != (n2 > north) and east < (e2 - e1) * (north - n1) / (n2 - n1) + e1:
                inside = not inside
        return inside


@dataclass(frozen=True, slots=True)
class FenceLimits:
    """The limits at present. Heights are metres above home; None is no limit."""

    alt_max_m: float | None = None
    alt_min_m: float | None = None
    radius_m: float | None = None
    """Around home."""
    drawn: bool = False
    """Whether the uploaded areas apply."""
    any_inclusion: bool = False
    """Being in one of the inclusion areas is enough; otherwise the vehicle must be in all."""

    @property
    def none(self) -> bool:
        return not self.drawn and self.alt_max_m is None and self.alt_min_m is None and self.radius_m is None


NO_LIMITS = FenceLimits()


@dataclass(slots=True)
class Fence:
    limits: Callable[[FlightState], FenceLimits]
    """Returns the limits at present."""
    on_breach: Callable[[FlightState], IntEnum | None]
    """Acts; returns the mode that must be kept until the breach is over, if any."""
    breaches: dict[str, float] = field(default_factory=dict)
    """Present breaches by name, and the distance outside at the last action, metres."""
    count: int = 0
    last: Breach = Breach.NONE
    last_s: float = 0.0
    kept_mode: IntEnum | None = None
    """The mode that a breach caused, as long as the breach lasts."""
    _above_floor: bool = False
    _areas: tuple[Area, ...] = ()
    _areas_are_whole: bool = True
    _version: int = -1

    def areas(self, flight: FlightState) -> Sequence[Area]:
        version = flight.plans.changes[PlanKind.FENCE]
        if version != self._version:
            to_local = flight.origin.to_local
            self._areas, self._areas_are_whole = read_areas(flight.plans.items[PlanKind.FENCE], to_local)
            self._version = version
        return self._areas

    def outside(self, flight: FlightState, point: Point, alt_m: float) -> dict[str, float]:
        """Returns the names of the fences that this position violates, and the distance outside; 0 if that is not
        measured."""
        limits, found = self.limits(flight), {}
        home_n, home_e, _ = flight.home_local()
        from_home_m = math.dist(point, (home_n, home_e))
        if limits.alt_max_m is not None and alt_m > limits.alt_max_m:
            found["Max Alt"] = alt_m - limits.alt_max_m
        floor_holds = self._above_floor and not flight.disarms_on_landing
        if limits.alt_min_m is not None and alt_m < limits.alt_min_m and floor_holds:
            found["Min Alt"] = limits.alt_min_m - alt_m
        if limits.radius_m is not None and from_home_m > limits.radius_m:
            found["Circle"] = from_home_m - limits.radius_m
        if limits.drawn and not allowed(self.areas(flight), point, any_inclusion=limits.any_inclusion):
            found["Polygon"] = 0.0
        return found

    def why_not_arm(self, flight: FlightState) -> str | None:
        limits = self.limits(flight)
        if limits.none:
            return None
        if not flight.estimator.position_ok:
            return "fence requires position"
        self.areas(flight)
        if limits.drawn and not self._areas_are_whole:
            return "Polygon fence(s) invalid"
        outside = self.outside(flight, (flight.body.north_m, flight.body.east_m), flight.alt_over_home_m())
        return f"vehicle outside {', '.join(outside)} fence" if outside else None

    def update(self, flight: FlightState) -> None:
        if not flight.armed or flight.landed:
            self.breaches, self.kept_mode, self._above_floor = {}, None, False
            return
        limits = self.limits(flight)
        if limits.none:
            self.breaches, self.kept_mode = {}, None
            return
        alt_m = flight.alt_over_home_m()
        self._above_floor |= limits.alt_min_m is not None and alt_m > limits.alt_min_m
        if not flight.estimator.position_ok:
            self.breaches, self.kept_mode = {}, None
            return
        outside = self.outside(flight, (flight.body.north_m, flight.body.east_m), alt_m)
        fresh = [n for n, out_m in outside.items() if n not in self.breaches or out_m > self.breaches[n] + AGAIN_M]
        ended = [name for name in self.breaches if name not in outside]
        self.breaches = {n: out if n in fresh else self.breaches[n] for n, out in outside.items()}
        if ended and not outside:
            self.kept_mode = None
            flight.notify(Severity.NOTICE, f"{', '.join(ended)} fence breach cleared")
        if fresh:
            self.count = min(self.count + 1, 65535)
            self.last, self.last_s = KINDS[fresh[0]], flight.now_s
            flight.notify(Severity.NOTICE, f"{', '.join(fresh)} fence breached")
            self.kept_mode = None
            self.kept_mode = self.on_breach(flight)


KINDS = {"Max Alt": Breach.MAX_ALT, "Min Alt": Breach.MIN_ALT, "Circle": Breach.BOUNDARY, "Polygon": Breach.BOUNDARY}


def allowed(areas: Sequence[Area], point: Point, *, any_inclusion: bool) -> bool:
    inside = [area.contains(point) for area in areas if area.inclusion]
    if inside and not (any(inside) if any_inclusion else all(inside)):
        return False
    return not any(area.contains(point) for area in areas if not area.inclusion)


def read_areas(items: Sequence[Item], to_local: Callable[[float, float], Point]) -> tuple[tuple[Area, ...], bool]:
    """Returns the areas of a fence's items, and whether all of the items form areas.

    Each corner states how many corners its polygon has; they are consecutive.
    """
    areas: list[Area] = []
    whole, at = True, 0
    while at < len(items):
        item = items[at]
        count = int(item.number(0)) if item.command in (POLYGON_IN, POLYGON_OUT) else 1
        group = [other for other in items[at : at + max(count, 1)] if other.command == item.command]
        points = tuple(to_local(corner.x * 1e-7, corner.y * 1e-7) for corner in group)
        if item.command in (CIRCLE_IN, CIRCLE_OUT):
            areas.append(Area(points, item.command == CIRCLE_IN, item.number(0)))
        elif item.command in (POLYGON_IN, POLYGON_OUT):
            if count >= CORNERS_MIN and len(group) == count:
                areas.append(Area(points, item.command == POLYGON_IN))
            else:
                whole = False
        at += max(len(group), 1)
    return tuple(areas), whole
