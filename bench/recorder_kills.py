"""Kills the tower in the middle of flights, at random moments, and looks at what each flight has afterwards.

Every frame carries its number and the time at which it was sent. So a file shows whether a frame is missing in the
middle, and how old the oldest frame is that the kill cost.
"""

from __future__ import annotations

import asyncio
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

import httpx

from bench.load_agents import LoadAgent, Telemetry, fly, kept_alive, sign_in_all
from bench.load_frames import EVENT_KINDS, read_plain
from bench.load_tower import LoadTower, load_tower
from bench.rows import Report
from server.flights.core.tlog import read_entries

DRONES: Final = 5
FRAMES_PER_S: Final = 50.0
FIRST_S: Final = 0.8
LAST_S: Final = 4.0
"""When the tower is killed, after the drones were armed."""
READY_WITHIN_S: Final = 60.0
MAVLOGDUMP: Final = Path(sys.executable).with_name("mavlogdump.py")
TOLD: Final = EVENT_KINDS[3]
"""STATUSTEXT: each is numbered, none replaces another."""


async def run_kills(report: Report, kills: int, seed: int = 1) -> None:
    case = f"{kills} kills, {DRONES} drones at {FRAMES_PER_S:g} frames/s"
    chance = random.Random(seed)
    lost_ms: list[float] = []
    unreadable = gaps = killed_at_us = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        keys: list[str] | None = None
        seen: set[int] = set()
        for number in range(kills + 1):
            async with load_tower(folder, drones=DRONES, keys=keys) as tower:
                keys = tower.keys
                if number:
                    ids = await _closed(tower, number * DRONES) - seen
                    seen |= ids
                    assert len(ids) == DRONES, f"{len(ids)} flights after kill {number}"
                    files = [await _download(tower, one, folder) for one in sorted(ids)]
                    unreadable += _unreadable(files[number % DRONES])
                    for file in files:
                        gap, last_sent_us, whole = _look(file)
                        gaps += gap
                        unreadable += not whole
                        lost_ms.append(max(0.0, (killed_at_us - last_sent_us) / 1e3))
                    report.say(f"kill {number}: the newest frame was {max(lost_ms[-DRONES:]):.0f} ms old")
                if number < kills:
                    killed_at_us = await _fly_and_kill(tower, chance.uniform(FIRST_S, LAST_S))
    report.add(case, "flights", len(lost_ms), "count")
    report.add(case, "files that cannot be read to their end", unreadable, "count")
    report.add(case, "frames missing in the middle", gaps, "count")
    report.spread(case, "lost before the kill", lost_ms, "ms")


async def _fly_and_kill(tower: LoadTower, after_s: float) -> int:
    """Returns when the tower was killed, in microseconds of the monotonic clock."""
    agents: list[LoadAgent] = await sign_in_all(tower.url, tower.keys)
    async with kept_alive(agents):
        telemetry = Telemetry(frames_per_s=FRAMES_PER_S, kinds=(TOLD,), burst=1)
        flying = asyncio.create_task(fly(agents, telemetry, for_s=after_s + 30))
        await asyncio.sleep(0.3)
        for agent in agents:
            await agent.report_state()
        await asyncio.sleep(after_s)
        killed_at_us = int(time.monotonic() * 1e6)
        tower.process.kill()
        await tower.process.wait()
        flying.cancel()
        await asyncio.gather(flying, return_exceptions=True)
    return killed_at_us


async def _closed(tower: LoadTower, count: int) -> set[int]:
    """Waits until the tower has closed what it found. Returns the ids of all flights."""
    deadline = time.monotonic() + READY_WITHIN_S
    async with httpx.AsyncClient(base_url=tower.url, headers={"Cookie": tower.cookie}, trust_env=False) as http:
        while True:
            found: list[dict[str, object]] = []
            before = ""
            while True:
                more = {"before": before} if before else {}
                answer = await http.get("/api/v1/flights", params={"limit": "100"} | more)
                answer.raise_for_status()
                page = answer.json()
                found += page["flights"]
                before = page["next"] or ""
                if not before:
                    break
            if len(found) >= count and all(one["state"] == "ready" for one in found):
                return {int(str(one["id"])) for one in found}
            assert time.monotonic() < deadline, f"{len(found)} of {count} flights are closed"
            await asyncio.sleep(0.1)


async def _download(tower: LoadTower, flight_id: int, folder: Path) -> Path:
    path = folder / f"{flight_id}.tlog"
    async with httpx.AsyncClient(base_url=tower.url, headers={"Cookie": tower.cookie}, trust_env=False) as http:
        answer = await http.get(f"/api/v1/flights/{flight_id}/tlog")
        answer.raise_for_status()
    path.write_bytes(answer.content)
    return path


def _look(path: Path) -> tuple[int, int, bool]:
    """Returns the frames missing between the first and the last, when the last was sent, and whether all is whole."""
    with path.open("rb") as file:
        entries = list(read_entries(file))
    whole = bool(entries) and entries[-1].end == path.stat().st_size
    told = [one for entry in entries for one in read_plain(entry.frame)]
    if not told:
        return 0, 0, whole
    return told[-1].number - told[0].number + 1 - len(told), told[-1].sent_us, whole


def _unreadable(path: Path) -> bool:
    """Whether pymavlink's own reader finds another number of messages than ours."""
    command = [sys.executable, str(MAVLOGDUMP), "--format=json", str(path)]
    ran = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | {"MAVLINK20": "1"}, timeout=60, check=False
    )
    with path.open("rb") as file:
        ours = sum(1 for _ in read_entries(file))
    theirs = sum(line.startswith("{") for line in ran.stdout.splitlines())
    return ran.returncode != 0 or ours != theirs
