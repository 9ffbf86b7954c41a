"""A pilot, the agent of their drone and its autopilot in a process of their own: no other load delays them.

A thousand browsers in one process stop it for hundreds of milliseconds. A pilot in the same process would send late,
and the autopilot would note late what came in time. The process has a higher priority than the load, where that is
permitted: pilot and drone have machines of their own.

    async with pilot_process(folder, tower.url, key, seat) as pilot:
        await pilot.live()
        await pilot.fly()
        await pilot.look()      # pilot.sent, pilot.arrived
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import random
import sys
import time
from collections.abc import AsyncIterator, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from bench.pilot_sticks import STICKS_S, stick
from bench.precise_timer import PreciseTimer
from bench.reconnecting_browsers import Reconnecting, Seat, all_live
from bench.relay_sticks import real_agent
from wire.ids import DroneId

CHECKOUT: Final = Path(__file__).resolve().parents[1]
PRIORITY: Final = -10
LIVE_S: Final = 120.0
MAX_LINE: Final = 16 * 1024 * 1024


def longest_gap(moments: Iterable[float], begin: float, end: float) -> tuple[float, float]:
    """The longest time without any of these moments between `begin` and `end`, and when that began; s."""
    inside = [begin, *sorted(at for at in moments if begin < at < end), end]
    return max((after - before, before) for before, after in itertools.pairwise(inside))


class PilotProcess:
    """The other side of `pilot_process`. Moments are of the monotonic clock, which all processes share."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self.sent: dict[int, float] = {}
        self.arrived: dict[int, float] = {}

    async def live(self) -> float:
        """When the pilot's browser became live. Waits until it is."""
        return float(await self._ask("live"))

    async def fly(self) -> None:
        """Sends a numbered stick every 20 ms from now on, while the browser is open."""
        await self._ask("fly")

    async def look(self) -> None:
        """Fetches which sticks were sent and arrived until now."""
        sent, arrived = await self._ask("look")
        self.sent = {int(number): at for number, at in sent.items()}
        self.arrived = {int(number): at for number, at in arrived.items()}

    def first_after(self, moment: float) -> float | None:
        """When the first stick sent after this moment reached the autopilot."""
        return min((at for number, at in self.arrived.items() if self.sent[number] > moment), default=None)

    async def _ask(self, word: str) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{word}\n".encode())
        line = await self._process.stdout.readline()
        if not line:
            raise RuntimeError("the pilot's process has ended")
        return json.loads(line)


@contextlib.asynccontextmanager
async def pilot_process(folder: Path, tower_url: str, key: str, seat: Seat) -> AsyncIterator[PilotProcess]:
    """The pilot's browser connects again and again, and the agent with this key does, until the block ends."""
    told = json.dumps({"folder": str(folder), "url": tower_url, "key": key, "seat": asdict(seat)})
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "bench.pilot_process",
        told,
        cwd=CHECKOUT,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        limit=MAX_LINE,
    )
    try:
        yield PilotProcess(process)
    finally:
        assert process.stdin is not None
        process.stdin.close()
        await process.wait()


async def _send_sticks(browser: Reconnecting, sent: dict[int, float]) -> None:
    timer, begin = PreciseTimer(), time.monotonic()
    try:
        for number in range(1, 65_536):
            await timer.until(begin + number * STICKS_S)
            if browser.welcomed_at is not None and browser.now_open is not None:
                sent[number] = time.monotonic()
                browser.now_open.send_binary(stick(DroneId(browser.seat.drone_id), number))
    finally:
        timer.close()


async def _serve(folder: Path, url: str, key: str, seat: dict[str, Any]) -> None:
    with contextlib.suppress(PermissionError):
        os.nice(PRIORITY)  # the agent inherits it
    words = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(words), sys.stdin)
    browser, sent = Reconnecting(url, Seat(**seat), random.Random(1)), dict[int, float]()
    tasks = [asyncio.create_task(browser.run())]
    async with real_agent(folder, url, key) as autopilot:
        while word := (await words.readline()).decode().strip():
            answer: Any = None
            if word == "live":
                (answer,) = await all_live([browser], LIVE_S)
            elif word == "fly":
                tasks.append(asyncio.create_task(_send_sticks(browser, sent)))
            else:
                answer = [sent, autopilot.arrived]
            print(json.dumps(answer), flush=True)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    asyncio.run(_serve(Path(given["folder"]), given["url"], given["key"], given["seat"]))
