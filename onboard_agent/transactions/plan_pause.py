"""Stops a mission in the air, because its plan is to be written or is in doubt. No I/O.

The mode keeps the position without sticks. Rules, each tested:

- It counts when the autopilot's heartbeat shows it, not when it is accepted.
- Other flight commands win: a hold or a command ends the requests, and nothing is written.
- Nothing resumes the mission by itself.
"""

from typing import Any, Final

from onboard_agent.autopilot.flight_modes import modes_of
from onboard_agent.autopilot.mode_names import mode_name
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.mode_ladder import LadderStep, ModeLadder
from onboard_agent.transactions.handler import Around

RUNG_PATIENCE_S: Final = 1.5
"""More than one beat of an autopilot that beats once a second."""
PATIENCE_S: Final = 5.0


class PlanPause:
    """Call `due` at each tick until `mode` or `why_not` is set."""

    def __init__(self, maker: FrameMaker, around: Around, now: float, *, patience_s: float = PATIENCE_S) -> None:
        modes = modes_of(around.autopilot_kind, around.vehicle_type)
        self.began_at = now
        self.mode = ""
        """The name of the mode in which the drone holds now."""
        self.why_not = "" if modes is not None else "no mode is known in which this vehicle would hold"
        self._patience_s = patience_s
        self._commanded = around.commanded
        self._ladder = ModeLadder(maker)
        if modes is not None:
            self._ladder.climb(modes.pauses, patience_s=RUNG_PATIENCE_S, now=now)

    def acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK for MAV_CMD_DO_SET_MODE that is meant for the agent."""
        self._ladder.acknowledged(ack, now)

    def heartbeat(self, custom_mode: int) -> None:
        """A HEARTBEAT of the autopilot."""
        self._ladder.heartbeat(custom_mode)

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if self.mode or self.why_not:
            return []
        if any(reached.step is LadderStep.CONFIRMED for reached in self._ladder.pop_reached()):
            self.mode = mode_name(around.autopilot_kind, around.vehicle_type, around.custom_mode)
        elif around.holding or around.commanded != self._commanded:
            self.why_not = "somebody else has commanded it in the meantime"
        elif now - self.began_at >= self._patience_s:
            self.why_not = self._ladder.why_not()
        else:
            return self._ladder.due(now, vehicle_system_id=around.system_id)
        return []
