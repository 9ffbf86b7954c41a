"""A flight mode as an object: while it is the current mode, it sets the motor commands every tick."""

from __future__ import annotations

from simulator.flight_state import FlightState


class Behaviour:
    """One flight mode. `enter` and `run` are only called while it is the vehicle's mode."""

    def __init__(self, flight: FlightState) -> None:
        self.flight = flight

    @property
    def disarms_on_landing(self) -> bool:
        return False

    @property
    def waits_to_take_off(self) -> bool:
        """On the ground during a take-off: low throttle must not disarm the vehicle."""
        return False

    def why_not(self) -> str | None:
        """Returns a reason specific to this mode to refuse entry."""
        return None

    def enter(self) -> None:
        """The target starts at the vehicle, with its velocity."""

    def run(self) -> None:
        """Flies one tick: sets the motor commands."""
        raise NotImplementedError

    def take_off(self, alt_over_home_m: float) -> bool:
        del alt_over_home_m
        return False

    def pause(self) -> bool:
        return False

    def resume(self) -> bool:
        return False
