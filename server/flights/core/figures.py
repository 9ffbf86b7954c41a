"""The figures of one flight: time in the air, speed, battery, link, and each pilot's share. Pure.

The index says who had the controls and what happened; the frames of the autopilot (component 1) say the rest. As for
the agent, an armed drone is in the air when EXTENDED_SYS_STATE does not say that it is on the ground; a drone that does
not send it, when it is above `UP_M`. A rover, boat or submarine is never: a hill is no flight. Its hours are those from
arming to disarming.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from struct import Struct
from typing import Any, Final

from server.flights.core.holds import holds_in
from server.flights.core.index import at_of
from server.flights.core.tlog import Entry
from wire.autopilots.vehicle_types import NEVER_FLY
from wire.dialect import mavlink
from wire.frames import message_id, payload, source

_AUTOPILOT: Final = mavlink.MAV_COMP_ID_AUTOPILOT1
_ARMED: Final = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_HEARTBEAT: Final = Struct("<IBBBBB")
_STATUS: Final = Struct("<IIIHHhHHHHHHb")
_POSITION: Final = Struct("<IiiiihhhH")
_BATTERY: Final = Struct("<iih10HhBBBb")
_LANDED: Final = Struct("<BB")
_ID_HEARTBEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_ID_STATUS: Final = mavlink.MAVLINK_MSG_ID_SYS_STATUS
_ID_POSITION: Final = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_ID_BATTERY: Final = mavlink.MAVLINK_MSG_ID_BATTERY_STATUS
_ID_LANDED: Final = mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE
_LAYOUTS: Final = {
    _ID_HEARTBEAT: _HEARTBEAT,
    _ID_STATUS: _STATUS,
    _ID_POSITION: _POSITION,
    _ID_BATTERY: _BATTERY,
    _ID_LANDED: _LANDED,
}
_NOT_IN_AIR: Final = (mavlink.MAV_LANDED_STATE_UNDEFINED, mavlink.MAV_LANDED_STATE_ON_GROUND)
_BY_HEIGHT, _BY_LANDED_STATE = 1, 2
UP_M: Final = 1.0
DOWN_M: Final = 0.5
"""Above home; the two differ because a height wanders."""
MAX_CURRENT_STEP_US: Final = 5_000_000
"""The current between two reports that are further apart is not known."""
NEAR_ARMING_US: Final = 5_000_000
"""Before arming the battery rests. The tower hears of arming a little later, so the last voltage before may be of the
take-off, and of a drone that arms as soon as it comes online there may be none: the greatest of this time before and
after arming counts. A load only lowers it."""
MAX_SPEED_M_S: Final = 150.0
"""A report above it is an error of the autopilot's estimate, not a speed."""
_MAH_PER_CA_US: Final = 10.0 / 3.6e9


@dataclass
class PilotShare:
    """One person's part in a flight: the time with the controls, and of it in the air; distance and landings then.
    `air_s` None: not known."""

    user_id: int | None
    name: str
    held_s: float = 0.0
    air_s: float | None = None
    distance_m: float = 0.0
    landings: int = 0

    @property
    def flown_s(self) -> float:
        """As FlightFigures.flown_s."""
        return self.held_s if self.air_s is None else self.air_s


@dataclass(frozen=True)
class FlightFigures:
    """None: not known. Speed over ground. `used_mah`: as the autopilot counted, else its current summed up. `alerts`:
    opened, of any severity. `loss`: 0 to 1, mean of what was measured."""

    began_us: int
    ended_us: int
    air_s: float | None
    distance_m: float
    max_height_m: float | None
    max_speed_m_s: float | None
    battery_start_v: float | None
    battery_end_v: float | None
    used_mah: float | None
    landings: int
    holds: int
    hand_overs: int
    alerts: int
    critical_alerts: int
    link_losses: int
    link_lost_s: float
    rtt_mean_ms: float | None
    rtt_max_ms: float | None
    loss_mean: float | None
    pilots: tuple[PilotShare, ...] = ()

    @property
    def flown_s(self) -> float:
        """What hours are counted by: the time in the air or, where that is not known, from arming to disarming. More
        hours than flown are on the safe side of maintenance."""
        return self.duration_s if self.air_s is None else self.air_s

    @property
    def duration_s(self) -> float:
        """From arming to disarming."""
        return (self.ended_us - self.began_us) / 1e6

    @property
    def is_incident(self) -> bool:
        """Whether somebody should look at it: a hold, a lost link, or an alert on which somebody had to act at once."""
        return bool(self.holds or self.link_losses or self.critical_alerts)


@dataclass(frozen=True)
class _Held:
    """`pilot`: None while nobody had the controls."""

    from_us: int
    to_us: int
    pilot: tuple[int | None, str] | None


