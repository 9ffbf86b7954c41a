"""The class that flies each mode of ArduCopter."""

from __future__ import annotations

from enum import IntEnum

from simulator.auto import Auto
from simulator.behaviours import Behaviour
from simulator.flight_state import FlightState
from simulator.guided import Guided
from simulator.homing import Land, ReturnToLaunch
from simulator.modes import Mode
from simulator.piloted import AltHold, Brake, Circle, Loiter, Stabilize


def make_behaviours(flight: FlightState) -> dict[IntEnum, Behaviour]:
    return {
        Mode.STABILIZE: Stabilize(flight),
        Mode.ALT_HOLD: AltHold(flight),
        Mode.AUTO: Auto(flight),
        Mode.GUIDED: Guided(flight),
        Mode.LOITER: Loiter(flight),
        Mode.RTL: ReturnToLaunch(flight),
        Mode.CIRCLE: Circle(flight),
        Mode.LAND: Land(flight),
        Mode.POSHOLD: Loiter(flight),
        Mode.BRAKE: Brake(flight),
    }
