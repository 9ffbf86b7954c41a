"""A controller for tests of flights, and where its process is."""

from pathlib import Path
from typing import Final

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
