"""Recovery after an agent restart while the drone holds or flies through the tower. No I/O; takes `now`.

Rules, each tested:
- If sticks were in force, centred sticks continue at once, because the autopilot forgets sticks within seconds.
- No mode is requested before a heartbeat: a drone that returns or lands by itself by then continues.
- A drone that held or was flown by hand is held, if it is armed. One that flew by command goes on, and the tower has
  had a part in this flight: if nobody has its controls, that is noticed.
"""

import logging
from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message
from onboard_agent.failsafe.failsafe import Failsafe
from onboard_agent.failsafe.hold import Hold
from onboard_agent.failsafe.hold_memory import HoldRecord
from wire.control_messages import HoldCause
from wire.dialect import mavlink

_log = logging.getLogger(__name__)

ASK_EVERY_S: Final = 0.1
GIVE_UP_AFTER_S: Final = 30.0
"""An autopilot that is silent for this long is absent, and has forgotten its sticks long before."""


class AfterRestart:
    """Call `due` at each tick, and `heartbeat` for each HEARTBEAT of the autopilot, until `over`."""

    def __init__(self, maker: FrameMaker, record: HoldRecord | None, now: float) -> None:
        self._maker = maker
        self._record = record
        self._began_at = now
        self._next_ask_at = now
        self.words = ""
        """The outcome, for people."""

    @property
    def over(self) -> bool:
        """Whether nothing is left to do."""
        return self._record is None

    @property
    def record(self) -> HoldRecord | None:
        """The record that the previous process left."""
        return self._record

    def due(self, now: float, hold: Hold) -> list[bytes]:
        """Frames to send to the autopilot now, besides the sticks of `hold`."""
        record = self._record
        if record is None:
            return []
        if now - self._began_at > GIVE_UP_AFTER_S:
            hold.overruled(needs_sticks=False, now=now, why="no heartbeat from the autopilot")
            self._record = None
            return []
        if record.sticks and not hold.sticks_on:
            hold.keep_centred(now)
        if now < self._next_ask_at:
            return []
        self._next_ask_at = now + ASK_EVERY_S
        ask = request_message(record.system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0)
        return [self._maker.make(ask, agent_sender(record.system_id))]

    def heartbeat(self, failsafe: Failsafe, hold: Hold, now: float, *, armed: bool) -> None:
        """Handles the first HEARTBEAT of the autopilot: lets a return or landing continue, or holds."""
        record, self._record = self._record, None
        if record is None or not armed:
            return
        failsafe.tower_was_in_this_flight(now)
        if not (record.held or record.sticks):
            return
        before = "held" if record.held else "was flown by hand"
        if failsafe.going_home:
            self.words = f"the agent was started again; the autopilot {failsafe.own_action} by itself, and goes on"
            hold.overruled(needs_sticks=False, now=now, why=self.words)
        else:
            self.words = f"the agent was started again while the drone {before}"
            failsafe.hold_now(HoldCause.PILOT_LOST, now, why=self.words, without_sticks=not record.sticks)
        _log.warning("%s", self.words)
