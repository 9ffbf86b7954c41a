"""Entering the mode that obeys set-points, which some autopilots do only while set-points come. No I/O; takes `now`."""

from typing import Final

from onboard_agent.autonomy.core.command_sequence import CommandSequence, SendFrame
from onboard_agent.autonomy.core.flight_phase import obeys_setpoints
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.handler import Around
from wire.autopilots.profile import FlightMode, mode_step

STREAM_FIRST_S: Final = 1.0
SHOWN_WITHIN_S: Final = 3.0
"""After the mode was accepted: some autopilots send one heartbeat a second."""


class ModeEntry(CommandSequence):
    """Call `due` at each tick until `entered` or `why_not`. Send set-points meanwhile."""

    def __init__(self, maker: FrameMaker, mode: FlightMode, send: SendFrame, now: float) -> None:
        super().__init__(maker, [mode_step(mode)], send)
        self._mode = mode
        self._began_at = now
        self._accepted_at: float | None = None

    @staticmethod
    def entered(around: Around) -> bool:
        """Whether a heartbeat shows the mode."""
        return obeys_setpoints(around)

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if now - self._began_at < STREAM_FIRST_S:
            return []
        if self.over:
            self._accepted_at = self._accepted_at or now
            if now - self._accepted_at > SHOWN_WITHIN_S:
                self.why_not = f"{self._mode.name} was accepted, but is not shown"
            return []
        return super().due(around, now)
