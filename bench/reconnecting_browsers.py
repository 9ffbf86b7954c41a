"""Browsers that come back as the console does: with its back-off, its cookie, its subscriptions, each of its own user.

The delays are those of `web/src/link/backoff.ts`. A browser is live when it has its welcome and a frame of its drone.
"""

from __future__ import annotations

import asyncio
import json
import random
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from bench.lean_browser import LeanBrowser, UpgradeRefused, connect_browser
from bench.load_tower import BROWSER_SUBPROTOCOL

FIRST_DELAY_S: Final = 0.5
MAX_DELAY_S: Final = 8.0
WELCOME_S: Final = 10.0
WATCH_HZ: Final = 2.0
LIVE_PATH: Final = "/api/v1/live"


@dataclass(frozen=True, slots=True)
class Seat:
    """Who sits at a browser: the session's cookie, the address it comes from, and the drone that it has in focus."""

    cookie: str
    address: str
    drone_id: int


def backoff_s(failures: int, chance: random.Random) -> float:
    """As the console: half to all of a delay that doubles with each failure (from 1)."""
    return min(MAX_DELAY_S, FIRST_DELAY_S * float(2 ** min(failures - 1, 10))) * (0.5 + 0.5 * chance.random())


@dataclass
class Reconnecting:
    """One browser. `run` keeps it connected; the others tell how that goes."""

    url: str
    seat: Seat
    chance: random.Random
    attempts: int = 0
    welcomed_at: float | None = None
    live_at: float | None = None
    """When its drone's first frame of this connection came; None while it is not live."""
    now_open: LeanBrowser | None = None
    welcome_bytes: int = 0
    _lost: asyncio.Event = field(default_factory=asyncio.Event)

    async def run(self) -> None:
        """Connects again and again until it is cancelled."""
        failures = 0
        try:
            while True:
                if await self._connected():
                    await self._lost.wait()
                    failures = 0
                failures += 1
                self._forget()
                await asyncio.sleep(backoff_s(failures, self.chance))
        finally:
            self._forget()

    def cut(self) -> None:
        """Ends the connection as a network does, without a goodbye."""
        if self.now_open is not None:
            self.now_open.close()

    async def _connected(self) -> bool:
        self.attempts += 1
        self._lost = asyncio.Event()
        welcome = asyncio.Event()

        def read(text: bytes) -> None:
            self._read(text, welcome)

        def listen(browser: LeanBrowser) -> None:
            self.now_open = browser
            browser.on_text, browser.on_binary, browser.on_closed = read, self._saw, self._lost.set

        try:
            async with asyncio.timeout(WELCOME_S):
                await connect_browser(
                    self.url,
                    path=LIVE_PATH,
                    cookie=self.seat.cookie,
                    subprotocol=BROWSER_SUBPROTOCOL,
                    before=listen,
                    address=self.seat.address,
                )
                await _first_of(welcome, self._lost)
        except (OSError, UpgradeRefused, TimeoutError):
            return False
        return welcome.is_set()

    def _read(self, text: bytes, welcome: asyncio.Event) -> None:
        browser = self.now_open
        if browser is None:
            return
        if text.startswith(b'{"type":"welcome"'):
            self.welcomed_at, self.welcome_bytes = time.monotonic(), len(text)
            browser.send_text(json.dumps({"type": "watch", "rate_hz": WATCH_HZ}))
            browser.send_text(json.dumps({"type": "focus", "drone_id": self.seat.drone_id}))
            welcome.set()
        elif text.startswith(b'{"type":"ping"'):
            browser.send_text(json.dumps({"type": "pong", "sequence": json.loads(text)["sequence"]}))

    def _saw(self, message: bytes) -> None:
        of_its_drone = int.from_bytes(message[:4], "little") == self.seat.drone_id
        if of_its_drone and self.live_at is None and self.welcomed_at is not None:
            self.live_at = time.monotonic()

    def _forget(self) -> None:
        if self.now_open is not None:
            self.now_open.close()
        self.now_open = self.welcomed_at = self.live_at = None


async def _first_of(*events: asyncio.Event) -> None:
    waits = [asyncio.create_task(event.wait()) for event in events]
    try:
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for wait in waits:
            wait.cancel()


async def all_live(browsers: Sequence[Reconnecting], within_s: float) -> list[float]:
    """Waits until every one is live; returns the moments. Raises TimeoutError."""
    async with asyncio.timeout(within_s):
        while any(one.live_at is None for one in browsers):  # noqa: ASYNC110 (a thousand callbacks would cost more)
            await asyncio.sleep(0.05)
    return [one.live_at for one in browsers if one.live_at is not None]
