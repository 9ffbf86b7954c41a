"""What a borrower's frame may request, by the tables of `loan_tables.py` and the positions in the frame. Pure.

A loan with any limit allows what is in those tables and nothing else. All else stays with the owner: parameters,
fences, home, files, motor tests, and messages unknown to this file. If a target cannot be judged, the frame is refused.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite
from struct import Struct
from typing import Final

from server.control.core.loan_limits import Home, Limits
from server.control.core.loan_tables import (
    AT_A_PLACE,
    CIRCLE_IN,
    COMMANDS,
    ITEMS,
    ITEMS_AT_A_PLACE,
    MESSAGES,
    MOTION,
    UP_OR_DOWN,
)
from server.control.core.policy import CommandSeen, arms, spins_motors
from wire.autopilots.profile import AutopilotFamily
from wire.autopilots.registry import PROFILES
from wire.dialect import mavlink
from wire.frames import message_id, payload

_M: Final = mavlink

ARMING_MODES: Final = frozenset[int]().union(*(profile.arming_modes for profile in PROFILES))
"""custom_mode of each mode that arms any known autopilot."""


class LoanBlock(StrEnum):
    """Why a borrower's frame may not pass."""

    ARMING = "arming"
    HEIGHT = "height"
    RADIUS = "radius"
    UNJUDGED = "unjudged"
    OWNERS = "owners"


_RELATIVE: Final = frozenset({3, 6})
_ABOVE_SEA: Final = frozenset({0, 5})
_ABOVE_TERRAIN: Final = frozenset({10, 11})
_HERE_E7: Final = 2**31 - 1
"""The integer that means "the present position"."""
_POSITION_ONLY: Final = 0b1_1111_1000
"""Type mask: ignores velocities and accelerations, uses the position."""
_MASK_BITS: Final = 0b1_1111_1111
_GUIDED: Final = (_M.MAV_CMD_DO_REPOSITION, _M.MAV_CMD_DO_ORBIT)
_SET_TARGET: Final = Struct("<IiifffffffffHBBB")
_IN_INT: Final = Struct("<ffffiifHHBBB")  # MISSION_ITEM_INT: seq, command; COMMAND_INT has the command first
_IN_LONG: Final = Struct("<fffffff")
_MISSION_TYPE_AT: Final[Mapping[int, int]] = {
    _M.MAVLINK_MSG_ID_MISSION_ITEM_INT: 37,
    _M.MAVLINK_MSG_ID_MISSION_COUNT: 4,
    _M.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST: 6,
    _M.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: 2,
}


@dataclass(frozen=True)
class Target:
    """A place, in degrees and metres; None: where it is. `frames`: all the ways in which it may be read."""

    lat_deg: float | None
    lon_deg: float | None
    alt_m: float | None
    frames: tuple[int, ...]
    circle_m: float = 0.0


def bar_of(
    frame: bytes,
    command: CommandSeen | None,
    limits: Limits,
    home: Home | None,
    *,
    armed: bool | None,
    family: AutopilotFamily | None,
) -> LoanBlock | None:
    """Why a whole frame may not pass, or None. Only for what is the holder's, not for what every watcher may send.

    `armed` None: not known, which counts as disarmed: what could start motors is barred. `family`: how it
    reads altitudes and places; None: not known which autopilot it is.
    """
    if not limits.any:
        return None
    if message_id(frame) not in MESSAGES or _changes_more_than_the_mission(frame):
        return LoanBlock.OWNERS
    if not limits.may_arm and (_is_to_arm(command) or (not armed and _may_start_motors(frame, command))):
        return LoanBlock.ARMING
    if command is not None and command.command not in COMMANDS:
        return LoanBlock.ARMING if spins_motors(command) and not limits.may_arm else LoanBlock.OWNERS
    item = _item_in(frame)
    if item is not None and item not in ITEMS:
        return LoanBlock.OWNERS
    return _bar_in_space(frame, command, limits, home, family=family) if limits.in_space else None


