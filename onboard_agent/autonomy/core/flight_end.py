"""The end of a controller's flight: a stop, then a mode that holds without sticks, seen in a heartbeat. No I/O.

The stop is one velocity of zero ahead of the mode: it counts if the autopilot refuses every mode that holds.
"""

from typing import Any

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker, agent_sender
from onboard_agent.transactions.command_handler import state_words
from onboard_agent.transactions.follow_frames import standing
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.plan_pause import PlanPause
from wire.dialect import mavlink
from wire.transactions import Outcome


class FlightEnd:
    """Call `due` at each tick until there are `words`. `stands`: send the stop first."""

    def __init__(self, maker: FrameMaker, outcome: Outcome, why: str, *, stands: bool) -> None:
        self.outcome = outcome
        self.why = why
        self._maker = maker
        self._stands = stands
        self._pause: PlanPause | None = None

    @property
    def began(self) -> bool:
        """Whether something was sent."""
        return self._pause is not None

    def acknowledged(self, ack: Any, system_id: int, now: float) -> None:
        """Takes a COMMAND_ACK of the autopilot."""
        ours = ack.target_component in (0, AGENT_COMPONENT) and ack.target_system in (0, system_id)
        if self._pause is not None and ours and ack.command == mavlink.MAV_CMD_DO_SET_MODE:
            self._pause.acknowledged(ack, now)

    def heartbeat(self, custom_mode: int) -> None:
        """Takes a HEARTBEAT of the autopilot."""
        if self._pause is not None:
            self._pause.heartbeat(custom_mode)

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        out = []
        if self._pause is None:
            self._pause = PlanPause(self._maker, around, now)
            if self._stands:
                out.append(self._maker.make(standing(around.system_id), agent_sender(around.system_id)))
        return [*out, *self._pause.due(around, now)]

    def words(self, around: Around) -> str:
        """Returns how it ended, for people; empty: it has not."""
        if self._pause is not None and self._pause.mode:
            return f"{self.why}. It holds in {self._pause.mode}."
        if self._pause is not None and self._pause.why_not:
            return f"{self.why}. It was not made to hold: {self._pause.why_not}. {state_words(around)}"
        return ""
