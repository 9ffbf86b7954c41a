"""The limits of a loan: what a borrower's frame may ask for, and when a drone flown by hand is beyond them. Pure.

Where a target cannot be judged (no home is known, another frame of reference), it is refused: when in doubt, no.
"""

from dataclasses import dataclass
from math import cos, hypot, isfinite, radians
from struct import Struct
from typing import Final

from server.relay.policy import CommandSeen
from wire.dialect import mavlink
from wire.frames import message_id, payload

_M: Final = mavlink
_METRES_PER_DEGREE: Final = 111_319.5
HEIGHT_STEP_M: Final = 3.0
RADIUS_STEP_M: Final = 5.0
"""Beyond a limit the drone holds again each time it has gone so much further out; the way back is free."""

NOT_JUDGED: Final = frozenset(
    {
        _M.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
        _M.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET,
        _M.MAVLINK_MSG_ID_MISSION_ITEM,
        _M.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL,
        _M.MAVLINK_MSG_ID_SET_HOME_POSITION,
        _M.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN,
    }
)
"""They name places in ways that the tower does not follow, or move home itself."""
COMMANDS_NOT_JUDGED: Final = frozenset({_M.MAV_CMD_DO_SET_HOME, _M.MAV_CMD_DO_ORBIT})
_TARGETS: Final = frozenset(
    {_M.MAV_CMD_DO_REPOSITION, _M.MAV_CMD_NAV_TAKEOFF, _M.MAV_CMD_NAV_WAYPOINT, _M.MAV_CMD_NAV_LAND}
)
_RELATIVE: Final = frozenset({3, 6})
_ABOVE_SEA: Final = frozenset({0, 5})
_SET_TARGET: Final = Struct("<IiifffffffffHBBB")
_IN_INT: Final = Struct("<ffffiifHHBBB")  # MISSION_ITEM_INT: seq, command; COMMAND_INT has the command first
_IN_LONG: Final = Struct("<fffffff")
_HOME: Final = Struct("<iii")
_POSITION: Final = Struct("<Iiiii")


@dataclass(frozen=True)
class Limits:
    """Metres above and around home; None: no limit."""

    may_arm: bool = True
    max_height_m: float | None = None
    radius_m: float | None = None

    @property
    def in_space(self) -> bool:
        return self.max_height_m is not None or self.radius_m is not None


@dataclass(frozen=True)
class Home:
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float

    def distance_m(self, lat_deg: float, lon_deg: float) -> float:
        """Over ground; good for the few kilometres of a radius."""
        north = (lat_deg - self.lat_deg) * _METRES_PER_DEGREE
        east = (lon_deg - self.lon_deg) * _METRES_PER_DEGREE * cos(radians(self.lat_deg))
        return hypot(north, east)


