"""Stops a mission in the air, because its plan is about to be written or is in doubt. No I/O.

It uses a mode that holds position without sticks.

Rules, each tested:
- The stop counts when the autopilot's heartbeat shows the mode, not when the mode is accepted.
- Any other flight command wins: a hold or a command ends the attempt, and nothing is written.
- Nothing resumes the mission automatically.
"""

from typing import Any, Final

from onboard_agent.autopilot.flight_modes import modes_of
from onboard_agent.autopilot.mode_names import mode_name
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.mode_ladder import LadderStep, ModeLadder
from onboard_agent.transactions.handler import Around

RUNG_PATIENCE_S: Final = 1.5
"""Longer than one heartbeat interval of an autopilot that sends one per second."""
PATIENCE_S: Final = 5.0


class PlanPause:
    """Call `due` at each tick until `mode` or `why_not` is set."""

    def __init__(self, maker: FrameMaker, around: Around, now: float, *, patience_s: float = PATIENCE_S) -> None:
        modes = modes_of(around.autopilot_kind, around.vehicle_type)
        self.began_at = now
        self.mode = ""
        """Name of the mode in which the drone now holds."""
        self.why_not = "" if modes is not None else "no mode is known in which this vehicle would hold"
        self._patience_s = patience_s
        self._commanded = around.commanded
        self._ladder = ModeLadder(maker)
        if modes is not None:
            self._ladder.climb(modes.pauses, patience_s=RUNG_PATIENCE_S, now=now)

    def acknowledged(self, ack: Any, now: float) -> None:
        """Takes a COMMAND_ACK for MAV_CMD_DO_SET_MODE that is addressed to the agent."""
        self._ladder.acknowledged(ack, now)

    def heartbeat(self, custom_mode: int) -> None:
        """Takes a HEARTBEAT of the autopilot."""
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