@dataclass
class FiguresReader:
    """Feed it every entry of the `.tlog` in order, then ask for `figures`. `index`: entries of the index, without the
    head. Entries before `began_us` only tell whether the drone is in the air already."""

    index: Sequence[dict[str, Any]]
    began_us: int
    ended_us: int | None = None
    _last_us: int = 0
    _rank: int = 0
    _armed: bool = True
    """Until a heartbeat says something else: it is a flight."""
    _never_flies: bool = False
    _in_air: bool | None = None
    _since_us: int = 0
    _air: list[tuple[int, int]] = field(default_factory=list)
    _touchdowns: list[int] = field(default_factory=list)
    _max_speed_m_s: float | None = None
    _volts: list[float] = field(default_factory=list)
    """The first and the newest."""
    _near_v: float | None = None
    """The greatest near arming."""
    _older_v: float | None = None
    """The newest from before, unless there is one of the seconds before arming."""
    _counted: list[int] = field(default_factory=list)
    _current: tuple[int, int] | None = None
    _summed_mah: float | None = None
    _moves: list[tuple[int, float]] = field(default_factory=list)

    def take(self, entry: Entry, moved_m: float) -> None:
        """`moved_m`: over ground, since the entry before."""
        if self.ended_us is not None and entry.at_us > self.ended_us:
            return
        self._last_us = max(self._last_us, entry.at_us)
        if moved_m:
            self._moves.append((entry.at_us, moved_m))
        kind = message_id(entry.frame)
        layout = _LAYOUTS.get(kind)
        if layout is None or source(entry.frame)[1] != _AUTOPILOT:
            return
        values = layout.unpack_from(payload(entry.frame).ljust(layout.size, b"\0"))
        if kind == _ID_LANDED:
            if values[1] != mavlink.MAV_LANDED_STATE_UNDEFINED:
                self._set_air(_BY_LANDED_STATE, values[1] not in _NOT_IN_AIR, entry.at_us)
        elif kind == _ID_HEARTBEAT:
            self._armed = bool(values[3] & _ARMED)
            if values[1] in NEVER_FLY and not self._never_flies:
                self._keep_on_ground()
            if not self._armed and self._in_air:
                self._set_air(self._rank, False, entry.at_us)
        elif kind == _ID_POSITION:
            self._position(entry.at_us, values)
        elif kind == _ID_STATUS:
            self._status(entry.at_us, values)
        elif entry.at_us < self.began_us:
            return
        elif values[14] == 0 and values[0] >= 0:  # the first battery
            self._counted = [self._counted[0], values[0]] if self._counted else [values[0], values[0]]

    def _position(self, at_us: int, values: tuple[int, ...]) -> None:
        if not (values[1] or values[2]):
            return  # the autopilot has no position
        height_m = values[4] / 1000
        if height_m > UP_M or height_m < DOWN_M:
            self._set_air(_BY_HEIGHT, height_m > UP_M, at_us)
        speed = math.hypot(values[5], values[6]) / 100
        if at_us >= self.began_us and speed <= MAX_SPEED_M_S:
            self._max_speed_m_s = max(speed, self._max_speed_m_s or 0.0)

    def _status(self, at_us: int, values: tuple[int, ...]) -> None:
        if values[4] not in (0, 0xFFFF):
            volts = values[4] / 1000
            if at_us >= self.began_us:
                self._volts = [self._volts[0], volts] if self._volts else [volts, volts]
            if at_us < self.began_us - NEAR_ARMING_US:
                self._older_v = volts
            elif at_us <= self.began_us + NEAR_ARMING_US:
                if at_us < self.began_us:
                    self._older_v = None
                self._near_v = max(volts, self._near_v or 0.0)
        current = values[5]
        if current < 0 or at_us < self.began_us:
            self._current = None
            return
        if self._current is not None and at_us - self._current[0] <= MAX_CURRENT_STEP_US:
            mean_ca = (self._current[1] + current) / 2
            self._summed_mah = (self._summed_mah or 0.0) + mean_ca * (at_us - self._current[0]) * _MAH_PER_CA_US
        self._current = at_us, current

    def _keep_on_ground(self) -> None:
        """Takes back what the heights before its first heartbeat said."""
        self._never_flies, self._in_air = True, None
        self._air.clear()
        self._touchdowns.clear()

    def _set_air(self, rank: int, flies: bool, at_us: int) -> None:
        if rank < self._rank or self._never_flies:
            return
        flies = flies and self._armed
        self._rank = rank
        if flies == self._in_air:
            return
        if not flies:
            self._close(at_us, landed=True)
        self._in_air, self._since_us = flies, at_us

    def _close(self, at_us: int, *, landed: bool) -> None:
        """Ends the time in the air that goes on, if one does."""
        if not self._in_air:
            return
        from_us = max(self._since_us, self.began_us)
        if at_us > from_us:
            self._air.append((from_us, at_us))
            if landed:
                self._touchdowns.append(at_us)
        self._since_us = at_us

    def figures(self, *, max_height_m: float | None) -> FlightFigures:
        """After the last entry."""
        ended_us = max(self.began_us, self.ended_us or self._last_us)
        self._close(ended_us, landed=False)
        self._since_us = ended_us
        knows_air = self._in_air is not None
        held = _held(self.index, self.began_us, ended_us)
        alerts = [one for one in self.index if one.get("kind") == "alert" and one.get("state") == "opened"]
        rtts = _numbers(self.index, "rtt_ms")
        losses = _numbers(self.index, "loss")
        lost = _lost(self.index, ended_us)
        return FlightFigures(
            began_us=self.began_us,
            ended_us=ended_us,
            air_s=sum(to - begin for begin, to in self._air) / 1e6 if knows_air else None,
            distance_m=sum(moved for _, moved in self._moves),
            max_height_m=max_height_m,
            max_speed_m_s=self._max_speed_m_s,
            battery_start_v=self._start_v(),
            battery_end_v=self._volts[1] if self._volts else None,
            used_mah=self._used_mah(),
            landings=len(self._touchdowns),
            holds=len(holds_in(self.index)),
            hand_overs=_hand_overs(held),
            alerts=len(alerts),
            critical_alerts=sum(one.get("severity") == "critical" for one in alerts),
            link_losses=len(lost),
            link_lost_s=sum(to - begin for begin, to in lost) / 1e6,
            rtt_mean_ms=sum(rtts) / len(rtts) if rtts else None,
            rtt_max_ms=max(rtts, default=None),
            loss_mean=sum(losses) / len(losses) if losses else None,
            pilots=self._shares(held, knows_air=knows_air),
        )

    def _start_v(self) -> float | None:
        known = [one for one in (self._near_v, self._older_v) if one is not None]
        return max(known, default=self._volts[0] if self._volts else None)

    def _used_mah(self) -> float | None:
        """A counter that went back was reset: the sum of the current is better then."""
        if self._counted and self._counted[1] >= self._counted[0] and self._counted[1] > 0:
            return float(self._counted[1] - self._counted[0])
        return self._summed_mah

    def _shares(self, held: Sequence[_Held], *, knows_air: bool) -> tuple[PilotShare, ...]:
        shares: dict[tuple[int | None, str], PilotShare] = {}
        for one in held:
            if one.pilot is None:
                continue
            share = shares.setdefault(one.pilot, PilotShare(*one.pilot, air_s=0.0 if knows_air else None))
            share.held_s += (one.to_us - one.from_us) / 1e6
            if share.air_s is not None:
                overlaps = (min(one.to_us, to) - max(one.from_us, begin) for begin, to in self._air)
                share.air_s += sum(length for length in overlaps if length > 0) / 1e6
            share.distance_m += sum(moved for at, moved in self._moves if one.from_us <= at < one.to_us)
            share.landings += sum(one.from_us < at <= one.to_us for at in self._touchdowns)
        return tuple(shares.values())


