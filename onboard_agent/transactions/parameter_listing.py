"""Reads all parameters: the list as the autopilot sends it, then the missing ones by number. No I/O.

Rules, each tested:

- Values are counted by their number in the list, whatever the name; a repeated name has the newer value.
- If the count changes on the way, all numbers move; the same if a name appears at two numbers: the list restarts, a few
  times at most.
- While the list flows, nothing else is requested; it is over when its last number arrived or it is silent.
- A missing number is requested again after about a measured round trip.
- If so many are missing that single requests would take longer than the list did, the list is requested again, and
  known values stay: an autopilot that lists a thousand a second may answer single requests far more slowly.
- If PX4 reports the hash of all parameters before the list and the same one after it, the table must match that hash.
- A table is complete, or the reading failed.
"""

from dataclasses import dataclass
from typing import Final

from onboard_agent.transactions.answer_time import AnswerTime
from onboard_agent.transactions.parameter_encoding import HASH_NAME, Encoding, ParamValue
from onboard_agent.transactions.parameter_frames import Pace, ParameterFrames
from onboard_agent.transactions.retry_policy import Repeated
from wire.parameters import MAX_ENTRIES, Parameter, Table, by_name

MAX_RESTARTS: Final = 5
SETTLE_S: Final = 0.3
"""After a change of their number: one switch brings many of them, and what is on its way is of the old count."""
HASH_TRIES: Final = 2
MAX_REPEATS: Final = 4
GAPS_MEASURED: Final = 12
"""This many single answers show their pace."""


@dataclass(frozen=True, slots=True)
class Listed:
    """`autopilot_hash`: PX4's hash of exactly this table, if it reported one."""

    table: Table
    count: int
    autopilot_hash: bytes | None = None


@dataclass(frozen=True, slots=True)
class Unchanged:
    """The autopilot has the hash that it had: nothing was read."""


@dataclass(frozen=True, slots=True)
class ListingFailed:
    """`why`: without a full stop."""

    why: str


@dataclass(frozen=True, slots=True)
class _Asked:
    """For a number: count of requests, time of the last, and deadline of the answer."""

    tries: int
    at: float
    until: float


_NEVER_ASKED: Final = _Asked(0, 0.0, float("-inf"))


