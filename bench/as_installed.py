"""Runs tower and agent with the priority of their systemd units, and the pilot as on a separate machine.

Attackers, tower, agent and pilot share the only machine here; in the field no attacker uses the tower's processors.
This module gives only the priorities that the units give.
"""

from __future__ import annotations

import contextlib
import os
import re
from pathlib import Path
from typing import Final

DEPLOY: Final = Path(__file__).resolve().parent.parent / "deploy"


def nice_of(unit: str) -> int:
    """Returns the Nice value of the unit file. Raises ValueError if it has none."""
    found = re.search(r"^Nice=(-?\d+)$", (DEPLOY / unit).read_text(), re.MULTILINE)
    if found is None:
        raise ValueError(f"{unit} has no Nice")
    return int(found[1])


def run_as_installed(*, tower_pid: int, agent_pid: int) -> bool:
    """Applies to all their threads. False: this program lacks the right (CAP_SYS_NICE), and nothing is changed."""
    agent_nice = nice_of("tower-agent.service")
    wanted = {tower_pid: nice_of("tower.service"), agent_pid: agent_nice, os.getpid(): agent_nice}
    with contextlib.suppress(PermissionError):
        for pid, nice in wanted.items():
            for thread in Path(f"/proc/{pid}/task").iterdir():
                os.setpriority(os.PRIO_PROCESS, int(thread.name), nice)
        return True
    return False