def _held(index: Iterable[dict[str, Any]], began_us: int, ended_us: int) -> list[_Held]:
    """Who had the controls, without gaps from arming to disarming."""
    found: list[_Held] = []
    pilot, since = None, began_us
    for entry in index:
        if entry.get("kind") not in ("armed", "control"):
            continue
        at_us = min(max(at_of(entry), began_us), ended_us)
        now = _person(entry.get("holder"))
        if now == pilot:
            continue
        if at_us > since:
            found.append(_Held(since, at_us, pilot))
        pilot, since = now, at_us
    found.append(_Held(since, ended_us, pilot))
    return found


def _hand_overs(held: Sequence[_Held]) -> int:
    """How often another person got the controls than the one before; nobody in between is no person."""
    pilots = [one.pilot for one in held if one.pilot is not None]
    return sum(one != other for one, other in pairwise(pilots))


def _lost(index: Iterable[dict[str, Any]], ended_us: int) -> list[tuple[int, int]]:
    found: list[tuple[int, int]] = []
    since: int | None = None
    for entry in index:
        kind = entry.get("kind")
        if kind == "link_lost" and since is None:
            since = at_of(entry)
        elif kind == "link_back" and since is not None:
            found.append((since, max(since, at_of(entry))))
            since = None
    if since is not None:
        found.append((since, max(since, ended_us)))
    return found


def _numbers(index: Iterable[dict[str, Any]], name: str) -> list[float]:
    values = (one.get(name) for one in index if one.get("kind") == "link")
    return [float(one) for one in values if isinstance(one, int | float)]


def _person(who: object) -> tuple[int | None, str] | None:
    if not isinstance(who, dict) or not isinstance(who.get("name"), str):
        return None
    user_id = who.get("id")
    return (user_id if isinstance(user_id, int) else None), who["name"]
