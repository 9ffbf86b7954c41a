"""Asserts that the pilot of a drone flown by hand notices nothing of an attack.

Time limits are wide because the machine is shared with other tests. `python -m bench anonymous` measures the narrow
ones.
"""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from bench.flown_by_hand import HandFlight, Noticed

MAX_GAP_MS: Final = 500.0
"""Longest gap between frames sent every 20 ms, beyond the delay of this program itself."""
MAX_MEMORY_MB: Final = 60.0
MIN_S: Final = 1.0


def assert_unharmed(noticed: Noticed) -> None:
    """Asserts no hold, no lost channel, and frames and sticks as without an attack."""
    assert set(noticed.wrong.values()) == {0.0}, f"{noticed.wrong}; the pilot itself was late by {noticed.own_gap_ms}"
    assert not noticed.closed
    assert noticed.largest_gap_ms - noticed.own_gap_ms < MAX_GAP_MS
    assert noticed.sticks_at
    assert noticed.sticks_lost <= len(noticed.sticks_at) // 10
    assert noticed.rss_most_mb - noticed.rss_before_mb < MAX_MEMORY_MB


@asynccontextmanager
async def unharmed(flight: HandFlight) -> AsyncIterator[Noticed]:
    """Observes the flight while the block attacks."""
    async with flight.noticing() as noticed:
        yield noticed
        await asyncio.sleep(MIN_S)  # catches the effects of an attack that ended at once
    assert_unharmed(noticed)
