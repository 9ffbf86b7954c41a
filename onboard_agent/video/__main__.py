"""`python -m onboard_agent.video`: the video process. The flight process starts it, writes to its standard input, reads
its standard output, and ends it by closing the input. Not meant to be started by hand."""

import os

NICE = 5
"""Lower priority than the flight process at any setting (its unit says -10), and than all ordinary processes."""

OOM_SCORE = 700
"""If memory runs short, the kernel kills this process first."""


def _step_back() -> None:
    """Lowers the priority before any large import."""
    for prepare in (_be_nice, _be_behind_in_real_time, _go_first_when_memory_is_short):
        try:
            prepare()
        except OSError:
            continue  # a systemd unit may forbid it


def _be_nice() -> None:
    os.setpriority(os.PRIO_PROCESS, 0, max(NICE, os.getpriority(os.PRIO_PROCESS, 0)))


def _be_behind_in_real_time() -> None:
    """Uses the lowest real-time priority if the flight process runs under a real-time policy (`chrt`,
    CPUSchedulingPolicy=): this process inherits the policy, and niceness then has no effect."""
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
