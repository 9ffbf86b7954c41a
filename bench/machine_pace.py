"""When the machine itself stood still, so that a tail of delays can be told from the machine's.

The host of a shared machine takes the processors away for 5 to 10 ms at a time, several times a second, and calls it
processor time of whoever ran. Then all processes are late, and a p99 is a figure of the host. This process does the
same small work again and again and notes when that took several times its usual *processor* time. Waiting for its turn
does not count, so the load of the towers is no reason.

    async with machine_pace() as pace:
        ...
    pace.stood_still_at(sent_us)
"""

from __future__ import annotations

import asyncio
import json
import statistics
import sys
import time
from bisect import bisect_left
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

PERIOD_S: Final = 0.004
STEPS: Final = 5_000
"""Of one piece of work: about 0.2 ms."""
SLOW: Final = 4.0
"""Times the median."""
BEFORE_S: Final = 0.01
AFTER_S: Final = 0.02
"""A frame sent this long before or after such a moment met it, or the queue that it left."""
CHECKOUT: Final = Path(__file__).resolve().parent.parent


@dataclass
class MachinePace:
    """Complete once the block has ended."""

    slow_us: list[float] = field(default_factory=list)
    """When pieces of work ended that took too long: monotonic, in order."""
    pieces: int = 0

    def stood_still_at(self, sent_us: float) -> bool:
        """Whether a frame that was sent then may have met a halt of the machine."""
        first = bisect_left(self.slow_us, sent_us - AFTER_S * 1e6)
        return first < len(self.slow_us) and self.slow_us[first] <= sent_us + BEFORE_S * 1e6

    @property
    def slow_share(self) -> float:
        """Of the pieces of work."""
        return len(self.slow_us) / self.pieces if self.pieces else 0.0


@asynccontextmanager
async def machine_pace() -> AsyncIterator[MachinePace]:
    """Watches the machine until the block ends."""
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "bench.machine_pace", stdin=pipe, stdout=pipe, cwd=CHECKOUT
    )
    assert process.stdout is not None
    await process.stdout.readline()  # it watches
    pace = MachinePace()
    try:
        yield pace
    finally:
        out, _ = await process.communicate(b"")
    took = [(float(end), float(cpu)) for end, cpu in json.loads(out)]
    usual = statistics.median(cpu for _, cpu in took)
    pace.slow_us = [end for end, cpu in took if cpu > SLOW * usual]
    pace.pieces = len(took)


async def _watch() -> list[tuple[float, float]]:
    """Until standard input ends: when each piece of work ended, and its processor time, us."""
    took = []
    print("ready", flush=True)
    ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    while not ended.done():
        began_ns = time.thread_time_ns()
        for _ in range(STEPS):
            pass
        took.append((time.monotonic() * 1e6, (time.thread_time_ns() - began_ns) / 1e3))
        await asyncio.sleep(PERIOD_S)
    return took


if __name__ == "__main__":
    print(json.dumps(asyncio.run(_watch())))
