"""A child of the flight process steps behind it: lower priority, first to go when memory is short, dead with it.

Import nothing large here: this runs before everything else in such a process.
"""

import contextlib
import ctypes
import os
import signal

NICE = 5
OOM_SCORE = 700
"""If memory runs short, the kernel kills such a process before the flight process."""
_PR_SET_PDEATHSIG = 1


def step_back(nice: int = NICE) -> None:
    """`nice`: the lowest value that the process may have; a higher one stays. What a systemd unit forbids stays as it
    is."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, max(nice, os.getpriority(os.PRIO_PROCESS, 0)))
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as file:  # noqa: PTH123 (no pathlib yet)
        file.write(str(OOM_SCORE))
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
