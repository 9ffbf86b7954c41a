"""Commands to the autopilot one after the other, each with its acknowledgement. No I/O; takes `now`.

A take-off is never repeated: whether it was lost or its answer was, is not known.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker, agent_sender, command_long
from onboard_agent.failsafe.mode_ladder import result_name
from wire.autopilots.commands import CommandStep
from wire.dialect import mavlink

ANSWER_WITHIN_S: Final = 1.5
TRIES: Final = 3
_NAN: Final = float("nan")
_ONCE: Final = frozenset({int(mavlink.MAV_CMD_NAV_TAKEOFF)})

SendFrame = Callable[[bytes, float], str | None]
"""Returns why the frame must not go to the autopilot, or None: it counts as sent."""


class CommandSequence:
    """Call `due` at each tick until `over` or `why_not`."""

    def __init__(self, maker: FrameMaker, steps: Sequence[CommandStep], send: SendFrame) -> None:
        self._maker = maker
        self._steps = [step for step in steps if not step.needless]
        self._send = send
        self._tries = 0
        self._next_at = float("-inf")
        self.why_not = ""
        """Why a step failed."""

    @property
    def over(self) -> bool:
        """Whether every step was accepted."""
        return not self._steps

    def acknowledged(self, ack: Any, system_id: int, now: float) -> None:
        """Takes a COMMAND_ACK of the autopilot."""
        ours = (ack.target_system, ack.target_component) in ((system_id, AGENT_COMPONENT), (0, 0))
        if not ours or not self._steps or not self._tries or ack.command != self._steps[0].work.command:
            return
        if ack.result == mavlink.MAV_RESULT_ACCEPTED:
            self._steps.pop(0)
            self._tries, self._next_at = 0, float("-inf")
        elif ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            self._next_at = now + ANSWER_WITHIN_S * TRIES
        else:
            self.why_not = f"{self._steps[0].phase}: {result_name(ack.result)}"

    def due(self, system_id: int, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if self.why_not or not self._steps or now < self._next_at:
            return []
        step = self._steps[0]
        if self._tries >= (1 if step.work.command in _ONCE else TRIES):
            self.why_not = f"{step.phase}: no answer"
            return []
        params = [_NAN if value is None else value for value in step.work.params]
        message = command_long(system_id, step.work.command, *params, confirmation=self._tries)
        frame = self._maker.make(message, agent_sender(system_id))
        why_not = self._send(frame, now)
        if why_not is not None:
            self.why_not = why_not
            return []
        self._tries += 1
        self._next_at = now + ANSWER_WITHIN_S
        return [frame]
