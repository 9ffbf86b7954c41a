"""What the first visit costs over a throttled network: `npm run bench:load` (after `npm run build`).

A real tower with a drone of alice's, Debian's Chromium with an empty cache, and the network throttled by the browser
itself: 9 Mbit/s down, 1.5 Mbit/s up, 170 ms before each answer. What the map's worker fetches on its own (the ground)
is counted, and may come unthrottled: it is after what is meaningful.
"""

import argparse
import json
import shutil
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

CHECKOUT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(CHECKOUT / "tests"), str(CHECKOUT / "tests" / "e2e")]

from console_page import FLAGS, ConsolePage  # noqa: E402
from first_load import FOUR_G, FirstLoad, first_load  # noqa: E402
from playwright.sync_api import sync_playwright  # noqa: E402
from worlds.processes import World  # noqa: E402


def rows_of(case: str, loads: list[FirstLoad]) -> list[dict[str, object]]:
    figures = {
        "first contentful paint": (statistics.median(one.contentful_ms for one in loads), "ms"),
        "first meaningful paint": (statistics.median(one.meaningful_ms for one in loads), "ms"),
        "slowest meaningful paint": (max(one.meaningful_ms for one in loads), "ms"),
        "transferred": (max(one.transferred for one in loads) / 1000, "kB"),
        "of it, before the map": (max(map(_before_map, loads)) / 1000, "kB"),
        "of it, the map library": (max(one.transferred_of("create_map") for one in loads) / 1000, "kB"),
    }
    return [
        {"case": case, "system": "ours", "metric": metric, "value": value, "unit": unit}
        for metric, (value, unit) in figures.items()
    ]


def _before_map(load: FirstLoad) -> int:
    return load.transferred - load.transferred_of("create_map") - load.transferred_of("basemap")


def main() -> None:
    parser = argparse.ArgumentParser(description="What the first visit to the console costs over 4G.")
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, World(Path(folder)) as world, sync_playwright() as playwright:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        path = shutil.which("chromium") or shutil.which("google-chrome")
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))

        def load(meaningful: str, signed_in: Any = None) -> list[FirstLoad]:
            return [
                first_load(browser, world.address, f"[data-testid={meaningful}]", signed_in=signed_in, network=FOUR_G)
                for _ in range(options.times)
            ]

        rows = rows_of("sign-in page", load("sign-in-button"))
        context = browser.new_context()
        console = ConsolePage(context.new_page(), world.address)
        console.open()
        console.sign_in("alice")
        console.part("squad-row").wait_for()
        somebody = context.storage_state()
        context.close()
        rows += rows_of("squad, signed in", load("squad-row", somebody))
        browser.close()
    print(f"empty cache, 9 Mbit/s down, 170 ms; median of {options.times}")
    for row in rows:
        print(f"  {row['case']!s:<18}{row['metric']!s:<26}{row['value']:>9.0f} {row['unit']}")
    if options.json:
        options.json.write_text(json.dumps({"bench": "first load", "rows": rows}, indent=2) + "\n")


if __name__ == "__main__":
    main()
