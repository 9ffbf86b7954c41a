"""A vehicle of the simulator in the place of `ModelCopter`: the whole flight code and its faults, on the same clock."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.vehicle import Vehicle, VehicleSettings

HOME = Place(47.397742, 8.545594, 488.0)


class SimulatedCopter:
    """`flight`: settings of the flight; `options`: of the vehicle."""

    def __init__(self, now: float, *, flight: dict[str, Any], **options: Any) -> None:
        self.now = self._began = now
        self.vehicle = Vehicle(VehicleSettings(FlightSettings(HOME, **flight), **options))

    def step(self, now: float) -> list[bytes]:
        self.now = now
        self.vehicle.step(now - self._began)
        return self.vehicle.datagrams_to_send()

    def receive(self, frames: Iterable[bytes]) -> None:
        for frame in frames:
            self.vehicle.receive(frame, self.now - self._began)

    @property
    def height_m(self) -> float:
        """In truth."""
        return self.vehicle.flight.body.true_pose[2]

    @property
    def speed_m_s(self) -> float:
        body = self.vehicle.flight.body
        return math.hypot(body.vn_mps, body.ve_mps)
