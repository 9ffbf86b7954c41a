"""Sticks at rest, for arming a drone without a receiver. No I/O; takes `now`.

Measured on ArduCopter without a receiver: no sticks give "RC not found" or "Radio failsafe on", centred sticks give
"Throttle not neutral". With the throttle at the bottom it arms, from the second stick message on. So while somebody who
may arm is present, the agent sends what a receiver sends for a transmitter at rest. The holder's own sticks pass once
the drone is armed.
"""

from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, ground_station_sender, resting_sticks

EVERY_S: Final = 0.2
"""A radio failsafe starts after 1 s."""


class ArmingSticks:
    """Call `due` at each tick; read `on`."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self.on = False
        self._next_at = 0.0

    def due(self, now: float, *, wanted: bool, vehicle_system_id: int, ground_station_system_id: int) -> list[bytes]:
        """Frames to send now. `wanted`: disarmed, known to be without a receiver, and a person may arm it."""
        self.on = wanted
        if not wanted or now < self._next_at:
            return []
        self._next_at = now + EVERY_S
        return [self._maker.make(resting_sticks(vehicle_system_id), ground_station_sender(ground_station_system_id))]
