"""Runs tower and agent with the priority that their systemd units give them, and the pilot as on a machine of its own.

Attackers, tower, agent and pilot share the machine here because there is only one; in the field nobody attacks from the
tower's processors. What the units do not give, nobody gets.
"""

from __future__ import annotations

import contextlib
import os
import re
from pathlib import Path
from typing import Final

DEPLOY: Final = Path(__file__).resolve().parent.parent / "deploy"


def nice_of(unit: str) -> int:
    """What the unit file says of Nice. Raises ValueError where it says nothing."""
    found = re.search(r"^Nice=(-?\d+)$", (DEPLOY / unit).read_text(), re.MULTILINE)
    if found is None:
        raise ValueError(f"{unit} has no Nice")
    return int(found[1])


def run_as_installed(*, tower_pid: int, agent_pid: int) -> bool:
    """Of all their threads. False: it takes a right that this program does not have (CAP_SYS_NICE), and nothing is
    changed."""
    agent_nice = nice_of("tower-agent.service")
    wanted = {tower_pid: nice_of("tower.service"), agent_pid: agent_nice, os.getpid(): agent_nice}
    with contextlib.suppress(PermissionError):
        for pid, nice in wanted.items():
            for thread in Path(f"/proc/{pid}/task").iterdir():
                os.setpriority(os.PRIO_PROCESS, int(thread.name), nice)
        return True
    return False
