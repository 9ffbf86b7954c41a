"""What a frame may do: one table from a message to the permitted senders. Pure; knows no socket and no drone.

The table is short on purpose. Viewers may read, a few things are forbidden to all, and everything else, known or not,
requires the controls: a message that this file does not know might fly the drone.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from struct import Struct
from typing import Final

from wire.autopilots.registry import FAMILIES
from wire.dialect import mavlink
from wire.drops import DropReason
from wire.frames import message_id, payload


class Permission(StrEnum):
    """Who may send a message."""

    WATCHER = "watcher"
    """Read-only: all who may watch the drone."""
    HOLDER = "holder"
    """Whoever has the controls, or the turn of an assistant."""
    NOBODY = "nobody"


class Kind(StrEnum):
    """What a message is for the failsafes."""

    STICKS = "sticks"
    COMMAND = "command"
    OTHER = "other"


_M: Final = mavlink

MESSAGES: Final[Mapping[int, Permission]] = {
    _M.MAVLINK_MSG_ID_SETUP_SIGNING: Permission.NOBODY,  # a signing key in the clear
    _M.MAVLINK_MSG_ID_CHANGE_OPERATOR_CONTROL: Permission.NOBODY,  # who has the controls is the tower's to say
    _M.MAVLINK_MSG_ID_AUTH_KEY: Permission.NOBODY,
    _M.MAVLINK_MSG_ID_PING: Permission.WATCHER,
    _M.MAVLINK_MSG_ID_TIMESYNC: Permission.WATCHER,
    _M.MAVLINK_MSG_ID_PARAM_REQUEST_READ: Permission.WATCHER,
    _M.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: Permission.WATCHER,
    _M.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: Permission.WATCHER,
    _M.MAVLINK_MSG_ID_MISSION_REQUEST_INT: Permission.WATCHER,
    _M.MAVLINK_MSG_ID_MISSION_REQUEST: Permission.WATCHER,
    _M.MAVLINK_MSG_ID_LOG_REQUEST_LIST: Permission.WATCHER,
}
"""Message id to who may send it; what is not here is the holder's."""

REQUEST_OPERATOR_CONTROL: Final = 32100
"""MAV_CMD_REQUEST_OPERATOR_CONTROL, newer than the dialect that is installed."""

COMMANDS: Final[Mapping[int, Permission]] = {
    REQUEST_OPERATOR_CONTROL: Permission.NOBODY,  # who has the controls is the tower's to say
    _M.MAV_CMD_REQUEST_MESSAGE: Permission.WATCHER,
    _M.MAV_CMD_GET_HOME_POSITION: Permission.WATCHER,
    _M.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: Permission.WATCHER,
}
"""MAV_CMD to who may send it; what is not here is the holder's."""

AUX_ARMS: Final = frozenset[float]().union(*(family.arming_switches for family in FAMILIES.values()))
"""Switches (param1 of MAV_CMD_DO_AUX_FUNCTION) that arm any known autopilot."""

AUX_STOPS: Final = AUX_ARMS.union(*(family.stopping_switches for family in FAMILIES.values()))
"""Those that stop motors."""

_ARM_TOO: Final = frozenset[int]().union(*(family.arming_commands for family in FAMILIES.values()))

_FLIES: Final = frozenset(
    {
        *(_M.MAV_CMD_DO_SET_MODE, _M.MAV_CMD_DO_SET_STANDARD_MODE, _M.MAV_CMD_DO_PAUSE_CONTINUE),
        *(_M.MAV_CMD_NAV_RETURN_TO_LAUNCH, _M.MAV_CMD_NAV_LAND, _M.MAV_CMD_NAV_TAKEOFF),
        *(_M.MAV_CMD_DO_REPOSITION, _M.MAV_CMD_MISSION_START, _M.MAV_CMD_DO_FLIGHTTERMINATION),
    }
)

ASK_AGAIN_WITHIN_S: Final = 5.0
"""A command that ends a flight must be sent a second time, as a new one, within this time."""

_COMMAND: Final = Struct("<fffffffHBBB")
"""COMMAND_LONG as it travels: seven parameters, command, target system, target component, confirmation."""

_COMMAND_IDS: Final = (_M.MAVLINK_MSG_ID_COMMAND_LONG, _M.MAVLINK_MSG_ID_COMMAND_INT)
_STICK_IDS: Final = (_M.MAVLINK_MSG_ID_MANUAL_CONTROL, _M.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE)


@dataclass(frozen=True)
class CommandSeen:
    """The head of a COMMAND_LONG or COMMAND_INT. `repeat`: its confirmation field marks a repetition."""

    command: int
    param1: float
    param2: float
    target_system: int
    target_component: int
    repeat: bool