@dataclass(frozen=True)
class Place:
    """From GLOBAL_POSITION_INT."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    alt_rel_m: float


@dataclass(frozen=True)
class _Target:
    lat_deg: float | None
    lon_deg: float | None
    alt_m: float | None
    frame: int


def home_in(frame: bytes) -> Home:
    """Of a whole HOME_POSITION."""
    lat_e7, lon_e7, alt_mm = _HOME.unpack_from(payload(frame).ljust(_HOME.size, b"\0"))
    return Home(lat_e7 / 1e7, lon_e7 / 1e7, alt_mm / 1000)


def whole_place_in(frame: bytes) -> Place | None:
    """Of a whole GLOBAL_POSITION_INT; None while the autopilot does not know it."""
    _, lat_e7, lon_e7, alt_mm, rel_mm = _POSITION.unpack_from(payload(frame).ljust(_POSITION.size, b"\0"))
    return None if lat_e7 == 0 and lon_e7 == 0 else Place(lat_e7 / 1e7, lon_e7 / 1e7, alt_mm / 1000, rel_mm / 1000)


def asks_beyond(
    frame: bytes, command: CommandSeen | None, limits: Limits, home: Home | None, *, takeoff_above_sea: bool
) -> bool:
    """Whether a whole frame asks for a place beyond the limits, or for one that cannot be judged.

    `takeoff_above_sea`: the autopilot (PX4) reads the altitude of a take-off by COMMAND_LONG as above the sea.
    """
    if not limits.in_space:
        return False
    if message_id(frame) in NOT_JUDGED or (command is not None and command.command in COMMANDS_NOT_JUDGED):
        return True
    target = _target_in(frame, command, takeoff_above_sea=takeoff_above_sea)
    return target is not None and (_too_high(target, limits, home) or _too_far(target, limits, home))


def _too_high(target: _Target, limits: Limits, home: Home | None) -> bool:
    if limits.max_height_m is None or target.alt_m is None:
        return False
    if target.frame in _RELATIVE:
        return target.alt_m > limits.max_height_m
    if target.frame not in _ABOVE_SEA or home is None:
        return True
    return target.alt_m - home.alt_amsl_m > limits.max_height_m


def _too_far(target: _Target, limits: Limits, home: Home | None) -> bool:
    if limits.radius_m is None or target.lat_deg is None or target.lon_deg is None:
        return False
    return home is None or home.distance_m(target.lat_deg, target.lon_deg) > limits.radius_m


def _target_in(frame: bytes, command: CommandSeen | None, *, takeoff_above_sea: bool) -> _Target | None:
    msgid, body = message_id(frame), payload(frame)
    if msgid == _M.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT:
        fields = _SET_TARGET.unpack(body.ljust(_SET_TARGET.size, b"\0")[: _SET_TARGET.size])
        return _target(fields[1] / 1e7, fields[2] / 1e7, fields[3], fields[15])
    if msgid == _M.MAVLINK_MSG_ID_MISSION_ITEM_INT:
        fields = _IN_INT.unpack_from(body.ljust(_IN_INT.size, b"\0"))
        # From 16 to 95 are those that fly somewhere; return (20) goes home.
        flies = 16 <= fields[8] <= 95 and fields[8] != _M.MAV_CMD_NAV_RETURN_TO_LAUNCH
        return _target(fields[4] / 1e7, fields[5] / 1e7, fields[6], fields[11]) if flies else None
    if command is None:
        return None
    if command.command == _M.MAV_CMD_DO_CHANGE_ALTITUDE:
        return _target(0, 0, command.param1, int(command.param2) if isfinite(command.param2) else -1)
    if command.command not in _TARGETS:
        return None
    if msgid == _M.MAVLINK_MSG_ID_COMMAND_INT:
        fields = _IN_INT.unpack_from(body.ljust(_IN_INT.size, b"\0"))
        return _target(fields[4] / 1e7, fields[5] / 1e7, fields[6], body.ljust(33, b"\0")[32])
    values = _IN_LONG.unpack_from(body.ljust(_IN_LONG.size, b"\0"))
    above_sea = command.command == _M.MAV_CMD_DO_REPOSITION or takeoff_above_sea
    return _target(values[4], values[5], values[6], 0 if above_sea else 3)


def _target(lat_deg: float, lon_deg: float, alt_m: float, frame: int) -> _Target:
    """0, 0 and numbers that are none mean: where it is."""
    here = not (isfinite(lat_deg) and isfinite(lon_deg)) or (lat_deg == 0 and lon_deg == 0)
    return _Target(None if here else lat_deg, None if here else lon_deg, alt_m if isfinite(alt_m) else None, frame)


class LimitWatch:
    """Says when a drone that is flown by hand beyond its limits has to hold."""

    def __init__(self) -> None:
        self._held_height_m = 0.0
        self._held_radius_m = 0.0

    def must_hold(self, limits: Limits, place: Place, home: Home | None) -> str | None:
        """In words, or None. Once at the limit, and again whenever it has gone a step further."""
        why = None
        if limits.max_height_m is not None:
            beyond = place.alt_rel_m - limits.max_height_m
            self._held_height_m, passed = _ratchet(beyond, self._held_height_m, HEIGHT_STEP_M)
            why = f"above the {limits.max_height_m:.0f} m of the loan" if passed else why
        if limits.radius_m is not None and home is not None:
            beyond = home.distance_m(place.lat_deg, place.lon_deg) - limits.radius_m
            self._held_radius_m, passed = _ratchet(beyond, self._held_radius_m, RADIUS_STEP_M)
            why = f"further from home than the {limits.radius_m:.0f} m of the loan" if passed else why
        return why


def _ratchet(beyond_m: float, allowed_m: float, step_m: float) -> tuple[float, bool]:
    """(how far out it may be from now on, whether it has just gone further than that)."""
    if beyond_m <= 0:
        return 0.0, False
    if beyond_m > allowed_m:
        return beyond_m + step_m, True
    return min(allowed_m, beyond_m + step_m), False