class ParameterListing:
    """Call `due` at each tick and after each `heard`, until `end` is set."""

    def __init__(self, talk: ParameterFrames, pace: Pace, *, known_hash: bytes | None = None) -> None:
        """`known_hash`: of the remembered table, if the autopilot reported one."""
        self._talk = talk
        self._pace = pace
        self._known_hash = known_hash
        self._question = Repeated(pace.tries)
        self._streaming = False
        self._asking_hash = False
        self._restarts = 0
        self._hash: bytes | None = None
        """As reported before the list."""
        self._count = 0
        self._names: dict[int, str] = {}
        self._values: dict[str, Parameter] = {}
        self._asked: dict[int, _Asked] = {}
        self._answers = AnswerTime(pace.answer_s)
        self._flowed_at: float | None = None
        self._flow_began_at = 0.0
        self._longest_pause_s = 0.0
        self._list_ended = False
        """Its last number arrived without a request."""
        self._missing: dict[int, None] | None = None
        """Numbers that the list did not tell; None while it flows."""
        self._gaps_began_at = 0.0
        self._gaps_requested = 0
        self._repeats = 0
        self._begin_at = float("-inf")
        self.end: Listed | Unchanged | ListingFailed | None = None
        if known_hash is None:
            self._ask_list()
        else:
            self._ask_hash()

    @property
    def progress(self) -> tuple[int, int]:
        """Parameters received, and in all (0: not known yet)."""
        return len(self._names), self._count

    def receive(self, received: ParamValue, now: float) -> None:
        """A PARAM_VALUE of the autopilot, whoever requested it."""
        if self.end is not None:
            return
        if received.name == HASH_NAME:
            self._accept_hash(received)
            return
        if not 0 < received.count <= MAX_ENTRIES:
            return
        if received.count != self._count and not self._accept_count(received.count, now):
            return
        if received.parameter is not None:
            self._values[received.name] = received.parameter
        if received.index < received.count:
            self._numbered(received, now)

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self.end is not None or now < self._begin_at:
            return []
        question = self._question.due(now)
        if question is not None:
            self._streaming = self._streaming or not self._asking_hash
            return [question]
        if self._question.given_up(now):
            self._silent()
            return self.due(now)
        if self._flowed_at is None or self._asking_hash:
            return []
        return self._gaps(now)

    # Inside.

    def _ask_list(self) -> None:
        self._asking_hash = False
        self._question = Repeated(self._pace.tries)
        self._question.ask(self._talk.ask_all(), self._pace.first_s)

    def _ask_hash(self) -> None:
        self._asking_hash = True
        self._question = Repeated(HASH_TRIES)
        self._question.ask(self._talk.ask_name(HASH_NAME), self._pace.answer_s)

    def _silent(self) -> None:
        """Nobody has answered the question."""
        if not self._asking_hash:
            self.end = ListingFailed("the autopilot does not answer")
        elif self._complete:
            self._listed(None)
        else:
            self._ask_list()

    def _accept_hash(self, received: ParamValue) -> None:
        if self._talk.encoding is not Encoding.BYTES:
            return
        if not self._asking_hash:
            if not self._names:
                self._hash = received.raw
        elif self._complete:
            self._listed(received.raw if received.raw == self._hash else None)
        elif received.raw == self._known_hash:
            self.end = Unchanged()
        else:
            self._ask_list()

    def _accept_count(self, count: int, now: float) -> bool:
        """Whether a value with this count belongs to the present list."""
        known, self._count = self._count, count
        if known and self._streaming:
            self._restart(now)
            return False
        return True

    def _restart(self, now: float) -> None:
        self._names.clear()
        self._values.clear()
        self._asked.clear()
        self._hash = None
        self._flowed_at = None
        self._list_ended, self._missing = False, None
        self._streaming = False  # what comes until the list is asked for again is of neither
        self._begin_at = now + SETTLE_S
        self._restarts += 1
        if self._restarts > MAX_RESTARTS:
            self.end = ListingFailed("the parameters change faster than they can be read")
        else:
            self._ask_list()

    def _numbered(self, received: ParamValue, now: float) -> None:
        if not self._streaming or self._asking_hash:
            return
        self._names[received.index] = received.name
        if self._missing is not None:
            self._missing.pop(received.index, None)
        asked = self._asked.pop(received.index, None)
        if asked is None:
            self._question.answered()
            self._flow(received, now)
        else:
            self._gaps_requested += 1
            if asked.tries == 1:
                self._answers.measured(now - asked.at)
        if self._complete:
            self._all_received(now)

    @property
    def _complete(self) -> bool:
        return 0 < self._count <= len(self._names)

    def _all_received(self, now: float) -> None:
        doubled = len(set(self._names.values())) < self._count
        if doubled and not self._restarts:
            self._restart(now)  # they moved while they were read; where that is not why, it is so the second time too
        elif self._hash is not None:
            self._ask_hash()
        else:
            self._listed(None)

    def _listed(self, autopilot_hash: bytes | None) -> None:
        names = set(self._names.values())
        table = by_name(value for name, value in self._values.items() if name in names)
        self.end = Listed(table, self._count, autopilot_hash)

    def _flow(self, received: ParamValue, now: float) -> None:
        if self._flowed_at is None:
            self._flow_began_at = now
        elif self._missing is None:
            self._longest_pause_s = max(self._longest_pause_s, now - self._flowed_at)
        self._flowed_at = now
        self._list_ended = self._list_ended or received.index == received.count - 1

    def _flows(self, now: float) -> bool:
        quiet_s = max(self._pace.quiet_s, 2 * self._longest_pause_s)
        return not self._list_ended and self._flowed_at is not None and now - self._flowed_at < quiet_s

    def _list_is_faster(self, now: float) -> bool:
        """Whether the rest would come sooner with the whole list than number by number, at the pace of either."""
        assert self._missing is not None and self._flowed_at is not None
        if self._repeats >= MAX_REPEATS or self._gaps_requested < GAPS_MEASURED:
            return False
        each_s = (now - self._gaps_began_at) / self._gaps_requested
        return len(self._missing) * each_s > self._flowed_at - self._flow_began_at + self._pace.quiet_s

    def _list_again(self) -> None:
        self._repeats += 1
        self._flowed_at, self._list_ended, self._missing = None, False, None
        self._ask_list()

    def _gaps(self, now: float) -> list[bytes]:
        if self._flows(now):
            return []
        if self._missing is None:
            self._missing = dict.fromkeys(index for index in range(self._count) if index not in self._names)
            self._gaps_began_at, self._gaps_requested = now, 0
        if self._list_is_faster(now):
            self._list_again()
            return self.due(now)
        waiting = sum(1 for one in self._asked.values() if now < one.until)
        out: list[bytes] = []
        given_up = 0
        for index in self._missing:
            asked = self._asked.get(index, _NEVER_ASKED)
            if now < asked.until:
                continue
            if asked.tries >= self._pace.gap_tries:
                given_up += 1
                continue
            if waiting >= self._pace.at_once:
                break
            waiting += 1
            self._asked[index] = _Asked(asked.tries + 1, now, now + self._answers.wait_s(asked.tries + 1))
            out.append(self._talk.ask_index(index))
        if given_up and not out and not waiting:
            self.end = ListingFailed(f"the autopilot does not report {given_up} of its {self._count} parameters")
        return out
