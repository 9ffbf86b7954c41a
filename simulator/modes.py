"""The flight modes of ArduCopter: their numbers, and the rules for each.

Another autopilot has another table, but the same physics.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Mode(IntEnum):
    STABILIZE = 0
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    CIRCLE = 7
    LAND = 9
    POSHOLD = 16
    BRAKE = 17


@dataclass(frozen=True, slots=True)
class ModeRules:
    needs_position: bool
    """An armed vehicle can enter and keep it only with a position estimate."""
    armable: bool
    manual_throttle: bool = False
    pilot_controlled: bool = False
    """FS_OPTIONS bit 16: no ground-station failsafe here."""
    commanded_take_off: bool = False
    """MAV_CMD_NAV_TAKEOFF works."""
    counts_as_guided: bool = False
    """MAV_MODE_FLAG_GUIDED_ENABLED in the heartbeat."""
    takes_setpoints: bool = False
    """SET_POSITION_TARGET_* are obeyed."""


RULES: dict[IntEnum, ModeRules] = {
    Mode.STABILIZE: ModeRules(False, True, manual_throttle=True, pilot_controlled=True),
    Mode.ALT_HOLD: ModeRules(False, True, pilot_controlled=True),
    Mode.AUTO: ModeRules(True, False, counts_as_guided=True),
    Mode.GUIDED: ModeRules(True, True, commanded_take_off=True, counts_as_guided=True, takes_setpoints=True),
    Mode.LOITER: ModeRules(True, True, pilot_controlled=True, commanded_take_off=True, counts_as_guided=True),
    Mode.RTL: ModeRules(True, False, counts_as_guided=True),
    Mode.CIRCLE: ModeRules(True, False, counts_as_guided=True),
    Mode.LAND: ModeRules(False, False),
    Mode.POSHOLD: ModeRules(True, True, pilot_controlled=True, commanded_take_off=True, counts_as_guided=True),
    Mode.BRAKE: ModeRules(True, False, counts_as_guided=True),
}


def mode_of(number: int) -> Mode | None:
    try:
        return Mode(number)
    except ValueError:
        return None
