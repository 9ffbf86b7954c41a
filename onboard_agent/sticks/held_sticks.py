"""The agent's sticks during a hold: centred at 20 Hz, or climbing when the drone is low and sinking. No I/O.

On the ground the throttle rests: with a centred one ArduCopter's DISARM_DELAY never comes, and the motors of a drone
that nobody attends would turn until its battery is empty (measured: still armed at 100 s).
"""

from typing import Any, Final

from onboard_agent.autopilot.own_frames import (
    FrameMaker,
    centred_sticks,
    climbing_sticks,
    ground_station_sender,
    resting_sticks,
)
from onboard_agent.failsafe.flying import Flying

STICKS_INTERVAL_S: Final = 0.05

_EARLY_S: Final = 0.005
"""A frame may go this much early, so that tick jitter does not halve the rate."""


class HeldSticks:
    """Call `begin`, then `due` at each tick. Set `on` to False to stop."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self.on = False
        self._next_at = 0.0
        self._made: Any = None
        self._still_since = 0.0

    def begin(self, now: float) -> None:
        """The first frame is due at once."""
        self.on = True
        if now - self._next_at > STICKS_INTERVAL_S:
            self._made = None
        self._next_at = now

    def still_s(self, now: float) -> float:
        """For how long the same sticks have been sent; 0 before the first frame."""
        return 0.0 if self._made is None else now - self._still_since

    def due(self, now: float, flying: Flying) -> list[bytes]:
        """The frame to send to the autopilot now, if any."""
        if not self.on or not flying.may_be_held or now < self._next_at - _EARLY_S:
            return []
        self._next_at = max(self._next_at + STICKS_INTERVAL_S, now)
        make = climbing_sticks if flying.low_and_sinking else resting_sticks if flying.stands else centred_sticks
        if make is not self._made:
            self._made, self._still_since = make, now
        sender = ground_station_sender(flying.ground_station_system_id)
        return [self._maker.make(make(flying.vehicle_system_id), sender)]
