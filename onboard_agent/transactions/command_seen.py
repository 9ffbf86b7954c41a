"""Checks whether telemetry shows the effect of an accepted command. No I/O.

An autopilot accepts a command within milliseconds; the effect comes later, or never. A speed change shows in the
ground speed, a home in HOME_POSITION, the current item in MISSION_CURRENT, a mission start in the mode. PX4 accepts a
target outside its fence, and stands still; it accepts a circle, and holds because it misses sticks.
"""

from collections.abc import Callable
from enum import StrEnum
from math import cos, hypot, radians
from typing import Any, Final, Protocol

from onboard_agent.autopilot.mode_names import mission_modes, mode_name
from onboard_agent.transactions.handler import Around
from wire.autopilots.registry import FAMILIES
from wire.dialect import mavlink
from wire.places import place_of
from wire.transactions import CommandWork

SEEN_WITHIN_S: Final = 4.0
"""After the acceptance. A drone needs three seconds to slow from 8 m/s to 2 m/s."""

_POSITION: Final = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_HOME: Final = mavlink.MAVLINK_MSG_ID_HOME_POSITION
_CURRENT: Final = mavlink.MAVLINK_MSG_ID_MISSION_CURRENT
_HEARTBEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
READ: Final = frozenset({_POSITION, _HOME, _CURRENT})
"""Messages to read besides HEARTBEAT."""

SPEED_TOLERANCE_M_S: Final = 0.5
SPEED_TOLERANCE: Final = 0.1
STANDS_M_S: Final = 0.5
HOME_TOLERANCE_M: Final = 3.0
AT_PLACE_M: Final = 2.0
NEARER_M: Final = 1.0
_NO_PLACE: Final = 0x7FFFFFFF
_M_PER_DEG: Final = 111_320.0
_GROUND_SPEED: Final = 1


class Without(StrEnum):
    """What an accepted command without its effect is."""

    UNCONFIRMED = "unconfirmed"
    REFUSED_IF_SAID = "refused, if a text says why"
    FAILED = "failed"


class Seen(Protocol):
    """The expected effect. `asks`: the message to request; None if it arrives unrequested."""

    asks: int | None
    without_it: Without
    """What it means that nothing is seen."""

    def receive(self, message_id: int, message: Any) -> None:
        """Takes a message of READ, or a HEARTBEAT, received after the acceptance."""

    @property
    def shown(self) -> bool | None:
        """True: the effect is visible. False: it cannot become visible now. None: not yet."""

    @property
    def words(self) -> str:
        """The observed state, as part of a sentence; empty if nothing was received."""


class _Speed:
    asks: int | None = None
    without_it = Without.UNCONFIRMED

    def __init__(self, wanted_m_s: float) -> None:
        self._wanted_m_s = wanted_m_s
        self._m_s: float | None = None

    def receive(self, message_id: int, message: Any) -> None:
        if message_id == _POSITION:
            self._m_s = hypot(message.vx, message.vy) / 100.0

    @property
    def shown(self) -> bool | None:
        if self._m_s is None:
            return None
        near = abs(self._m_s - self._wanted_m_s) <= max(SPEED_TOLERANCE_M_S, SPEED_TOLERANCE * self._wanted_m_s)
        return True if near else False if self._m_s < STANDS_M_S else None

    @property
    def words(self) -> str:
        if self._m_s is None:
            return ""
        return "it stands still" if self._m_s < STANDS_M_S else f"it flies at {self._m_s:.1f} m/s"


class _Home:
    asks: int | None = _HOME
    without_it = Without.UNCONFIRMED

    def __init__(self, wanted: tuple[float, float] | None) -> None:
        """`wanted`: latitude and longitude; None: the drone's position."""
        self._wanted = wanted
        self._here: tuple[float, float] | None = None
        self._home: tuple[float, float] | None = None

    def receive(self, message_id: int, message: Any) -> None:
        if message_id == _HOME:
            self._home = place_of(message.latitude, message.longitude)
        elif message_id == _POSITION:
            self._here = place_of(message.lat, message.lon)

    @property
    def _off_m(self) -> float | None:
        wanted = self._wanted or self._here
        if wanted is None or self._home is None:
            return None
        north = (self._home[0] - wanted[0]) * _M_PER_DEG
        return hypot(north, (self._home[1] - wanted[1]) * _M_PER_DEG * cos(radians(wanted[0])))

    @property
    def shown(self) -> bool | None:
        off_m = self._off_m
        return True if off_m is not None and off_m <= HOME_TOLERANCE_M else None

    @property
    def words(self) -> str:
        if self._home is None:
            return ""
        if self.shown:
            return "home is there"
        return f"home is at {self._home[0]:.6f}, {self._home[1]:.6f}"


class _Item:
    asks: int | None = _CURRENT
    without_it = Without.UNCONFIRMED

    def __init__(self, wanted: int) -> None:
        self._wanted = wanted
        self._current: int | None = None

    def receive(self, message_id: int, message: Any) -> None:
        if message_id == _CURRENT:
            self._current = message.seq

    @property
    def shown(self) -> bool | None:
        return True if self._current == self._wanted else None

    @property
    def words(self) -> str:
        return "" if self._current is None else f"its mission is at item {self._current} of its own count"


