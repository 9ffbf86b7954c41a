"""Commands to the autopilot one after the other, each with its acknowledgement. No I/O; takes `now`.

The rules of an answer are those of `CommandAnswer`: retries, IN_PROGRESS, the other message.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker, agent_sender
from onboard_agent.transactions.command_answer import ANSWER_WITHIN_S, CommandAnswer
from onboard_agent.transactions.handler import Around
from wire.autopilots.command_messages import makers
from wire.autopilots.commands import CommandStep
from wire.transactions import Outcome

TRIES: Final = 3

SendFrame = Callable[[bytes, float], str | None]
"""Returns why the frame must not go to the autopilot, or None: it counts as sent."""


class CommandSequence:
    """Call `due` at each tick until `over` or `why_not`."""

    def __init__(self, maker: FrameMaker, steps: Sequence[CommandStep], send: SendFrame) -> None:
        self._maker = maker
        self._steps = [step for step in steps if not step.needless]
        self._send = send
        self._answer: CommandAnswer | None = None
        """To the first step."""
        self.why_not = ""
        """Why a step failed."""

    @property
    def over(self) -> bool:
        """Whether every step was accepted."""
        return not self._steps

    def acknowledged(self, ack: Any, system_id: int, now: float) -> None:
        """Takes a COMMAND_ACK of the autopilot."""
        ours = (ack.target_system, ack.target_component) in ((system_id, AGENT_COMPONENT), (0, 0))
        if not ours or self._answer is None:
            return
        self._answer.acknowledged(ack, now)
        end = self._answer.end
        if end is None:
            return
        if end.outcome is Outcome.DONE:
            self._steps.pop(0)
            self._answer = None
        else:
            self.why_not = f"{self._steps[0].phase}: {end.code.removeprefix('MAV_RESULT_')}"

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if self.why_not or not self._steps:
            return []
        step = self._steps[0]
        self._answer = self._answer or self._asked(step, around, now)
        frames = self._answer.due(now)
        if self._answer.end is not None:
            self.why_not = f"{step.phase}: no answer"
        for frame in frames:
            self.why_not = self.why_not or self._send(frame, now) or ""
        return [] if self.why_not else frames

    def _asked(self, step: CommandStep, around: Around, now: float) -> CommandAnswer:
        sender = agent_sender(around.system_id)
        make, make_other = makers(
            step.work, around.system_id, around.autopilot_kind, lambda message: self._maker.make(message, sender)
        )
        deadline = now + ANSWER_WITHIN_S * TRIES
        return CommandAnswer(step.work.command, make, make_other=make_other, deadline=deadline, tries=TRIES)
