"""A camera that takes photographs by command, every so many metres, or every so many seconds. There are no pictures:
what comes of it is one message for each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from simulator.geodesy import Place

if TYPE_CHECKING:
    from simulator.flight import Flight

INTERVAL_MIN_S = 0.1


@dataclass(frozen=True, slots=True)
class Photo:
    number: int
    """From 1."""
    place: Place
    alt_over_home_m: float


class Camera:
    def __init__(self) -> None:
        self.taken = 0
        self._every_m = 0.0
        self._last: tuple[float, float] | None = None
        self._every_s = 0.0
        self._left = 0
        """Of those in a row; -1 is no end."""
        self._due_s = 0.0

    @property
    def interval_s(self) -> float | None:
        """Between those that it takes in a row; None: it takes none."""
        return self._every_s if self._left else None

    def every_metres(self, flight: Flight, distance_m: float, *, at_once: bool) -> None:
        """0 ends it."""
        self._every_m = max(distance_m, 0.0)
        self._last = None
        if at_once and self._every_m > 0.0:
            self.shoot(flight)

    def every_seconds(self, flight: Flight, interval_s: float, count: int) -> None:
        """The first one now; `count` 0 goes on until `stop`."""
        self._every_s = max(interval_s, INTERVAL_MIN_S)
        self._left = count if count > 0 else -1
        self._due_s = flight.now_s

    def stop(self) -> None:
        self._left = 0

    def update(self, flight: Flight) -> None:
        """One tick."""
        if self._left and flight.now_s >= self._due_s:
            self._due_s += self._every_s
            self._left -= self._left > 0
            self.shoot(flight)
        if self._every_m <= 0.0 or not flight.estimator.position_ok:
            return
        here = (flight.body.north_m, flight.body.east_m)
        if self._last is None:
            self._last = here
        elif math.dist(here, self._last) >= self._every_m:
            self.shoot(flight)

    def shoot(self, flight: Flight) -> None:
        """With no position it takes none: nobody could say where."""
        place = flight.known_place
        if place is None:
            return
        self.taken += 1
        self._last = (flight.body.north_m, flight.body.east_m)
        flight.on_photo(Photo(self.taken, place, flight.alt_over_home_m()))
