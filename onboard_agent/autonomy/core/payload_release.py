"""Letting the payload go: the setting, and the command with its acknowledgement. No I/O; takes `now`."""

import re
from typing import Final

from onboard_agent.autonomy.core.acknowledgement import Acknowledgement
from onboard_agent.autonomy.core.command_sequence import CommandSequence, SendFrame
from onboard_agent.autonomy.core.lines import DirectionState
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.unusable import Unusable
from wire.autopilots.commands import CommandStep
from wire.dialect import mavlink
from wire.transactions import CommandWork

FORMS: Final = "gripper:NUMBER or servo:OUTPUT=MICROSECONDS"
USUAL: Final = "gripper:1"
_GRIPPER: Final = re.compile(r"gripper:([1-9]\d?)")
_SERVO: Final = re.compile(r"servo:([1-9]\d?)=(\d{3,4})")


def parse_release(text: str) -> CommandWork:
    """Returns the command that lets the payload go. Raises Unusable."""
    gripper, servo = _GRIPPER.fullmatch(text), _SERVO.fullmatch(text)
    if gripper is not None:
        release = float(mavlink.GRIPPER_ACTION_RELEASE)
        return CommandWork(int(mavlink.MAV_CMD_DO_GRIPPER), (float(gripper[1]), release, 0.0, 0.0, 0.0, 0.0, 0.0))
    if servo is not None and 500 <= int(servo[2]) <= 2500:
        place = (float(servo[1]), float(servo[2]), 0.0, 0.0, 0.0, 0.0, 0.0)
        return CommandWork(int(mavlink.MAV_CMD_DO_SET_SERVO), place)
    raise Unusable(f"payload_release: {text!r} is not {FORMS}, with 500 to 2500 microseconds")


class PayloadRelease(CommandSequence):
    """Call `settle` at each tick until it is True, and send what `due` returns."""

    def __init__(self, maker: FrameMaker, work: CommandWork, send: SendFrame) -> None:
        super().__init__(maker, [CommandStep("letting the payload go", work)], send)

    def settle(self, acknowledgement: Acknowledgement) -> bool:
        """Whether it is over; the direction is then done or refused."""
        if self.over:
            acknowledgement.ended(DirectionState.DONE)
        elif self.why_not:
            acknowledgement.ended(DirectionState.REFUSED, self.why_not)
        return self.over or bool(self.why_not)
