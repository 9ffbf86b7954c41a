"""Collects the messages that are due on the control channel: each on change, all again on a new link. No I/O.

Steps of a hold are queued while there is no link. Everything else is reported in its current state once there is one.
"""

import logging
from collections import deque
from collections.abc import Sequence
from typing import Final

from onboard_agent.autopilot.autopilot_state import AutopilotView
from onboard_agent.autopilot.inquiry import Inquiry
from onboard_agent.failsafe.hold import Hold
from onboard_agent.failsafe.hold_state_reporter import HoldStateReporter
from onboard_agent.telemetry.telemetry_stream import TelemetryStream
from onboard_agent.work import WorkAtDrone
from wire.control_messages import HoldProgress, ToTower
from wire.open_holds import OPEN_HOLDS

_log = logging.getLogger(__name__)

PROGRESS_KEPT: Final = 32
"""Queued steps of holds while there is no link, enough for four holds. The oldest are dropped first, because the
outcome matters most."""

ROOM: Final = 32
"""Maximum number of messages about work at the drone in one call."""


class TowerOutbox:
    """Collects messages from all parts. Call `take` often."""

    def __init__(
        self,
        *,
        autopilot: AutopilotView,
        hold: Hold,
        hold_reporter: HoldStateReporter,
        inquiry: Inquiry,
        stream: TelemetryStream,
        work: WorkAtDrone,
    ) -> None:
        self._autopilot = autopilot
        self._hold = hold
        self._hold_reporter = hold_reporter
        self._inquiry = inquiry
        self._stream = stream
        self._work = work
        self._linked = False
        self._takes_holds = False
        self._progress: deque[HoldProgress] = deque(maxlen=PROGRESS_KEPT)

    def link_up(self, takes: Sequence[str]) -> None:
        """A new link is up, and everything is due again. `takes`: from the tower's welcome."""
        self._takes_holds = OPEN_HOLDS in takes
        self.resumed()

    def resumed(self) -> None:
        """The link continues on another control channel. Messages sent on the old one may be lost."""
        self._linked = True
        self._hold_reporter.resend()
        self._autopilot.resend()
        self._inquiry.resend()
        self._stream.resend()

    def link_down(self) -> None:
        """The link is down."""
        self._linked = False

    def take(self, now: float, room: int) -> list[ToTower]:
        """Returns messages in order; none without a link. `room`: maximum number about work at the drone."""
        for step in self._hold.pop_progress():
            _log.info("hold: %s %s", step.step, step.detail)
            self._progress.append(step)
        if not self._linked:
            return []
        messages: list[ToTower] = list(self._progress)
        self._progress.clear()
        states = (
            self._autopilot.changed(now),
            self._hold_reporter.changed(now) if self._takes_holds else None,
            self._stream.changed(),
            self._inquiry.loss_report(self._autopilot.kind) if self._autopilot.heard else None,
        )
        return [*messages, *(one for one in states if one is not None), *self._work.reports(room=room)]
