"""What an autopilot's own failsafe does and why, in words. Pure. The numbers are PX4's."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final


class FailsafeCause(IntEnum):
    """Why its failsafe acts."""

    GENERIC = 0
    MANUAL_CONTROL_LOSS = 1
    GCS_CONNECTION_LOSS = 2
    LOW_BATTERY = 3
    CRITICAL_BATTERY = 4
    EMERGENCY_BATTERY = 5
    LOW_FLIGHT_TIME = 6


class FailsafeAction(IntEnum):
    """What its failsafe does."""

    NONE = 0
    WARN = 1
    POSITION = 2
    ALTITUDE = 3
    STABILIZED = 4
    HOLD = 5
    RETURN = 6
    LAND = 7
    DESCEND = 8
    DISARM = 9
    TERMINATE = 10


CAUSE_WORDS: Final = {
    FailsafeCause.MANUAL_CONTROL_LOSS: "no sticks arrive",
    FailsafeCause.GCS_CONNECTION_LOSS: "no ground station is heard",
    FailsafeCause.LOW_BATTERY: "the battery is low",
    FailsafeCause.CRITICAL_BATTERY: "the battery is critically low",
    FailsafeCause.EMERGENCY_BATTERY: "the battery is nearly empty",
    FailsafeCause.LOW_FLIGHT_TIME: "the battery lasts only for the way home",
}
ACTION_WORDS: Final = {
    FailsafeAction.WARN: "warns only",
    FailsafeAction.POSITION: "flies by sticks, holding its position",
    FailsafeAction.ALTITUDE: "flies by sticks, holding its height only",
    FailsafeAction.STABILIZED: "flies by sticks, holding neither height nor position",
    FailsafeAction.HOLD: "holds",
    FailsafeAction.RETURN: "returns",
    FailsafeAction.LAND: "lands",
    FailsafeAction.DESCEND: "descends without a position",
    FailsafeAction.DISARM: "stops its motors",
    FailsafeAction.TERMINATE: "ends the flight",
}


NOT_TOLD: Final = "its failsafe has chosen the mode, and may return or land"
"""Where no event has said which one."""


@dataclass(frozen=True)
class Failsafe:
    """It has entered a failsafe. `delay_s`: it holds for so long, and acts then."""

    cause: FailsafeCause
    action: FailsafeAction
    delay_s: float = 0.0

    @property
    def words(self) -> str:
        """For a pilot: what it does and why."""
        does = ACTION_WORDS.get(self.action, "acts")
        if self.delay_s:
            does = f"holds, and {does} in {self.delay_s:.0f} s"
        why = CAUSE_WORDS.get(self.cause)
        return f"its failsafe {does}" + (f": {why}" if why else "")