class _Place:
    asks: int | None = None
    without_it = Without.REFUSED_IF_SAID

    def __init__(self, lat: float, lon: float) -> None:
        """Degrees."""
        self._wanted = (lat, lon)
        self._first_m: float | None = None
        self._now_m = 0.0
        self._m_s = 0.0

    def receive(self, message_id: int, message: Any) -> None:
        here = place_of(message.lat, message.lon) if message_id == _POSITION else None
        if here is None:
            return
        north = (self._wanted[0] - here[0]) * _M_PER_DEG
        east = (self._wanted[1] - here[1]) * _M_PER_DEG * cos(radians(self._wanted[0]))
        self._now_m, self._m_s = hypot(north, east), hypot(message.vx, message.vy) / 100.0
        self._first_m = self._now_m if self._first_m is None else self._first_m

    @property
    def shown(self) -> bool | None:
        if self._first_m is None:
            return None
        return True if self._now_m <= AT_PLACE_M or self._first_m - self._now_m >= NEARER_M else None

    @property
    def words(self) -> str:
        if self._first_m is None:
            return ""
        if self._now_m <= AT_PLACE_M:
            return "it is there"
        if self._m_s < STANDS_M_S:
            return "it stands still"
        return "it comes nearer" if self.shown else "it does not come nearer yet"


class _Circle:
    asks: int | None = _HEARTBEAT
    without_it = Without.FAILED

    def __init__(self, kind: int, vehicle_type: int) -> None:
        self._kind, self._vehicle_type = kind, vehicle_type
        self._mode: int | None = None

    def receive(self, message_id: int, message: Any) -> None:
        if message_id == _HEARTBEAT:
            self._mode = message.custom_mode

    @property
    def shown(self) -> bool | None:
        return True if self._mode is not None and self._name == "ORBIT" else None

    @property
    def _name(self) -> str:
        return mode_name(self._kind, self._vehicle_type, self._mode or 0)

    @property
    def words(self) -> str:
        return "" if self._mode is None else "it circles" if self.shown else f"it is in {self._name}"


class _Mission:
    asks: int | None = _HEARTBEAT
    without_it = Without.UNCONFIRMED

    def __init__(self, modes: frozenset[int]) -> None:
        self._modes = modes
        self._mode: int | None = None

    def receive(self, message_id: int, message: Any) -> None:
        if message_id == _HEARTBEAT:
            self._mode = message.custom_mode

    @property
    def shown(self) -> bool | None:
        return True if self._mode in self._modes else None

    @property
    def words(self) -> str:
        if self._mode is None:
            return ""
        return "it flies its mission" if self.shown else "it is not in the mode for missions"


def what_shows(work: CommandWork, around: Around) -> Seen | None:
    """Returns None if telemetry cannot show the effect, or if another check covers it."""
    make: Callable[[CommandWork, Around], Seen | None] | None = _MAKERS.get(work.command)
    return None if make is None else make(work, around)


def _speed(work: CommandWork, _around: Around) -> Seen | None:
    kind, wanted = work.params[0], work.params[1]
    return _Speed(wanted) if wanted is not None and wanted > 0 and kind in (0.0, float(_GROUND_SPEED)) else None


def _home(work: CommandWork, _around: Around) -> Seen | None:
    here = work.params[0] == 1.0
    return _Home(None if here or work.x is None or work.y is None else (work.x / 1e7, work.y / 1e7))


def _item(work: CommandWork, _around: Around) -> Seen | None:
    return None if work.params[0] is None or work.params[0] < 0 else _Item(int(work.params[0]))


def _place(work: CommandWork, around: Around) -> Seen | None:
    if not _decides_later(around) or work.x is None or work.y is None:
        return None
    return None if _NO_PLACE in (work.x, work.y) else _Place(work.x / 1e7, work.y / 1e7)


def _circle(_work: CommandWork, around: Around) -> Seen | None:
    return _Circle(around.autopilot_kind, around.vehicle_type) if _decides_later(around) else None


def _decides_later(around: Around) -> bool:
    family = FAMILIES.get(around.autopilot_kind)
    return family is not None and family.decides_later


def _mission(_work: CommandWork, around: Around) -> Seen | None:
    return _Mission(mission_modes(around.autopilot_kind, around.vehicle_type))


_MAKERS: Final[dict[int, Callable[[CommandWork, Around], Seen | None]]] = {
    mavlink.MAV_CMD_DO_CHANGE_SPEED: _speed,
    mavlink.MAV_CMD_DO_SET_HOME: _home,
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: _item,
    mavlink.MAV_CMD_MISSION_START: _mission,
    mavlink.MAV_CMD_DO_REPOSITION: _place,
    mavlink.MAV_CMD_DO_ORBIT: _circle,
}
