"""Work that comes back again and again does so on common beats: one wake-up of the process serves all of it.

A process that sleeps and is woken pays a fifth of a millisecond for it, whatever it then does: the clock of the hub,
the server's own and the sign-in of fifty viewers, each at moments of its own, were most of what an idle tower used.
"""

import asyncio
import math
import time
from typing import Final

BEAT_S: Final = 0.1


async def rest(about_s: float) -> float:
    """Sleeps until the beat that is nearest to so many seconds from now (exactly so long where that is less than a
    beat). Returns when it was due, in monotonic seconds."""
    now = time.monotonic()
    due_at = now + about_s if about_s < BEAT_S else round((now + about_s) / BEAT_S) * BEAT_S
    # Loops round to milliseconds: rounded up, all who wait for a beat wait for the same one.
    await asyncio.sleep(math.ceil((due_at - now) * 1000) / 1000)
    return due_at
