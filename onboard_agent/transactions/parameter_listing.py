"""Reads all parameters: the list from the autopilot, then each missing value by its index. No I/O.

Rules, each tested:
- Received values are counted by index, whatever their name; a name that is sent again has the newer value.
- A change of the parameter count during the reading shifts all indexes, and so does a name that appears at two indexes:
  the list is requested again, at most a few times.
- While the list flows nothing else is requested; it is over when its last index arrives or when it falls silent: for
  twice its longest pause, within limits.
- A value that does not arrive is requested again after about one measured round trip.
- If single requests would take longer than the list did, at their measured pace, the list is requested again and known
  values stay: an autopilot that sends a thousand in a second as a list may answer single requests far more slowly.
- If PX4 sends the same hash of all parameters before and after the list, the table has that hash.
- The result is a complete table or a failure.
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
"""After a change of the count: one switch adds many parameters, and values in transit have the old count."""
HASH_TRIES: Final = 2
MAX_REPEATS: Final = 4
LONGEST_QUIETS: Final = 4
"""A list that paused is waited for longer than one that flows evenly, but at most so many times `quiet_s`: a pause of
seconds tells of a stalled line, not of a slow autopilot, and values asked for one by one cost little."""
GAPS_MEASURED: Final = 12
"""Single answers needed to estimate their rate."""


@dataclass(frozen=True, slots=True)
class Listed:
    """`autopilot_hash`: PX4's hash of exactly this table, if it sent one."""

    table: Table
    count: int
    autopilot_hash: bytes | None = None


@dataclass(frozen=True, slots=True)
class Unchanged:
    """The hash of the autopilot is unchanged: nothing was read."""


@dataclass(frozen=True, slots=True)
class ListingFailed:
    """`why`: without a full stop."""

    why: str


@dataclass(frozen=True, slots=True)
class _Asked:
    """Requests for one index: how many, when the last one was sent, and how long to wait for an answer."""

    tries: int
    at: float
    until: float


_NEVER_ASKED: Final = _Asked(0, 0.0, float("-inf"))


class ParameterListing:
    """Call `due` at each tick and after each `receive`, until `end` is set."""

    def __init__(self, talk: ParameterFrames, pace: Pace, *, known_hash: bytes | None = None) -> None:
        """`known_hash`: the autopilot's hash of the remembered table, if it sent one."""
        self._talk = talk
        self._pace = pace
        self._known_hash = known_hash
        self._question = Repeated(pace.tries)
        self._streaming = False
        self._asking_hash = False
        self._restarts = 0
        self._hash: bytes | None = None
        """The hash sent before the list."""
        self._count = 0
        self._names: dict[int, str] = {}
        self._values: dict[str, Parameter] = {}
        self._asked: dict[int, _Asked] = {}
        self._answers = AnswerTime(pace.answer_s)
        self._flowed_at: float | None = None
        self._flow_began_at = 0.0
        self._longest_pause_s = 0.0
        self._list_ended = False
        """The last index arrived as part of the list, not as a requested value."""
        self._missing: dict[int, None] | None = None
        """Indexes missing from the list; None while it flows."""
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
        """Parameters received, and in total (0: not known yet)."""
        return len(self._names), self._count

    def receive(self, received: ParamValue, now: float) -> None:
        """Takes a PARAM_VALUE of the autopilot, whoever requested it."""
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

    # Internals.

    def _ask_list(self) -> None:
        self._asking_hash = False
        self._question = Repeated(self._pace.tries)
        self._question.ask(self._talk.ask_all(), self._pace.first_s)

    def _ask_hash(self) -> None:
        self._asking_hash = True
        self._question = Repeated(HASH_TRIES)
        self._question.ask(self._talk.ask_name(HASH_NAME), self._pace.answer_s)

    def _silent(self) -> None:
        """The request got no answer."""
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
        """Returns whether a value with this count belongs to the list being read."""
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
        self._streaming = False  # values that arrive before the next request belong to neither list
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
            self._restart(now)  # the indexes shifted during the reading; if that is not the cause, it happens again
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
        quiet_s = self._pace.quiet_s
        quiet_s = min(max(quiet_s, 2 * self._longest_pause_s), LONGEST_QUIETS * quiet_s)
        return not self._list_ended and self._flowed_at is not None and now - self._flowed_at < quiet_s

    def _list_is_faster(self, now: float) -> bool:
        """Returns whether the whole list would be faster than single requests for the rest, at their measured rates."""
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
