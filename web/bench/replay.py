"""What the replay of a long flight costs a browser: `npm run bench:replay` (after `npm run build`).

It writes a flight of an hour with some 50 frames a second beside a real tower, opens it in Debian's Chromium, and
prints how long that takes, how many pictures a second a hand on the timeline sees, and the memory of the page's
process. The tower and the browser share the machine; without a graphics card the map is painted by the processor.

    python replay.py [--minutes M] [--hz HZ] [--seconds S] [--json FILE]
"""

import argparse
import json
import os
import platform
import shutil
import statistics
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "e2e"), str(ROOT)]

from console_page import FLAGS, TOURED, ConsolePage  # noqa: E402
from worlds.flight_files import write_flight  # noqa: E402
from worlds.processes import World  # noqa: E402

# A hand that moves to and fro over the whole flight, with each frame of the screen; returns how long each took, and how
# often another moment was on view.
SCRUB = """([seconds]) => new Promise((done) => {
  const scrub = document.querySelector('[data-testid="scrub"]');
  const shown = document.querySelector('[data-testid="replay-time"]');
  const begun = performance.now();
  const gaps = [];
  let last = begun;
  let moment = shown.dataset.ms;
  let moments = 0;
  const move = (now) => {
    gaps.push(now - last);
    last = now;
    if (shown.dataset.ms !== moment) { moments += 1; moment = shown.dataset.ms; }
    if (now - begun > seconds * 1000) { done({ gaps: gaps.slice(1), moments, lasted: now - begun }); return; }
    const way = (1 - Math.cos((now - begun) / 1500)) / 2;
    scrub.value = String(way * Number(scrub.max));
    scrub.dispatchEvent(new Event('input', { bubbles: true }));
    requestAnimationFrame(move);
  };
  requestAnimationFrame(move);
})"""
OPENED = """() => document.querySelector('[data-testid="replay"]')?.dataset.whole === 'true'
  && document.querySelector('[data-testid="flight-display"]')?.dataset.roll !== ''"""


def renderer_bytes(browser: Browser) -> int:
    """Of the page's process with its workers: what belongs to it alone."""
    session = browser.new_browser_cdp_session()
    processes = session.send("SystemInfo.getProcessInfo")["processInfo"]
    session.detach()
    return max(private_bytes(one["id"]) for one in processes if one["type"] == "renderer")


def private_bytes(pid: int) -> int:
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) * 1024 for line in lines if line.startswith(("Private_Clean", "Private_Dirty")))


def measure(page: Page, console: ConsolePage, browser: Browser, seconds: float) -> dict[str, float]:
    expect(console.part("flight-replay")).to_be_visible()
    before = renderer_bytes(browser)
    begun = time.monotonic()
    page.evaluate("() => { window.location.hash = '#/flights/1'; }")
    page.wait_for_function(OPENED, polling=20)
    opened_s = time.monotonic() - begun
    page.wait_for_timeout(3000)
    scrubbed: dict[str, Any] = page.evaluate(SCRUB, [seconds])
    after = renderer_bytes(browser)
    gaps = sorted(scrubbed["gaps"])
    return {
        "frames": float(console.part("replay").get_attribute("data-frames") or 0),
        "opened_s": opened_s,
        "pictures_per_s": 1000 * len(gaps) / scrubbed["lasted"],
        "moments_per_s": 1000 * scrubbed["moments"] / scrubbed["lasted"],
        "frame_p50_ms": statistics.median(gaps),
        "frame_p95_ms": gaps[int(len(gaps) * 0.95)],
        "memory_before_mb": before / 1e6,
        "memory_mb": after / 1e6,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--hz", type=int, default=10, help="of attitude and position; ten make 50 frames a second")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, World(Path(folder)) as world:
        world.add_user("alice")
        world.add_user("admin", "admin")
        world.add_drone("Kestrel", "alice")
        people = {"drone": "Kestrel", "pilot": "alice", "admin": "admin"}
        place = Path(folder) / "files" / "flights"
        lasts_s = asked.minutes * 60
        write_flight(place, drone_id=1, began_at=datetime.now(UTC), lasts_s=lasts_s, hz=asked.hz, **people)
        world.start_tower()
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
            page = browser.new_context(viewport={"width": 1440, "height": 900}).new_page()
            page.add_init_script(TOURED)
            console = ConsolePage(page, world.address)
            console.open()
            console.sign_in("alice")
            expect(console.part("squad-row").first).to_be_visible(timeout=20_000)
            console.open("/#/flights")
            found = measure(page, console, browser, asked.seconds)
            browser.close()
    case = f"{asked.minutes:g} minutes, {found['frames']:.0f} frames"
    print(f"replay: {case}")
    for name, value in found.items():
        print(f"  {name:<18} {value:>10.2f}")
    if asked.json:
        rows = [
            {"case": case, "system": "ours", "metric": name, "value": value, "unit": name.rpartition("_")[2]}
            for name, value in found.items()
        ]
        machine = {"system": platform.platform(), "processors": os.cpu_count()}
        asked.json.write_text(json.dumps({"bench": "replay", "machine": machine, "rows": rows}, indent=2) + "\n")


if __name__ == "__main__":
    main()
