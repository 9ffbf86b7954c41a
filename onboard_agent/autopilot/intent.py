"""Classifies a frame from the tower for the failsafe: sticks, or a command. No I/O.

Reads straight from the payload, because sticks arrive fifty times a second.
"""

from struct import Struct
from typing import Final, NamedTuple

from onboard_agent.autopilot.flight_modes import commanded_mode, flies_without_sticks, goes_home
from wire.dialect import mavlink
from wire.frames import message_id, payload

_MANUAL_CONTROL: Final = Struct("<hhhh")  # x pitch, y roll, z throttle, r yaw
_OVERRIDE: Final = Struct("<HHHH")
_COMMAND: Final = Struct("<fffffffH")  # the same offsets in COMMAND_LONG and COMMAND_INT
_SET_MODE: Final = Struct("<I")

NOT_VALID: Final = 32767
LEAVE_ALONE: Final = 65535
GIVE_BACK: Final = 0

CENTRED_WITHIN: Final = 50
"""5 % of 1000, for pitch, roll and yaw."""
THROTTLE_CENTRED_WITHIN: Final = 25
"""5 % of the 500 to either side of the middle."""
CENTRED_WITHIN_US: Final = 25

_ID_SET_MODE: Final = 11
_ID_MANUAL_CONTROL: Final = 69
_ID_OVERRIDE: Final = 70
_ID_COMMAND_INT: Final = 75
_ID_COMMAND_LONG: Final = 76

_GUIDED_MESSAGES: Final = frozenset({82, 84, 86})
"""SET_ATTITUDE_TARGET, SET_POSITION_TARGET_LOCAL_NED, SET_POSITION_TARGET_GLOBAL_INT."""

_HOME_COMMANDS: Final = frozenset({mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, mavlink.MAV_CMD_NAV_LAND})
_GUIDED_COMMANDS: Final = frozenset(
    {
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_DO_REPOSITION,
        mavlink.MAV_CMD_DO_PAUSE_CONTINUE,
        mavlink.MAV_CMD_MISSION_START,
    }
)

INTERESTING: Final = (
    frozenset({_ID_SET_MODE, _ID_MANUAL_CONTROL, _ID_OVERRIDE, _ID_COMMAND_INT, _ID_COMMAND_LONG}) | _GUIDED_MESSAGES
)
"""Message ids that may have an intent for `read_intent`."""


class Sticks(NamedTuple):
    """A person moves or holds the sticks."""

    centred: bool


class Command(NamedTuple):
    """A command for how the drone flies. `needs_sticks`: the new mode needs a hand on the sticks."""

    needs_sticks: bool
    command: int | None = None
    """MAV_CMD; None for a message that is never acknowledged."""
    goes_home: bool = False
    """The commanded flight ends on the ground by itself."""


class Target(NamedTuple):
    """A target position or velocity. An autopilot in a mode with sticks ignores it."""


Intent = Sticks | Command | Target


def read_intent(frame: bytes, *, autopilot_kind: int, middles_us: tuple[int, int, int, int]) -> Intent | None:
    """Returns the intent of one whole frame, or None: most frames have none."""
    msgid = message_id(frame)
    if msgid == _ID_MANUAL_CONTROL:
        return _manual_control(frame)
    if msgid == _ID_OVERRIDE:
        return _override(frame, middles_us)
    if msgid in _GUIDED_MESSAGES:
        return Target()
    if msgid == _ID_SET_MODE:
        (custom_mode,) = _SET_MODE.unpack_from(_padded(frame, _SET_MODE.size))
        return _mode(autopilot_kind, custom_mode, command=None)
    if msgid in (_ID_COMMAND_INT, _ID_COMMAND_LONG):
        return _command(frame, autopilot_kind)
    return None


def _padded(frame: bytes, size: int) -> bytes:
    """Returns the payload with the zeros that MAVLink 2 omits at its end."""
    return payload(frame).ljust(size, b"\0")


def _manual_control(frame: bytes) -> Sticks:
    x, y, z, r = _MANUAL_CONTROL.unpack_from(_padded(frame, _MANUAL_CONTROL.size))
    axes_centred = all(abs(axis) <= CENTRED_WITHIN or axis == NOT_VALID for axis in (x, y, r))
    # For an invalid throttle the radio's applies, which may be at the bottom.
    return Sticks(centred=axes_centred and abs(z - 500) <= THROTTLE_CENTRED_WITHIN)


def _override(frame: bytes, middles_us: tuple[int, int, int, int]) -> Sticks | None:
    channels = _OVERRIDE.unpack_from(_padded(frame, _OVERRIDE.size))
    if all(channel in (LEAVE_ALONE, GIVE_BACK) for channel in channels):
        return None
    return Sticks(
        centred=all(
            abs(channel - middle) <= CENTRED_WITHIN_US for channel, middle in zip(channels, middles_us, strict=True)
        )
    )


def _command(frame: bytes, autopilot_kind: int) -> Command | None:
    _, param2, param3, *_, command = _COMMAND.unpack_from(_padded(frame, _COMMAND.size))
    if command in _GUIDED_COMMANDS:
        return Command(needs_sticks=False, command=command, goes_home=command in _HOME_COMMANDS)
    if command != mavlink.MAV_CMD_DO_SET_MODE:
        return None
    try:
        mode = commanded_mode(autopilot_kind, param2, param3)
    except (ValueError, OverflowError):  # not a number, or infinite: the autopilot will refuse it
        return None
    return _mode(autopilot_kind, mode, command=command)


def _mode(autopilot_kind: int, custom_mode: int, *, command: int | None) -> Command:
    return Command(
        needs_sticks=not flies_without_sticks(autopilot_kind, custom_mode),
        command=command,
        goes_home=goes_home(autopilot_kind, custom_mode),
    )


def arms(frame: bytes) -> bool:
    """Whether this is a command to arm or disarm: a flight command either way."""
    if message_id(frame) not in (_ID_COMMAND_INT, _ID_COMMAND_LONG):
        return False
    command = _COMMAND.unpack_from(_padded(frame, _COMMAND.size))[-1]
    return bool(command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM)
