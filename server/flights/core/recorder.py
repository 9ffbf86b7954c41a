"""Which flights are recorded, and what goes into each: the frames of both directions, and an index of what happened.

A flight begins when the agent reports that the drone is armed, and ends `AFTER_S` after it is disarmed. A lost link
ends nothing: the drone may be in the air. The recorder decides; a `FlightSink` of the store writes, in a thread of its
own. The recorder never waits, and nothing of the relay depends on it: a sink that cannot write says so, and a fault of
the recorder itself is counted and logged, and stops nothing else.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final, Protocol

import msgspec

from server.alerts.core.alert import Alert
from server.flights.core.gap_watch import GapWatch
from server.flights.core.harmless import harmless
from server.flights.core.link_report import link_report, place_of
from server.flights.core.tape import Tape
from server.flights.core.times import microseconds
from server.kernel.people import UserRef
from server.link.core.token_bucket import TokenBucket
from server.live import live_messages as live
from server.live.hub_events import (
    HolderExpired,
    HolderGone,
    HubEvent,
    LoanLimitPassed,
    MotionSuspected,
    RttTooLong,
    SeparationLost,
    ZoneReached,
)
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.operations.core.observed_commands import CommandObserved
from server.operations.core.operation import Operation
from wire.ids import DroneId

AFTER_S: Final = 10.0
"""The last words of an autopilot, and what people do right after landing."""
MAX_UNKNOWN_S: Final = 1800.0
"""A flight is over when nobody has known for this long whether the drone is still armed."""
LOOK_EVERY_S: Final = 0.5
LINK_EVERY_S: Final = 5.0
LINK_SLOTS: Final = 10
STICKS_REST_S: Final = 3.0
"""Sticks that have been silent for this long are no longer in anybody's hands."""
MAX_IN_A_ROW: Final = 6
EVERY_S: Final = 20.0
"""A drone that is armed again and again has six flights at once, then one in this time: each costs two files."""
MAX_RING_BYTES: Final = 256 * 1024
MIN_RING_BYTES: Final = 16 * 1024
MAX_RINGS_BYTES: Final = 128 * 1024 * 1024
"""Of all drones together: with more than 512 drones each has less."""
MAX_LINE_BYTES: Final = 8 * 1024
"""Of the index. The text of a command has no other bound."""
CLOCK_STEP_US: Final = 500_000
"""The time of day was set: what came before has times that do not fit."""

_TOLD: Final = (live.Control, live.Hold, live.Turn, live.Rehearsal, live.Notice)
_NOTICED: Final = (HolderExpired, HolderGone, LoanLimitPassed, MotionSuspected, RttTooLong, SeparationLost, ZoneReached)
_ALERTS: Final = (LoanLimitPassed, MotionSuspected, RttTooLong, SeparationLost, ZoneReached)
_encoder: Final = msgspec.json.Encoder(enc_hook=str)
"""The details of an operation may hold anything: an entry of the index is not worth an error in its way."""

TEAM_CHANGED: Final = "the drone has changed its team"
DRONE_GONE: Final = "the drone was deleted"
LINK_LOST: Final = "the drone was not heard any more"


@dataclass(frozen=True)
class FlightHead:
    """A flight that begins. `pilot`: who has the controls. `before_s`: of what came before arming, at most."""

    drone_id: DroneId
    drone_name: str
    began_at: datetime
    pilot: UserRef | None
    before_s: float


class FlightSink(Protocol):
    """Writes one flight. Every method returns at once."""

    @property
    def problem(self) -> str:
        """Why it takes nothing more, in words for people; empty: all is well."""

    def frames(self, chunk: bytes, count: int) -> None:
        """So many frames as a `.tlog` has them."""

    def event(self, line: bytes) -> None:
        """One line of the index, without its end."""

    def end(self, at: datetime, words: str) -> None:
        """Nothing more follows. `at`: when the flight was over. `words`: why, if not by disarming."""


