"""Which model of an airframe a vehicle flies on, and how it is made.

The sensing one needs NumPy, so it is imported only when it is wanted.
"""

from __future__ import annotations

from enum import StrEnum

from simulator.airframe import Airframe


class AirframeModel(StrEnum):
    EXACT = "exact"
    """A plain rigid body; the vehicle knows the truth."""
    SENSING = "sensing"
    """Physics from dimensions, sensors with errors, and a filter: the vehicle knows what its filter believes."""


def make_airframe(model: AirframeModel, yaw_rad: float, seed: int, boot_s: float) -> Airframe:
    if model is AirframeModel.EXACT:
        return Airframe(yaw_rad)
    from simulator.firmware.sensing_airframe import SensingAirframe

    return SensingAirframe(yaw_rad, seed, boot_s)