def words_of(bar: LoanBlock, limits: Limits) -> str:
    """The end of a sentence that begins with whose drone is lent."""
    return {
        LoanBlock.ARMING: "without the right to arm it, and this could start its motors.",
        LoanBlock.HEIGHT: f"up to {limits.max_height_m or 0:.0f} m above home, and this goes higher.",
        LoanBlock.RADIUS: f"within {limits.radius_m or 0:.0f} m of home, and this goes further.",
        LoanBlock.UNJUDGED: "within limits, and it is not known whether this keeps them.",
        LoanBlock.OWNERS: "within limits: its parameters, fences, home and the like are its owner's to change.",
    }[bar]


def _changes_more_than_the_mission(frame: bytes) -> bool:
    """Fences and rally points travel as missions do."""
    at = _MISSION_TYPE_AT.get(message_id(frame))
    return at is not None and payload(frame)[at : at + 1] not in (b"", b"\0")


def _item_in(frame: bytes) -> int | None:
    if message_id(frame) != _M.MAVLINK_MSG_ID_MISSION_ITEM_INT:
        return None
    body = payload(frame).ljust(_IN_INT.size, b"\0")
    return int(_IN_INT.unpack_from(body)[8])


def _is_to_arm(command: CommandSeen | None) -> bool:
    return command is not None and command.command == _M.MAV_CMD_COMPONENT_ARM_DISARM and arms(command)


_TO_ONE_SIDE: Final = 500
_MIDDLE_US: Final = range(1250, 1751)
_STICK_CHANNELS: Final = 4


def _may_start_motors(frame: bytes, command: CommandSeen | None) -> bool:
    """Arms a disarmed drone: by command, by mode, or by sticks in a corner."""
    msgid, body = message_id(frame), payload(frame)
    if msgid == _M.MAVLINK_MSG_ID_SET_MODE:
        return int.from_bytes(body[:4], "little") in ARMING_MODES or bool(body[5:6] and body[5] & 0x80)
    if msgid == _M.MAVLINK_MSG_ID_MANUAL_CONTROL:
        _, _, _, turn, buttons = Struct("<hhhhH").unpack_from(body.ljust(10, b"\0"))
        return abs(turn) > _TO_ONE_SIDE or buttons != 0 or any(body[11:13])
    if msgid == _M.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE:
        return _corner_or_switch(body.ljust(38, b"\0"))
    if command is None:
        return False
    if command.command == _M.MAV_CMD_DO_SET_MODE:
        armed_flag = isfinite(command.param1) and int(command.param1) & 0x80
        return bool(armed_flag) or command.param2 in ARMING_MODES
    return arms(command) or spins_motors(command)


def _corner_or_switch(body: bytes) -> bool:
    """Two sticks at their ends, or any switch: which channel is which is up to the drone's own parameters."""
    first, rest = Struct("<8H").unpack_from(body), Struct("<10H").unpack_from(body, 18)
    sticks = [value for value in first[:_STICK_CHANNELS] if value not in (0, 65535)]
    switches = [value for value in (*first[_STICK_CHANNELS:], *rest) if value not in (0, 65534, 65535)]
    ends = sum(value not in _MIDDLE_US for value in sticks)
    return ends > 1 or any(value not in _MIDDLE_US for value in switches)


def _bar_in_space(
    frame: bytes, command: CommandSeen | None, limits: Limits, home: Home | None, *, family: AutopilotFamily | None
) -> LoanBlock | None:
    if message_id(frame) in MOTION and message_id(frame) != _M.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT:
        return LoanBlock.UNJUDGED
    found = target_in(frame, command, family=family)
    if found is None or isinstance(found, LoanBlock):
        return found
    return _too_high(found, limits, home) or _too_far(found, limits, home)


def _too_high(target: Target, limits: Limits, home: Home | None) -> LoanBlock | None:
    if limits.max_height_m is None or target.alt_m is None:
        return None
    for frame in target.frames:
        if frame in _RELATIVE:
            height_m = target.alt_m
        elif frame in _ABOVE_SEA and home is not None:
            height_m = target.alt_m - home.alt_amsl_m
        else:
            return LoanBlock.UNJUDGED
        if height_m > limits.max_height_m:
            return LoanBlock.HEIGHT
    return None


