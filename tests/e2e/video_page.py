"""The video of a page as a test sees it: what is on the canvas, and what the page reports about it."""

import math
import time
from typing import Final

from console_page import ConsolePage

from bench.video.strip import Sight, clock_ms, sight

MOVES_WITHIN_S: Final = 30.0
PAST_LIVE_MS: Final = 1_000
"""A picture older than this is not live, however slow the machine."""

READ_STRIP: Final = """(which = 0) => {
  const canvas = document.querySelectorAll('[data-testid=video-picture]')[which];
  if (canvas === undefined || canvas.width < 20) return { cells: 0, seen_ms: Date.now(), width: 0, height: 0 };
  const copy = new OffscreenCanvas(canvas.width, canvas.height);
  const pen = copy.getContext('2d', { willReadFrequently: true });
  pen.drawImage(canvas, 0, 0);
  const cell = canvas.width / 20;
  let cells = 0;
  for (let at = 0; at < 20; at++) {
    const [red, green, blue] = pen.getImageData(Math.round((at + 0.5) * cell), 4, 1, 1).data;
    cells = (cells << 1) | (red + green + blue > 3 * 126 ? 1 : 0);
  }
  return { cells, seen_ms: Date.now(), width: canvas.width, height: canvas.height };
}"""


def strip(console: ConsolePage, which: int = 0) -> Sight | None:
    """Reads the strip on the page's canvas number `which`; None if there is no strip."""
    seen = console.page.evaluate(READ_STRIP, which)
    clock = clock_ms(seen["cells"])
    return None if clock is None else sight(seen["seen_ms"], clock)


def wait_until_live(console: ConsolePage, which: int = 0) -> None:
    def is_live() -> bool:
        seen = strip(console, which)
        return seen is not None and seen.delay_ms < PAST_LIVE_MS

    console.wait("a live picture", is_live)


def state(console: ConsolePage) -> str | None:
    return console.part("video").get_attribute("data-state")


def count(console: ConsolePage, figure: str) -> float:
    part = console.part(f"video-{figure}")
    return float(part.get_attribute("data-value") or "nan") if part.count() else math.nan


def moves(console: ConsolePage, which: int = 0, *, lasts_s: float = 1.0, at_least: int = 5) -> list[Sight]:
    """Returns the distinct pictures that the canvas shows from now on: for `lasts_s`, and on a busy machine until they
    are `at_least` so many."""
    seen: dict[float, Sight] = {}
    began = time.monotonic()
    while time.monotonic() < began + lasts_s or len(seen) < at_least:
        assert time.monotonic() < began + lasts_s + MOVES_WITHIN_S, f"{len(seen)} different pictures"
        if (now := strip(console, which)) is not None:
            seen.setdefault(round(now.rendered_ms), now)
        console.page.wait_for_timeout(20)
    return list(seen.values())
