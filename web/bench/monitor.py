"""What the Monitor costs a browser with many drones: `npm run bench` (after `npm run build`).

It prints how busy the main thread is, how long a frame takes, and what one update of one drone costs, everything
included: decoding, the list, the map. The browser is Debian's Chromium, headless, drawing in software unless
--gpu says otherwise.

    python monitor.py [--drones N] [--rate HZ] [--seconds S] [--json FILE] [--gpu]
"""

import argparse
import itertools
import json
import shutil
import socket
import statistics
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, CDPSession, sync_playwright

SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader"]
QUIET = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
SETTLE_S = 6.0
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


def measure(browser: Browser, address: str, *, drones: int, rate_hz: float, seconds: float) -> list[dict[str, Any]]:
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.goto(address)
    page.get_by_test_id("squad-row").first.wait_for(timeout=60_000)
    page.wait_for_timeout(SETTLE_S * 1000)
    transferred = page.evaluate(
        "() => performance.getEntriesByType('resource').reduce((sum, one) => sum + one.decodedBodySize, 0)"
    )
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    before = counters(session)
    times = page.evaluate(FRAMES % int(seconds * 1000))
    after = counters(session)
    spent = {name: after[name] - before[name] for name in before}
    elapsed_s = spent["Timestamp"]
    gaps = [later - earlier for earlier, later in itertools.pairwise(times)]
    updates = drones * rate_hz * elapsed_s
    return [
        {"metric": "main thread busy", "value": 100 * spent["TaskDuration"] / elapsed_s, "unit": "%"},
        {"metric": "of it, script", "value": 100 * spent["ScriptDuration"] / elapsed_s, "unit": "%"},
        {
            "metric": "of it, style and layout",
            "value": 100 * (spent["LayoutDuration"] + spent["RecalcStyleDuration"]) / elapsed_s,
            "unit": "%",
        },
        {"metric": "frame, median", "value": statistics.median(gaps), "unit": "ms"},
        {"metric": "frame, 95th percentile", "value": statistics.quantiles(gaps, n=20)[-1], "unit": "ms"},
        {"metric": "one update of one drone", "value": 1e6 * spent["TaskDuration"] / updates, "unit": "us"},
        {"metric": "loaded, not compressed", "value": transferred / 1024, "unit": "KiB"},
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description="What the Monitor costs a browser with many drones.")
    parser.add_argument("--drones", type=int, default=200)
    parser.add_argument("--rate", type=float, default=5.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--gpu", action="store_true", help="let the browser use the machine's own graphics")
    options = parser.parse_args()
    port = free_port()
    crowd = Path(__file__).with_name("crowd.py")
    server = subprocess.Popen([sys.executable, str(crowd), str(port), str(options.drones), str(options.rate)])
    try:
        address = f"http://127.0.0.1:{port}/"
        wait_for(address)
        with sync_playwright() as playwright:
            path = shutil.which("chromium") or shutil.which("google-chrome")
            browser = playwright.chromium.launch(
                executable_path=path, args=[*QUIET, *([] if options.gpu else SOFTWARE)]
            )
            rows = measure(browser, address, drones=options.drones, rate_hz=options.rate, seconds=options.seconds)
            browser.close()
    finally:
        server.terminate()
        server.wait()
    drawing = "graphics card" if options.gpu else "software rendering"
    print(f"{options.drones} drones at {options.rate:g} Hz on the Monitor, {options.seconds:g} s, {drawing}")
    for row in rows:
        print(f"  {row['metric']:<26}{row['value']:>10.1f} {row['unit']}")
    if options.json:
        case = f"{options.drones} drones at {options.rate:g} Hz, {drawing}"
        found = [{"case": case, "system": "ours", **row} for row in rows]
        options.json.write_text(json.dumps({"bench": "console", "rows": found}, indent=2) + "\n")


if __name__ == "__main__":
    main()
