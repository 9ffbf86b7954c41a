"""When LANDING_TARGET goes to the autopilot. Pure, and given the time.

At a fixed rate, whatever the camera does: each sighting once, the newest only, and none that is old. So the autopilot
never counts one picture twice, and notices by itself when the pad is out of sight.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender
from onboard_agent.vision.landing_target import LandingTarget
from wire.dialect import mavlink

RATE_HZ: Final = 20.0
MAX_AGE_S: Final = 0.25
"""From the picture to the message: ArduPilot's PLND_LAG ends here."""


class TargetSender:
    """Call `saw` for each sighting, and `due` at each tick."""

    def __init__(self, maker: FrameMaker, rate_hz: float = RATE_HZ) -> None:
        self._maker = maker
        self._every_s = 1.0 / rate_hz
        self._next_s = float("-inf")
        self._newest: tuple[LandingTarget, float] | None = None
        self.sent = 0
        self.late = 0
        """Sightings that came too late to be of use."""

    def saw(self, target: LandingTarget, taken_s: float) -> None:
        """`taken_s`: when the picture was taken, by the clock of `due`."""
        if self._newest is None or taken_s > self._newest[1]:
            self._newest = (target, taken_s)

    def due(self, system_id: int, now: float) -> list[bytes]:
        """Returns the frame to send now, if there is one."""
        if now < self._next_s:
            return []
        # On a grid, so that a late tick does not slow the rate down; not to be made up for after a pause.
        started = self._next_s > float("-inf")
        self._next_s = max(self._next_s + self._every_s, now + self._every_s / 2) if started else now + self._every_s
        newest, self._newest = self._newest, None
        if newest is None:
            return []
        target, taken_s = newest
        if now - taken_s > MAX_AGE_S:
            self.late += 1
            return []
        self.sent += 1
        message = mavlink.MAVLink_landing_target_message(**asdict(target))
        return [self._maker.make(message, agent_sender(system_id))]
