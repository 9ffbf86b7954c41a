"""`control-tower-sdk`: drones of a tower for programs in Python.

    async with Tower("https://tower.example.org", token) as tower:
        async with tower.drone("Kestrel").fly() as flight:
            await flight.take_off(10)
            await flight.land()

`control_tower.sync` has the same for programs without asyncio. docs/sdk.md describes all of it.
"""

from typing import Final

from control_tower.drone import Drone
from control_tower.errors import (
    ControlLost,
    FlightTimeout,
    OperationFailed,
    Refused,
    SignInRefused,
    TooSlow,
    TowerError,
    TowerUnreachable,
)
from control_tower.flight import Flight
from control_tower.geodesy import distance_m, offset, turned
from control_tower.mission import Mission
from control_tower.tower import Tower
from control_tower.values import DroneState, Loss, LossCause, Operation, Telemetry, User

VERSION: Final = "0.3.0.dev0"
"""Of the distribution `control-tower-sdk`: the same as of the tower (`server.VERSION`)."""

__all__ = [
    "ControlLost",
    "Drone",
    "DroneState",
    "Flight",
    "FlightTimeout",
    "Loss",
    "LossCause",
    "Mission",
    "Operation",
    "OperationFailed",
    "Refused",
    "SignInRefused",
    "Telemetry",
    "TooSlow",
    "Tower",
    "TowerError",
    "TowerUnreachable",
    "User",
    "distance_m",
    "offset",
    "turned",
]