def _too_far(target: Target, limits: Limits, home: Home | None) -> LoanBlock | None:
    if limits.radius_m is None:
        return None
    if target.lat_deg is None or target.lon_deg is None:
        return LoanBlock.UNJUDGED if target.circle_m else None
    known = _RELATIVE | _ABOVE_SEA | _ABOVE_TERRAIN
    if home is None or not known.issuperset(target.frames):
        return LoanBlock.UNJUDGED
    reach_m = home.distance_m(target.lat_deg, target.lon_deg) + target.circle_m
    return LoanBlock.RADIUS if reach_m > limits.radius_m else None


def target_in(
    frame: bytes, command: CommandSeen | None, *, family: AutopilotFamily | None
) -> Target | LoanBlock | None:
    """Where the frame leads; None: to no place; a LoanBlock: that cannot be said."""
    msgid, body = message_id(frame), payload(frame)
    if msgid == _M.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT:
        fields = _SET_TARGET.unpack(body.ljust(_SET_TARGET.size, b"\0")[: _SET_TARGET.size])
        if fields[12] & _MASK_BITS != _POSITION_ONLY:
            return LoanBlock.UNJUDGED  # a velocity leads anywhere
        return Target(fields[1] / 1e7, fields[2] / 1e7, _or_here(fields[3]), (fields[15],))
    if msgid == _M.MAVLINK_MSG_ID_MISSION_ITEM_INT:
        fields = _IN_INT.unpack_from(body.ljust(_IN_INT.size, b"\0"))
        if fields[8] not in ITEMS_AT_A_PLACE:
            return None
        return _from_int(fields, fields[8], (fields[11],), family=family)
    if command is None:
        return None
    if command.command == _M.MAV_CMD_DO_CHANGE_ALTITUDE:
        frame_number = int(command.param2) if isfinite(command.param2) else -1
        return Target(None, None, _or_here(command.param1), _readings(frame_number, family))
    if command.command not in AT_A_PLACE and command.command not in _GUIDED:
        return None
    if msgid == _M.MAVLINK_MSG_ID_COMMAND_INT:
        fields = _IN_INT.unpack_from(body.ljust(_IN_INT.size, b"\0"))
        return _from_int(fields, command.command, _readings(body.ljust(33, b"\0")[32], family), family=family)
    values = _IN_LONG.unpack_from(body.ljust(_IN_LONG.size, b"\0"))
    lat, lon = values[4], values[5]
    here = not (isfinite(lat) and isfinite(lon)) or _zero_is_here(lat, lon, command.command, family)
    above_sea = family is not None and not family.reads_frames
    own = 0 if above_sea or command.command == _M.MAV_CMD_DO_REPOSITION else 3
    readings = (own,) if above_sea else _readings(own, family)
    circle_m = _circle(values, command.command)
    return Target(None if here else lat, None if here else lon, _or_here(values[6]), readings, circle_m)


def _from_int(
    fields: tuple[float, ...], number: int, frames: tuple[int, ...], *, family: AutopilotFamily | None
) -> Target:
    lat, lon = fields[4], fields[5]
    here = _HERE_E7 in (lat, lon) or _zero_is_here(lat, lon, number, family)
    circle_m = _circle(fields, number)
    return Target(None if here else lat / 1e7, None if here else lon / 1e7, _or_here(fields[6]), frames, circle_m)


def _readings(frame: int, family: AutopilotFamily | None) -> tuple[int, ...]:
    """The frames in which the altitude of a command may be read. Some autopilots ignore the frame: above sea level."""
    if family is not None and family.reads_frames:
        return (frame,)
    return (frame, 0)


def _zero_is_here(lat: float, lon: float, number: int, family: AutopilotFamily | None) -> bool:
    """0, 0 is where it is, or a place off Africa."""
    at_zero = lat == 0 and lon == 0
    return at_zero and (number in UP_OR_DOWN if family is None else family.zero_is_here)


def _circle(values: tuple[float, ...], number: int) -> float:
    at = CIRCLE_IN.get(number)
    radius = values[at] if at is not None else 0.0
    return abs(radius) if isfinite(radius) else 0.0


def _or_here(value: float) -> float | None:
    return value if isfinite(value) else None
