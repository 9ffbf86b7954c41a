"""A controller for tests of flights, and where its process is."""

import contextlib
import os
from pathlib import Path
from typing import Final

FIRST: Final = -15
"""A priority of Linux."""

PACER: Final = '''
from pathlib import Path
from onboard_agent.autonomy.controller import Controller, forward

class Pacer(Controller):
    """One direction a second. Raises when a file of this name is there."""
    next_at_s = 0.0

    def step(self, seen):
        if Path(__file__).with_suffix(".raise").exists():
            raise ValueError("told to")
        if seen.at_s < self.next_at_s:
            return None
        self.next_at_s = seen.at_s + 1.0
        return forward(1.0, for_s=2.0)
'''


def controller_process(agent: int) -> int | None:
    """Returns the process id of the controller, a child of the agent with this process id."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == agent and b"onboard_agent.autonomy" in (folder / "cmdline").read_bytes():
                return int(folder.name)
        except OSError:
            continue
    return None


def run_first(*pids: int) -> None:
    """A flight on a busy machine: a controller that gets no processor for 0.4 s is rightly ended, and a simulated
    autopilot that gets none does not answer. What these processes start has their priority, or one below it."""
    for each in (*pids, *(child for pid in pids for child in children_of(pid))):
        with contextlib.suppress(PermissionError, ProcessLookupError):  # for root alone
            os.setpriority(os.PRIO_PROCESS, each, FIRST)


def children_of(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return [int(child) for task in tasks for child in (task / "children").read_text().split()]
