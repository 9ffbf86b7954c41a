"""`python -m onboard_agent.autonomy`: a controller's process. The flight process starts it, and kills it at its end.
Not meant to be started by hand."""

import contextlib
import ctypes
import os
import signal

NICE = 5
OOM_SCORE = 700
"""If memory runs short, the kernel kills this process before the flight process."""
_PR_SET_PDEATHSIG = 1


def _step_back() -> None:
    """Behind the flight process in everything, and dead with it."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, max(NICE, os.getpriority(os.PRIO_PROCESS, 0)))
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as file:  # noqa: PTH123 (no pathlib yet)
        file.write(str(OOM_SCORE))
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


if __name__ == "__main__":
    _step_back()
    from onboard_agent.autonomy.runner import main

    main()
