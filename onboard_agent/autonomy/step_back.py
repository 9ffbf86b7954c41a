"""What a helper process of the agent does first: it goes behind the flight process in everything, and dies with it."""

import contextlib
import ctypes
import os
import signal
from typing import Final

OOM_SCORE: Final = 700
"""If memory runs short, the kernel kills this process before the flight process."""
_PR_SET_PDEATHSIG: Final = 1


def step_back(nice: int) -> None:
    """`nice`: the lowest value that it may have; a higher one stays."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, max(nice, os.getpriority(os.PRIO_PROCESS, 0)))
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as file:  # noqa: PTH123 (no pathlib yet)
        file.write(str(OOM_SCORE))
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
