"""The viewers' process of a fan-out: WebSocket clients that read everything, and count what is missing.

`python -m bench.video.viewers` gets one JSON line: {"url", "path", "cookie", "subprotocol", "count", "units"}; prints
"ready" when every viewer has received something; then answers each further line with what arrived since the last, as
JSON.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from dataclasses import dataclass, field
from typing import Any, Final

import uvloop

from bench.lean_browser import LeanBrowser, connect_browser
from bench.video.figures import TransportStream
from bench.video.got_cadence import Got, GotCadence
from wire.video import decode_unit

FIRST_S: Final = 30.0


@dataclass
class Tally:
    """Of one viewer, since the last query."""

    messages: int = 0
    bytes: int = 0
    missing: int = 0
    """Units, or packets of MPEG-TS."""
    skipped: int = 0
    """Those of the missing units that the tower reports as skipped, because this viewer was too slow."""
    breaks: int = 0
    ages_ms: list[float] = field(default_factory=list)


class UnitViewer:
    """A viewer of the tower: counts by the numbers in the units' heads, and sends `got`."""

    def __init__(self, browser: LeanBrowser) -> None:
        self.tally = Tally()
        self._browser = browser
        self._next: int | None = None
        self._cadence = GotCadence()
        self._looks_at = float("inf")
        browser.on_binary = self.take
        browser.on_text = self._reported

    def take(self, message: bytes) -> None:
        unit, now = decode_unit(message), time.monotonic()
        tally = self.tally
        tally.messages += 1
        tally.bytes += len(message)
        if self._next is not None:
            tally.missing += (unit.sequence - self._next) & 0xFFFFFFFF
        tally.breaks += unit.is_break
        self._next = (unit.sequence + 1) & 0xFFFFFFFF
        if unit.capture_us:
            tally.ages_ms.append(now * 1e3 - unit.capture_us / 1e3)
        self._cadence.came(unit.sequence, now)
        captured_at = unit.capture_us / 1e6 if unit.capture_us else None
        self._say(self._cadence.drawn(unit.sequence, captured_at, unit.rate_hz, now))

    def _reported(self, text: bytes) -> None:
        reported = json.loads(text)
        if reported["type"] == "skipped":
            self.tally.skipped += reported["count"]

    def _look(self) -> None:
        self._looks_at = float("inf")
        self._say(self._cadence.look(time.monotonic()))

    def _say(self, said: Got | None) -> None:
        if said is not None:
            more = ',"calm":true' if said.calm else ',"overdue":true' if said.overdue else ""
            more += f',"held_ms":{said.held_s * 1000:.0f}' if said.held_s else ""
            self._browser.send_text(f'{{"type":"got","sequence":{said.sequence}{more}}}')
        look_at = self._cadence.look_at
        if look_at < self._looks_at:
            self._looks_at = look_at
            asyncio.get_running_loop().call_later(look_at - time.monotonic(), self._look)


class StreamViewer:
    """A viewer of the Node relay: MPEG-TS in pieces of any size."""

    def __init__(self, browser: LeanBrowser) -> None:
        self.tally = Tally()
        self._stream = TransportStream()
        self._reported = 0
        browser.on_binary = self.take

    def take(self, message: bytes) -> None:
        self._stream.feed(message)
        self.tally.messages += 1
        self.tally.bytes += len(message)
        self.tally.missing += self._stream.missing - self._reported
        self._reported = self._stream.missing


Viewer = UnitViewer | StreamViewer


async def run() -> None:
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    asked = json.loads(await reader.readline())
    browsers: list[LeanBrowser] = []
    viewers: list[Viewer] = []
    for _ in range(asked["count"]):
        made: list[Viewer] = []

        def begin(browser: LeanBrowser, made: list[Viewer] = made) -> None:
            made.append(UnitViewer(browser) if asked["units"] else StreamViewer(browser))

        browsers.append(
            await connect_browser(
                asked["url"],
                path=asked["path"],
                cookie=asked["cookie"],
                subprotocol=asked["subprotocol"],
                before=begin,
            )
        )
        viewers += made
    async with asyncio.timeout(FIRST_S):
        while not all(viewer.tally.messages for viewer in viewers):  # noqa: ASYNC110
            await asyncio.sleep(0.05)
    print("ready", flush=True)
    while await reader.readline():
        print(json.dumps(_answer(viewers)), flush=True)
    for browser in browsers:
        browser.close()


def _answer(viewers: list[Viewer]) -> dict[str, Any]:
    tallies = [viewer.tally for viewer in viewers]
    for viewer in viewers:
        viewer.tally = Tally()
    return {
        "messages": [tally.messages for tally in tallies],
        "bytes": sum(tally.bytes for tally in tallies),
        "missing": sum(tally.missing for tally in tallies),
        "skipped": sum(tally.skipped for tally in tallies),
        "breaks": sum(tally.breaks for tally in tallies),
        "ages_ms": [age for tally in tallies for age in tally.ages_ms],
    }


if __name__ == "__main__":
    uvloop.run(run())
