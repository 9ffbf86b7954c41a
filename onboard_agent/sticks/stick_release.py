"""Gives the sticks back to a person's transmitter at once. No I/O; takes `now`.

Without this, ArduCopter obeys the agent's last centred sticks for RC_OVERRIDE_TIME (3 s) after they stop, and the
transmitter that has just selected a mode moves nothing (measured).
"""

from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, ground_station_sender, released_sticks

TIMES: Final = 3
"""A line may lose a frame. More would look like a transmitter to the autopilot."""
EVERY_S: Final = 0.05


class StickRelease:
    """Call `begin`, then `due` at each tick."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._left = 0
        self._next_at = 0.0

    def begin(self, now: float) -> None:
        """The first frame is due at once."""
        self._left = TIMES
        self._next_at = now

    def due(self, now: float, *, wanted: bool, vehicle_system_id: int, ground_station_system_id: int) -> list[bytes]:
        """Frames to send now. `wanted`: the agent itself sends no sticks."""
        if not wanted:
            self._left = 0
        if not self._left or now < self._next_at:
            return []
        self._left -= 1
        self._next_at = now + EVERY_S
        return [self._maker.make(released_sticks(vehicle_system_id), ground_station_sender(ground_station_system_id))]