@dataclass(frozen=True)
class Authorization:
    """How the sender and the drone stand to each other at this moment."""

    has_turn: bool
    """The holder, or the assistant while it is their turn."""
    armed: bool | None
    """None: not known."""
    airborne: bool | None
    """None: not known, so it may be."""
    loss_check_open: bool
    """A loss would be dangerous with this drone's setup, and the sender has not acknowledged that."""
    may_read: bool = True
    """False for observers: they ask the drone for nothing."""


def kind_of(frame: bytes) -> Kind:
    """What a whole frame is for the failsafes. Anything that is neither sticks nor read-only counts as a command."""
    msgid = message_id(frame)
    if msgid in _STICK_IDS:
        return Kind.STICKS
    return Kind.OTHER if MESSAGES.get(msgid) is Permission.WATCHER else Kind.COMMAND


def command_in(frame: bytes) -> CommandSeen | None:
    """The command in a whole frame, or None where it is another message."""
    msgid = message_id(frame)
    if msgid not in _COMMAND_IDS:
        return None
    fields = _COMMAND.unpack_from(payload(frame).ljust(_COMMAND.size, b"\0"))
    is_long = msgid == _M.MAVLINK_MSG_ID_COMMAND_LONG
    return CommandSeen(
        command=fields[7],
        param1=fields[0],
        param2=fields[1],
        target_system=fields[8],
        target_component=fields[9],
        # COMMAND_INT has another field (the frame) where COMMAND_LONG counts repetitions.
        repeat=is_long and fields[10] > 0,
    )


def permission_for(frame: bytes, command: CommandSeen | None) -> Permission:
    """Who may send a whole frame."""
    if command is not None:
        return COMMANDS.get(command.command, Permission.HOLDER)
    return MESSAGES.get(message_id(frame), Permission.HOLDER)


def ends_the_flight(command: CommandSeen, standing: Authorization) -> bool:
    """Whether it makes the drone fall: flight termination, or disarming or rebooting where it is not known to be on the
    ground.

    A parameter that is no number counts as the worse: who knows what an autopilot makes of it.
    """
    if command.command == _M.MAV_CMD_DO_FLIGHTTERMINATION:
        return not command.param1 <= 0.5
    disarms = command.command == _M.MAV_CMD_COMPONENT_ARM_DISARM and not command.param1 >= 0.5
    stops = command.command == _M.MAV_CMD_DO_AUX_FUNCTION and command.param1 in AUX_STOPS
    return standing.airborne is not False and (
        disarms or stops or command.command == _M.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
    )


def arms(command: CommandSeen) -> bool:
    """Whether it may arm the drone: by the command for it, or beside what it is for."""
    if command.command == _M.MAV_CMD_COMPONENT_ARM_DISARM:
        return not command.param1 < 0.5
    if command.command == _M.MAV_CMD_DO_AUX_FUNCTION:
        return command.param1 in AUX_ARMS
    return command.command in _ARM_TOO


def changes_the_flight(frame: bytes, command: CommandSeen | None) -> bool:
    """Whether a whole frame tells the drone to fly otherwise than it does, or disarms it."""
    if command is None:
        return bool(message_id(frame) == _M.MAVLINK_MSG_ID_SET_MODE)
    disarms = command.command == _M.MAV_CMD_COMPONENT_ARM_DISARM and not command.param1 >= 0.5
    return disarms or command.command in _FLIES


def spins_motors(command: CommandSeen) -> bool:
    """Whether it turns motors of a drone that stays disarmed."""
    return command.command in (_M.MAV_CMD_DO_MOTOR_TEST, _M.MAV_CMD_ACTUATOR_TEST)


def refusal_of(frame: bytes, command: CommandSeen | None, standing: Authorization) -> DropReason | None:
    """Why a frame may not pass, or None. `RepeatConfirmation` decides about requests that need confirmation."""
    leave = permission_for(frame, command)
    if leave is Permission.NOBODY:
        return DropReason.NOT_ALLOWED
    if leave is Permission.WATCHER:
        return None if standing.may_read else DropReason.NOT_IN_CONTROL
    if not standing.has_turn:
        return DropReason.NOT_IN_CONTROL
    if command is not None and arms(command) and standing.loss_check_open and not standing.armed:
        return DropReason.LOSS_CHECK
    return None


class RepeatConfirmation:
    """Remembers the first request of a command that needs a second one. One for each browser."""

    def __init__(self) -> None:
        self._first: tuple[int, int, float] | None = None

    def confirms(self, drone_id: int, command: CommandSeen, now: float) -> bool:
        """True for the second of two within ASK_AGAIN_WITHIN_S. A repeat of the first is not a second asking."""
        if command.repeat:
            return False
        first = self._first
        if first is not None and first[:2] == (drone_id, command.command) and now - first[2] <= ASK_AGAIN_WITHIN_S:
            self._first = None
            return True
        self._first = (drone_id, command.command, now)
        return False
