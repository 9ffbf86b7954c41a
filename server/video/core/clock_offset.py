"""The offset of an agent's clock: the answer with the shortest round trip is the best estimate. Pure.

An answer's error is at most half its round trip, and it grows with age by the clocks' drift. The answer with the
smallest error counts. The offset is not averaged: on a busy line nearly all answers are late in one direction, and so
would be the mean.
"""

from collections import OrderedDict
from typing import Final, NamedTuple

DRIFT: Final = 100e-6
"""Two cheap quartzes run apart by no more than this: a millisecond in ten seconds."""
MAX_OPEN: Final = 16
ANSWERED_WITHIN_S: Final = 2.0
"""A later answer is ignored."""
MAX_KEPT: Final = 24
PROBES_AT_ONCE: Final = 6
PROBE_FAST_S: Final = 0.2
PROBE_EVERY_S: Final = 5.0
PROBE_UNKNOWN_S: Final = 1.0
_NO_TIME_US: Final = 1 << 63
"""Bounds what an agent can report: 292 000 years."""


class _Answer(NamedTuple):
    at: float
    round_trip_s: float
    offset_us: int

    def error_s(self, now: float) -> float:
        return self.round_trip_s / 2 + (now - self.at) * DRIFT


class ClockOffset:
    """One for each link: an agent that was started again may have another clock."""

    def __init__(self) -> None:
        self._asked: OrderedDict[int, float] = OrderedDict()
        self._answers: list[_Answer] = []
        self._number = 0
        self._due_at = float("-inf")

    def probe(self, now: float) -> int | None:
        """The number of a probe, if one is due: a few in a row, then one from time to time."""
        if now < self._due_at:
            return None
        number = self.ask(now)
        hurried = PROBE_FAST_S if number < PROBES_AT_ONCE else PROBE_UNKNOWN_S
        self._due_at = now + (PROBE_EVERY_S if self.known and number >= PROBES_AT_ONCE else hurried)
        return number

    def ask(self, now: float) -> int:
        """The number of a probe that is sent now."""
        self._number = (self._number + 1) & 0xFFFFFFFF
        self._asked[self._number] = now
        while len(self._asked) > MAX_OPEN:
            self._asked.popitem(last=False)
        return self._number

    def answered(self, number: int, at_us: int, now: float) -> bool:
        """The agent's clock showed `at_us` when it answered. False for what is no answer to an open probe."""
        asked_at = self._asked.pop(number, None)
        if asked_at is None or not 0.0 <= now - asked_at <= ANSWERED_WITHIN_S:
            return False
        middle_us = round((asked_at + now) * 500_000)
        answer = _Answer(now, now - asked_at, middle_us - at_us)
        self._answers.append(answer)
        if len(self._answers) > MAX_KEPT:
            self._answers.remove(max(self._answers, key=lambda one: one.error_s(now)))
        return True

    @property
    def known(self) -> bool:
        """Whether any answer has come."""
        return bool(self._answers)

    def offset_us(self, now: float) -> int | None:
        """Tower's monotonic clock less the agent's; None: not known."""
        if not self._answers:
            return None
        return min(self._answers, key=lambda one: one.error_s(now)).offset_us

    def error_ms(self, now: float) -> float | None:
        """By how much the offset may be wrong at most."""
        if not self._answers:
            return None
        return min(one.error_s(now) for one in self._answers) * 1000

    def tower_us(self, agent_us: int, now: float) -> int:
        """A moment of the agent's clock by the tower's; 0: not known, or no time that a unit can have."""
        offset = self.offset_us(now)
        if offset is None or agent_us == 0 or agent_us + offset >= _NO_TIME_US:
            return 0
        return max(1, agent_us + offset)
