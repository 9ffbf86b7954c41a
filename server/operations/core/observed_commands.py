"""Commands that arrived as frames, and the drone's answers. Pure.

Browsers, `tower connect` and other MAVLink programs send frames past the operations. They pass at once; this module
only observes, and reports each command once, with its answer, to the audit trail. Rules, each tested:

- It never delays a frame, and never fails because of one.
- A command repeated within `SAME_WITHIN_S`, or marked as a repetition, is the same one, with a count.
- A command ends with its answer, or after its time. A stream is reported once in `MAX_STREAM_S`.
- Bounded: `MAX_OPEN` per drone; the excess is counted per user.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final

from server.kernel.clock import Clock
from server.kernel.people import UserRef
from server.operations.core.observed_table import IN_PROGRESS, NO_ANSWER, SeenCommand, answer_in, command_of
from wire.dialect import mavlink
from wire.frames import source
from wire.ids import DroneId
from wire.transactions import MAX_EXTENDED_S

SAME_WITHIN_S: Final = 1.0
ANSWER_WITHIN_S: Final = 5.0
PLAN_WITHIN_S: Final = 60.0
"""A plan is acknowledged when its last item has come."""
PROGRESS_WITHIN_S: Final = 30.0
MAX_STREAM_S: Final = 60.0
MAX_OPEN: Final = 32
SENT: Final = "sent"
SHOWN: Final = "its heartbeat shows it"
_MORE: Final = SeenCommand("more commands", ("more",), None)


@dataclass(frozen=True)
class CommandObserved:
    """One command, with its answer. `count`: how often it was sent."""

    drone_id: DroneId
    by: UserRef
    address: str
    at: datetime
    command: str
    result: str
    count: int
    detail: dict[str, object] = field(default_factory=dict)


@dataclass
class _Open:
    seen: SeenCommand
    by: UserRef
    address: str
    sender: tuple[int, int]
    at: datetime
    began: float
    last: float
    result: str = ""
    """Empty: none yet."""
    answered: float = float("-inf")
    """When the newest answer came."""
    count: int = 1


_Key = tuple[int, tuple[object, ...]]


class ObservedCommands:
    """One for the hub. `on_settled` gets each command when it has ended."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._open: dict[DroneId, dict[_Key, _Open]] = {}
        self.on_settled: Callable[[CommandObserved], None] = lambda command: None

    def sent(self, drone_id: DroneId, by: UserRef, address: str, frame: bytes, now: float) -> None:
        """A frame was sent to the drone."""
        seen = command_of(frame)
        if seen is None:
            return
        there = self._open.setdefault(drone_id, {})
        key = (by.id, seen.same)
        known = there.get(key)
        if known is None and len(there) >= MAX_OPEN:
            seen, key = _MORE, (by.id, _MORE.same)
            known = there.get(key)
        if known is not None:
            if (seen.repeat or now - known.last <= SAME_WITHIN_S) and now - known.began <= MAX_STREAM_S:
                known.count, known.last = known.count + 1, now
                return
            self._settle(drone_id, key, known)
            there = self._open.setdefault(drone_id, {})
        there[key] = _Open(seen, by, address, source(frame), self._clock(), now, now)

    def waits(self, drone_id: DroneId) -> bool:
        """Whether an answer of this drone is worth a look."""
        return drone_id in self._open

    def heard(self, drone_id: DroneId, frame: bytes, now: float) -> None:
        """A frame of the drone that may be an answer."""
        reply = answer_in(frame)
        if reply is None:
            return
        msgid, answered, result, system = reply
        newest: _Open | None = None
        for one in self._open.get(drone_id, {}).values():
            fits = one.seen.answer_id == msgid and one.seen.answer == answered and system in (0, one.sender[0])
            # Two answers can be distinguished only by who still waits for one.
            if fits and (newest is None or (_waits(one), one.last) >= (_waits(newest), newest.last)):
                newest = one
        if newest is not None:
            newest.result, newest.answered = result, now

    def tick(self, now: float, mode_of: Callable[[DroneId], int | None]) -> None:
        """Several times a second. `mode_of`: the custom mode that the newest heartbeat shows."""
        for drone_id, there in list(self._open.items()):
            for key, one in list(there.items()):
                if now - _since(one) > _patience_s(one):
                    if not one.result and mode_of(drone_id) in one.seen.modes:
                        one.result = SHOWN
                    self._settle(drone_id, key, one)

    def settle_all(self) -> None:
        """The tower stops: reports everything, answered or not."""
        for drone_id, there in list(self._open.items()):
            for key, one in list(there.items()):
                self._settle(drone_id, key, one)

    def _settle(self, drone_id: DroneId, key: _Key, one: _Open) -> None:
        there = self._open[drone_id]
        del there[key]
        if not there:
            del self._open[drone_id]
        silent = SENT if one.seen.answer_id is None and not one.seen.modes else NO_ANSWER
        system, component = one.sender
        self.on_settled(
            CommandObserved(
                drone_id=drone_id,
                by=one.by,
                address=one.address,
                at=one.at,
                command=one.seen.name,
                result=one.result or silent,
                count=one.count,
                detail={**one.seen.detail, "sender": f"{system}/{component}"},
            )
        )


def _since(one: _Open) -> float:
    """From when its patience counts: each IN_PROGRESS begins it again, within a bound."""
    if one.result != IN_PROGRESS:
        return one.last
    return min(max(one.last, one.answered), one.last + MAX_EXTENDED_S)


def _waits(one: _Open) -> bool:
    return one.result in ("", IN_PROGRESS)


def _patience_s(one: _Open) -> float:
    """How long after `_since` it is over."""
    if one.result == IN_PROGRESS:
        return PROGRESS_WITHIN_S
    if one.result or (one.seen.answer_id is None and not one.seen.modes):
        return SAME_WITHIN_S
    return PLAN_WITHIN_S if one.seen.answer_id == mavlink.MAVLINK_MSG_ID_MISSION_ACK else ANSWER_WITHIN_S
