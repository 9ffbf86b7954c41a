"""Checks the health of the video process by its reports and its thread states. No I/O.

Silence is reported soon, because no pictures arrive then, whatever the reason. A short silence alone does not end the
process: on a busy computer a healthy process may wait long for its turn. The system then shows one of its threads as
ready to run, or waiting for the disk. If instead all threads are stopped or asleep, the process hangs: its event loop
never sleeps longer than a tenth of a second, unless another thread holds Python's lock.
"""

from enum import Enum
from typing import Final

CHECK_EVERY_S: Final = 0.25
MAX_STEP_S: Final = 0.3
"""After a longer pause between two checks the parent itself was paused: that does not count as silence of the child."""
FIRST_WORD_WITHIN_S: Final = 30.0
"""For a small computer that reads all libraries from a memory card."""
SAID_AFTER_S: Final = 0.65
"""Two reports were due. With the tick that detects it, viewers are informed within a second."""
STOPPED_S: Final = 0.4
ASLEEP_S: Final = 2.0
SILENT_S: Final = 6.0
"""Whatever its threads are doing."""

STOPPED: Final = "T"
ASLEEP: Final = "S"


class Verdict(Enum):
    """`HUNG`: the process will not recover."""

    WELL = "well"
    SILENT = "silent"
    HUNG = "hung"


class ChildWatch:
    """Watches one child from its start."""

    def __init__(self, now: float) -> None:
        self.silent_s = 0.0
        """Time without a report, not counting pauses of the parent."""
        self._first_word = False
        self._checked_at = now
        self._stopped_s = 0.0
        self._asleep_s = 0.0

    def heard(self) -> None:
        """The child sent a report."""
        self._first_word = True
        self.silent_s = self._stopped_s = self._asleep_s = 0.0

    @property
    def is_silent(self) -> bool:
        """Always False before the first report."""
        return self._first_word and self.silent_s > SAID_AFTER_S

    def judge(self, states: str, now: float) -> Verdict:
        """Call every CHECK_EVERY_S. `states`: the state letters of the child's threads (proc(5)); empty if unknown or,
        while the child is not silent, not looked up."""
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
    """The state letter in a thread's /proc/PID/task/TID/stat, or empty. The name may contain brackets and spaces."""
    words = stat.rpartition(")")[2].split()
    return words[0] if words else ""
