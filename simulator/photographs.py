"""Takes photographs on command, by distance or by time.

It produces no pictures: each photograph results in one message.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from simulator.airframe import Airframe
from simulator.estimator import Estimator
from simulator.geodesy import Place

INTERVAL_MIN_S = 0.1


@dataclass(frozen=True, slots=True)
class Photo:
    number: int
    """From 1."""
    place: Place
    alt_over_home_m: float


class Carrier(Protocol):
    """The camera's interface to the vehicle that carries it."""

    now_s: float
    body: Airframe
    estimator: Estimator
    on_photo: Callable[[Photo], None]

    @property
    def known_place(self) -> Place | None: ...
    def alt_over_home_m(self) -> float: ...


class Camera:
    def __init__(self) -> None:
        self.taken = 0
        self._every_m = 0.0
        self._last: tuple[float, float] | None = None
        self._every_s = 0.0
        self._left = 0
        """Remaining photographs of a series; -1 is no end."""
        self._due_s = 0.0

    @property
    def interval_s(self) -> float | None:
        """Interval of the running series; None: no series."""
        return self._every_s if self._left else None

    def every_metres(self, carrier: Carrier, distance_m: float, *, at_once: bool) -> None:
        """A distance of 0 stops the series."""
        self._every_m = max(distance_m, 0.0)
        self._last = None
        if at_once and self._every_m > 0.0:
            self.shoot(carrier)

    def every_seconds(self, carrier: Carrier, interval_s: float, count: int) -> None:
        """Takes the first one now; `count` 0 continues until `stop`."""
        self._every_s = max(interval_s, INTERVAL_MIN_S)
        self._left = count if count > 0 else -1
        self._due_s = carrier.now_s

    def stop(self) -> None:
        self._left = 0

    def update(self, carrier: Carrier) -> None:
        """Runs one tick."""
        if self._left and carrier.now_s >= self._due_s:
            self._due_s += self._every_s
            self._left -= self._left > 0
            self.shoot(carrier)
        if self._every_m <= 0.0 or not carrier.estimator.position_ok:
            return
        here = (carrier.body.north_m, carrier.body.east_m)
        if self._last is None:
            self._last = here
        elif math.dist(here, self._last) >= self._every_m:
            self.shoot(carrier)

    def shoot(self, carrier: Carrier) -> None:
        """Takes none without a position, because it would have no location."""
        place = carrier.known_place
        if place is None:
            return
        self.taken += 1
        self._last = (carrier.body.north_m, carrier.body.east_m)
        carrier.on_photo(Photo(self.taken, place, carrier.alt_over_home_m()))
