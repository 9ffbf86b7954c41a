"""Asserts that the pilot of a drone flown by hand notices nothing of an attack.

Time limits are wide because the machine is shared with other tests. `python -m bench anonymous` measures the narrow
ones.
"""

import asyncio
import json
import urllib.request
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from bench.flown_by_hand import HandFlight, Noticed
from bench.load_tower import LoadTower

MAX_GAP_MS: Final = 500.0
"""Longest gap between frames sent every 20 ms, beyond the delay of this program itself."""
MAX_MEMORY_MB: Final = 60.0
MIN_S: Final = 1.0
PATIENT: Final = {"sticks_stale_s": 2.0, "sticks_late_s": 2.0, "rtt_limit_ms": 5000.0, "rtt_limit_s": 5.0}


def make_patient(tower: LoadTower, drone_id: int) -> None:
    """Lets a drone wait for two seconds of missing sticks: its pilot is a task of the process that runs the tests. A
    busy machine makes that late, and it is no harm by an attack. `MAX_GAP_MS` tells what is."""
    head = {"Cookie": tower.cookie, "Origin": tower.url, "Content-Type": "application/json"}
    url, body = f"{tower.url}/api/v1/drones/{drone_id}/settings", json.dumps(PATIENT).encode()
    with urllib.request.urlopen(urllib.request.Request(url, body, head, method="PATCH"), timeout=10) as answer:
        assert answer.status == 200


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
