"""What the Monitor costs a browser with many drones: `npm run bench` (after `npm run build`).

It prints how busy the main thread is, how long a frame takes, and what one update of one drone costs, everything
included: decoding, the list, the map. The browser is Debian's Chromium, headless. It draws

- `software`: as on a machine without a graphics card: pages by the browser's own painter, WebGL by an emulated card;
- `emulated`: everything by an emulated card, pages as well, which no browser does by itself: the worst case;
- `card`: by the machine's own graphics card.

    python monitor.py [--drones N] [--rate HZ] [--seconds S] [--drawing software|emulated|card] [--maps FOLDER]
                      [--json FILE]
"""

import argparse
import itertools
import json
import os
import platform
import shutil
import socket
import statistics
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import NamedTuple

from playwright.sync_api import Browser, CDPSession, Page, sync_playwright

DRAWING = {
    "software": ["--disable-gpu", "--enable-unsafe-swiftshader"],
    "emulated": ["--use-gl=angle", "--use-angle=swiftshader"],
    "card": [],
}
QUIET = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# A hand that drags the map to and fro, with each frame of the screen.
DRAGGING = """() => {
  const map = document.querySelector('.maplibregl-canvas');
  const { left, top, width, height } = map.getBoundingClientRect();
  const at = (type, dx, on) => on.dispatchEvent(new MouseEvent(type, {
    bubbles: true, cancelable: true, view: window, button: 0, buttons: type === 'mouseup' ? 0 : 1,
    clientX: left + width / 2 + dx, clientY: top + height / 2,
  }));
  at('mousedown', 0, map);
  const begun = performance.now();
  const drag = (now) => {
    at('mousemove', Math.round(80 * Math.sin((now - begun) / 400)), document);
    requestAnimationFrame(drag);
  };
  requestAnimationFrame(drag);
}"""
SETTLE_S = 6.0
LONG_FRAME_MS = 50.0
FRAMES = """() => new Promise((resolve) => {
  const times = [];
  const until = performance.now() + %d;
  const next = (now) => {
    times.push(now);
    if (now < until) requestAnimationFrame(next);
    else resolve(times);
  };
  requestAnimationFrame(next);
})"""


class Row(NamedTuple):
    """One figure."""

    metric: str
    value: float
    unit: str


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(address: str) -> None:
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        try:
            urllib.request.urlopen(address, timeout=1).close()
        except OSError:
            time.sleep(0.1)
        else:
            return
    raise SystemExit("the crowd does not answer")


def counters(session: CDPSession) -> dict[str, float]:
    return {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}


def opened(browser: Browser, address: str) -> Page:
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.goto(address)
    page.get_by_test_id("squad-row").first.wait_for(timeout=60_000)
    page.wait_for_timeout(SETTLE_S * 1000)
    return page


def measure(page: Page, *, updates_hz: float, seconds: float) -> list[Row]:
    """What the page costs for so many seconds, while so many updates of single drones come each second."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    before = counters(session)
    times = page.evaluate(FRAMES % int(seconds * 1000))
    after = counters(session)
    session.detach()
    spent = {name: after[name] - before[name] for name in before}
    elapsed_s = spent["Timestamp"]
    gaps = [later - earlier for earlier, later in itertools.pairwise(times)]
    return [
        Row("main thread busy", 100 * spent["TaskDuration"] / elapsed_s, "%"),
        Row("of it, script", 100 * spent["ScriptDuration"] / elapsed_s, "%"),
        Row("of it, style and layout", 100 * (spent["LayoutDuration"] + spent["RecalcStyleDuration"]) / elapsed_s, "%"),
        Row("frame, median", statistics.median(gaps), "ms"),
        Row("frame, 95th percentile", statistics.quantiles(gaps, n=20)[-1], "ms"),
        Row("frame, longest", max(gaps), "ms"),
        Row(f"frames beyond {LONG_FRAME_MS:g} ms", 100 * sum(gap > LONG_FRAME_MS for gap in gaps) / len(gaps), "%"),
        Row("one update of one drone", 1e6 * spent["TaskDuration"] / (updates_hz * elapsed_s), "us"),
    ]


def measure_all(page: Page, *, updates_hz: float, seconds: float) -> dict[str, list[Row]]:
    """With the list as cards, as a table, and while somebody drags the map about."""
    found = {"cards": measure(page, updates_hz=updates_hz, seconds=seconds)}
    page.get_by_test_id("squad-view").get_by_text("Table").click()
    page.wait_for_timeout(1000)
    found["table"] = measure(page, updates_hz=updates_hz, seconds=seconds)
    page.get_by_test_id("squad-view").get_by_text("Cards").click()
    page.wait_for_timeout(1000)
    page.evaluate(DRAGGING)
    found["cards, map dragged"] = measure(page, updates_hz=updates_hz, seconds=seconds)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description="What the Monitor costs a browser with many drones.")
    parser.add_argument("--drones", type=int, default=200)
    parser.add_argument("--rate", type=float, default=5.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--maps", type=Path, help="folder of the simulated land's map files (see crowd.py)")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--drawing", choices=DRAWING, default="software", help="who draws (see above)")
    options = parser.parse_args()
    port = free_port()
    crowd = Path(__file__).with_name("crowd.py")
    maps = [str(options.maps)] if options.maps else []
    server = subprocess.Popen([sys.executable, str(crowd), str(port), str(options.drones), str(options.rate), *maps])
    try:
        address = f"http://127.0.0.1:{port}/"
        wait_for(address)
        with sync_playwright() as playwright:
            path = shutil.which("chromium") or shutil.which("google-chrome")
            browser = playwright.chromium.launch(executable_path=path, args=[*QUIET, *DRAWING[options.drawing]])
            page = opened(browser, address)
            found = measure_all(page, updates_hz=options.drones * options.rate, seconds=options.seconds)
            browser.close()
    finally:
        server.terminate()
        server.wait()
    title = f"{options.drones} drones at {options.rate:g} Hz on the Monitor, drawn by {options.drawing}"
    title += ", imagery and names" if options.maps else ""
    print(f"{title}, {options.seconds:g} s each")
    print(f"  {'':<26}" + "".join(f"{case:>20}" for case in found))
    for at, (metric, _, unit) in enumerate(found["cards"]):
        figures = "".join(f"{rows[at].value:>17.1f} {unit:<2}" for rows in found.values())
        print(f"  {metric:<26}{figures}")
    if options.json:
        rows = [
            {"case": f"{title}, {case}", "system": "ours", **row._asdict()}
            for case, rows in found.items()
            for row in rows
        ]
        machine = {"platform": platform.platform(), "cores": os.cpu_count(), "load": os.getloadavg()[0]}
        options.json.write_text(json.dumps({"bench": "console", "machine": machine, "rows": rows}, indent=2) + "\n")


if __name__ == "__main__":
    main()
