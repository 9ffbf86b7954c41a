"""How long a process ran, and how long it was ready and waited for a processor: /proc/PID/schedstat, main thread."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class RunQueue(NamedTuple):
    """So far, in milliseconds."""

    ran_ms: float
    waited_ms: float
    """Runnable, while others had the processor."""

    def since(self, before: RunQueue) -> RunQueue:
        return RunQueue(self.ran_ms - before.ran_ms, self.waited_ms - before.waited_ms)


def run_queue_of(pid: int) -> RunQueue:
    """Reads the main thread, which runs the event loop. Raises OSError if it is gone."""
    ran_ns, waited_ns, _ = Path(f"/proc/{pid}/schedstat").read_text().split()
    return RunQueue(int(ran_ns) / 1e6, int(waited_ns) / 1e6)
