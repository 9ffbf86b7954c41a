"""`python -m onboard_agent.video`: the video process.

The flight process starts it, writes to its standard input, reads its standard output, and ends it by closing the
former. Not for people.
"""

import os

NICE = 5
"""Below the flight process, at any priority of that (its unit says -10), and below everything ordinary."""

OOM_SCORE = 700
"""If memory is short it is this process that goes."""


def _step_back() -> None:
    """Before anything large is imported."""
    for prepare in (_be_nice, _be_behind_in_real_time, _go_first_when_memory_is_short):
        try:
            prepare()
        except OSError:
            continue  # a unit may forbid it


def _be_nice() -> None:
    os.setpriority(os.PRIO_PROCESS, 0, max(NICE, os.getpriority(os.PRIO_PROCESS, 0)))


def _be_behind_in_real_time() -> None:
    """Where the flight process was given a real-time priority (`chrt`, CPUSchedulingPolicy=) we have it too, and are as
    nice as we like without effect: then the lowest."""
    if os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(os.sched_get_priority_min(os.SCHED_RR)))


def _go_first_when_memory_is_short() -> None:
    file = os.open("/proc/self/oom_score_adj", os.O_WRONLY)
    try:
        os.write(file, str(OOM_SCORE).encode())
    finally:
        os.close(file)


if __name__ == "__main__":
    _step_back()
    from onboard_agent.video.entry import main

    main()