@dataclass
class _Open:
    """A flight that is being recorded. `over_at`: when the drone was disarmed; `unknown_since`: nobody knows whether it
    is armed. Monotonic seconds."""

    drone: LiveDrone
    tape: Tape
    sink: FlightSink
    team: object
    link_due: float
    over_at: float | None = None
    ended_at: datetime | None = None
    unknown_since: float | None = None
    clock_ahead_us: int = 0
    """How far the time of day was set since the flight began: its own clock goes on."""
    had_link: bool = True


class FlightRecorder:
    """One for the hub. `on_begin`: opens a sink, or returns None where nothing may be recorded now. `counts`: flights
    begun, ended and not recorded, since the tower started."""

    def __init__(self, state: LiveState) -> None:
        self._state = state
        self.before_s: float | None = None
        """Seconds before a flight that are recorded; None: nothing is recorded at all."""
        self.on_begin: Callable[[FlightHead], FlightSink | None] = lambda head: None
        self.counts: Counter[str] = Counter(begun=0, ended=0, not_recorded=0, faults=0)
        self.gaps = GapWatch()
        """What of these flights did not come over the link."""
        self._open: dict[DroneId, _Open] = {}
        self._look_at = float("-inf")

    @property
    def running(self) -> int:
        """Flights that are being recorded."""
        return len(self._open)

    def ring_bytes(self) -> int:
        """Of what would go into flights that begin now."""
        return sum(drone.tape.kept_bytes for drone in self._state.drones.values() if drone.tape is not None)

    # -- what happens -------------------------------------------------------------------------------------------

    @harmless
    def linked(self, drone: LiveDrone, now: float) -> None:
        """An agent has signed in: from here on the drone's frames are kept for a while."""
        if self.before_s is None:
            return
        offset_us = self._offset_us(now)
        if drone.tape is None:
            drone.tape = Tape(offset_us=offset_us, before_s=self.before_s, ring_bytes=MIN_RING_BYTES)
            drone.tape.team = _team_of(drone)
            self._share_memory()
        elif drone.drone_id not in self._open:
            self._set_clock(drone.tape, offset_us)

    @harmless
    def told(self, drone: LiveDrone, event: live.ToBrowser) -> None:
        """Everybody who may see the drone is told this."""
        if drone.tape is not None and isinstance(event, _TOLD):
            about = msgspec.to_builtins(event)
            self._note(drone, about.pop("type"), {name: about[name] for name in about if name != "drone_id"})

    @harmless
    def noticed(self, event: HubEvent) -> None:
        """The hub has noticed this."""
        if isinstance(event, _NOTICED):
            about = msgspec.to_builtins(event)
            del about["drone_id"]
            kind = "alert" if isinstance(event, _ALERTS) else "holder"
            self.note(event.drone_id, kind, {"what": type(event).__name__, **about})

    @harmless
    def alert(self, alert: Alert) -> None:
        """An alert was opened, acknowledged or closed. Those of pairs name a drone that a reader may not know."""
        if alert.drone_id is None or alert.other_id is not None:
            return
        by = alert.acknowledged_by
        state = "closed" if alert.closed_at else "acknowledged" if alert.acknowledged_at else "opened"
        about = {
            "what": alert.rule.name,
            "alert": alert.id,
            "severity": alert.rule.severity.value,
            "state": state,
            "words": alert.words,
            "by": None if by is None else {"id": by.id, "name": by.name},
        }
        self.note(alert.drone_id, "alert", about)

    @harmless
    def operation(self, operation: Operation) -> None:
        """An operation began or ended."""
        by = operation.by
        about = {
            "operation": operation.id,
            "work": operation.order.work,
            "about": operation.order.about,
            "by": None if by is None else {"id": by.id, "name": by.name},
            "way": "operation",
            "state": operation.state.value,
            "answer": operation.words,
        }
        self.note(operation.drone_id, "command", about)

    @harmless
    def observed(self, command: CommandObserved) -> None:
        """A command that came as frames has its answer, or will have none."""
        about = {
            "command": command.command,
            "about": command.detail,
            "by": {"id": command.by.id, "name": command.by.name},
            "way": "frames",
            "count": command.count,
            "answer": command.result,
            "sent_us": microseconds(self._time(command.drone_id, command.at)),
        }
        self.note(command.drone_id, "command", about)

    @harmless
    def sticks(self, drone: LiveDrone, by_id: int, name: str, now: float) -> None:
        """A frame with sticks was passed on."""
        tape = drone.tape
        if tape is None:
            return
        tape.hand_at = now
        if tape.hand is None or tape.hand[0] != by_id:
            tape.hand = (by_id, name)
            self._note(drone, "sticks", {"by": {"id": by_id, "name": name}})

    @harmless
    def note(self, drone_id: DroneId, kind: str, about: dict[str, Any]) -> None:
        """One entry of the index: for alerts, video, and whatever else belongs to a flight. `about` goes into JSON."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.tape is not None:
            self._note(drone, kind, about)

    def _note(self, drone: LiveDrone, kind: str, about: dict[str, Any], at: datetime | None = None) -> None:
        at = at or self._time(drone.drone_id)
        line = _encoder.encode({"at_us": microseconds(at), "kind": kind, **about})
        if len(line) > MAX_LINE_BYTES:
            line = _encoder.encode({"at_us": microseconds(at), "kind": kind, "too_long": len(line)})
        flight = self._open.get(drone.drone_id)
        if flight is not None:
            flight.sink.event(line)
        elif drone.tape is not None:
            drone.tape.events_before.append((at.timestamp(), line))

    # -- time ---------------------------------------------------------------------------------------------------

    @harmless
    def tick(self, now: float) -> None:
        """Several times a second."""
        for flight in self._open.values():
            self._check_clock(flight, now)
            flight.tape.check(now)
        if self.before_s is None or now < self._look_at:
            return
        self._look_at = now + LOOK_EVERY_S
        for flight in list(self._open.values()):
            self._follow(flight, now)
        for drone in self._state.drones.values():
            tape = drone.tape
            if tape is None:
                continue
            if tape.hand is not None and now - tape.hand_at > STICKS_REST_S:
                by_id, name = tape.hand
                tape.hand = None
                self._note(drone, "sticks_rest", {"by": {"id": by_id, "name": name}})
            if drone.drone_id not in self._open:
                self._watch(drone, tape, now)

    def end_all(self, words: str, now: float) -> None:
        """The tower stops."""
        for flight in list(self._open.values()):
            self._end(flight, words, now)

    def _watch(self, drone: LiveDrone, tape: Tape, now: float) -> None:
        """A drone without a flight."""
        team = _team_of(drone)
        if tape.team != team:
            tape.clear()  # the seconds before belong to another team
            tape.team = team
        if drone.armed:
            self._begin(drone, tape, now)
            return
        tape.refused = False
        if drone.link is None and now - tape.last_at > (self.before_s or 0.0):
            tape.clear()

    def _begin(self, drone: LiveDrone, tape: Tape, now: float) -> None:
        assert self.before_s is not None
        drone_id = drone.drone_id
        if tape.starts is None:
            tape.starts = TokenBucket(1 / EVERY_S, MAX_IN_A_ROW, now)
        if not tape.starts.take(1.0, now):
            self._not_recorded(tape)
            return
        self._set_clock(tape, self._offset_us(now))
        began_at = self._state.clock()
        holder = drone.lease.holder
        sink = self.on_begin(FlightHead(drone_id, drone.record.name, began_at, holder, self.before_s))
        if sink is None:
            self._not_recorded(tape)
            return
        tape.refused = False
        for at, line in tape.events_before:
            if began_at.timestamp() - at <= self.before_s:
                sink.event(line)
        tape.events_before.clear()
        # Not the links of all drones in the same look: a thousand would take 20 ms.
        link_due = now + drone_id % LINK_SLOTS * LINK_EVERY_S / LINK_SLOTS
        self._open[drone_id] = _Open(drone, tape, sink, _team_of(drone), link_due=link_due)
        self.counts["begun"] += 1
        pilot = None if holder is None else {"id": holder.id, "name": holder.name}
        self._note(drone, "armed", {"holder": pilot, "epoch": drone.lease.epoch}, began_at)
        if drone.preflight is not None:  # it may be older than what a flight keeps from before
            self._note(drone, "preflight", drone.preflight.about(), began_at)
        tape.begin(sink.frames, now)

    def _not_recorded(self, tape: Tape) -> None:
        """Counted once for each flight."""
        self.counts["not_recorded"] += not tape.refused
        tape.refused = True

    def _follow(self, flight: _Open, now: float) -> None:
        """A flight that is being recorded."""
        drone = flight.drone
        if self._state.drones.get(drone.drone_id) is not drone:
            self._end(flight, DRONE_GONE, now)
        elif flight.team != _team_of(drone):
            self._end(flight, TEAM_CHANGED, now)
            flight.tape.clear()
        elif flight.sink.problem:
            self._end(flight, flight.sink.problem, now)
        elif drone.armed is None:
            flight.unknown_since = now if flight.unknown_since is None else flight.unknown_since
            if now - flight.unknown_since > MAX_UNKNOWN_S:
                self._end(flight, LINK_LOST, now)
        elif drone.armed and flight.over_at is not None:
            self._end(flight, "", now)  # armed again: the next flight begins at once
        elif drone.armed:
            flight.unknown_since = None
        elif flight.over_at is None:
            flight.over_at, flight.ended_at = now, self._time(drone.drone_id)
            self._note(drone, "disarmed", {}, flight.ended_at)
        if flight.over_at is not None and now - flight.over_at >= AFTER_S:
            self._end(flight, "", now)
        self._note_link(flight, now)

    def _note_link(self, flight: _Open, now: float) -> None:
        drone = flight.drone
        if self._open.get(drone.drone_id) is not flight:
            return
        self.gaps.look(drone, flight.sink, flight.tape.offset_us, now)
        has_link = drone.link is not None and drone.online
        if has_link != flight.had_link:
            flight.had_link = has_link
            self._note(drone, "link_back" if has_link else "link_lost", place_of(drone, now))
        if drone.link is not None and now >= flight.link_due:
            flight.link_due = now + LINK_EVERY_S
            self._note(drone, "link", link_report(drone, drone.link, now))

    def _end(self, flight: _Open, words: str, now: float) -> None:
        if self._open.get(flight.drone.drone_id) is not flight:
            return
        at = flight.ended_at or self._time(flight.drone.drone_id)
        flight.tape.end(now)
        self._note(flight.drone, "end", {"words": words})
        self.gaps.over(flight.drone, flight.sink, now)
        del self._open[flight.drone.drone_id]
        flight.sink.end(at, words)
        self.counts["ended"] += 1

    # -- clock and memory ---------------------------------------------------------------------------------------

    def _offset_us(self, now: float) -> int:
        return microseconds(self._state.clock()) - int(now * 1e6)

    def _check_clock(self, flight: _Open, now: float) -> None:
        """Frames have the times of the monotonic clock, so the rest of the flight has them too."""
        ahead_us = self._offset_us(now) - flight.tape.offset_us
        by_us, flight.clock_ahead_us = ahead_us - flight.clock_ahead_us, ahead_us
        if abs(by_us) > CLOCK_STEP_US:
            self._note(flight.drone, "clock_set", {"by_s": round(by_us / 1e6, 3)})

    def _time(self, drone_id: DroneId, at: datetime | None = None) -> datetime:
        """`at`, else this moment, by the clock of the drone's flight."""
        flight = self._open.get(drone_id)
        ahead_us = 0 if flight is None else flight.clock_ahead_us
        return (at or self._state.clock()) - timedelta(microseconds=ahead_us)

    @staticmethod
    def _set_clock(tape: Tape, offset_us: int) -> None:
        if abs(tape.offset_us - offset_us) > CLOCK_STEP_US:
            tape.clear()
            tape.offset_us = offset_us

    def _share_memory(self) -> None:
        tapes = [drone.tape for drone in self._state.drones.values() if drone.tape is not None]
        share = min(MAX_RING_BYTES, max(MIN_RING_BYTES, MAX_RINGS_BYTES // max(1, len(tapes))))
        if tapes and (tapes[0].ring_bytes != share or tapes[-1].ring_bytes != share):
            for tape in tapes:
                tape.ring_bytes = share


def _team_of(drone: LiveDrone) -> object:
    team = drone.record.team
    return None if team is None else (team.id, team.since)
