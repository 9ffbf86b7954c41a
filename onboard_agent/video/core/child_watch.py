"""Whether the video process is healthy, by its last report and by the system's view of it. No I/O.

Its silence is reported soon, because no pictures arrive then, whatever the reason. It is given up only with more
evidence than silence: on a busy computer a healthy process may wait long for its turn, but then the system shows one of
its threads ready to run, or waiting for the disk, and not all of them stopped or asleep. Its event loop never sleeps
for longer than a tenth of a second, unless another thread holds Python's lock.
"""

from enum import Enum
from typing import Final

CHECK_EVERY_S: Final = 0.25
MAX_STEP_S: Final = 0.3
"""After a longer pause between two looks it was we who were not there: that is no silence of the child's."""
FIRST_WORD_WITHIN_S: Final = 30.0
"""A small computer that reads all libraries from a memory card."""
SAID_AFTER_S: Final = 0.65
"""Two reports were due. With the tick that finds it, viewers know within a second."""
STOPPED_S: Final = 0.4
ASLEEP_S: Final = 2.0
SILENT_S: Final = 6.0
"""Whatever it does meanwhile."""

STOPPED: Final = "T"
ASLEEP: Final = "S"


class Verdict(Enum):
    """`HUNG`: nothing will come of it any more."""

    WELL = "well"
    SILENT = "silent"
    HUNG = "hung"


class ChildWatch:
    """For one child, from its start."""

    def __init__(self, now: float) -> None:
        self.silent_s = 0.0
        """How long it has been silent, as far as we were running to notice."""
        self._first_word = False
        self._checked_at = now
        self._stopped_s = 0.0
        self._asleep_s = 0.0

    def heard(self) -> None:
        """It reported something."""
        self._first_word = True
        self.silent_s = self._stopped_s = self._asleep_s = 0.0

    @property
    def is_silent(self) -> bool:
        """Before its first word it is not missed."""
        return self._first_word and self.silent_s > SAID_AFTER_S

    def judge(self, states: str, now: float) -> Verdict:
        """Every CHECK_EVERY_S. `states`: the letters that the system has for its threads (proc(5)); empty where they
        are not known or, while it is not silent, were not looked up."""
        step_s = min(MAX_STEP_S, max(0.0, now - self._checked_at))
        self._checked_at = now
        self.silent_s += step_s
        self._stopped_s = self._stopped_s + step_s if set(states) == {STOPPED} else 0.0
        self._asleep_s = self._asleep_s + step_s if set(states) == {ASLEEP} else 0.0
        if not self._first_word:
            return Verdict.HUNG if self.silent_s > FIRST_WORD_WITHIN_S else Verdict.WELL
        if self._stopped_s > STOPPED_S or self._asleep_s > ASLEEP_S or self.silent_s > SILENT_S:
            return Verdict.HUNG
        return Verdict.SILENT if self.is_silent else Verdict.WELL


def state_of(stat: str) -> str:
    """The state letter in a thread's /proc/PID/task/TID/stat; empty: there is none. A name may contain brackets and
    blanks."""
    words = stat.rpartition(")")[2].split()
    return words[0] if words else ""
