"""`python -m bench relay --quick`: keeps the benchmark working. Its results on a busy machine are not asserted."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long("shows only that a benchmark still runs")

CHECKOUT = Path(__file__).resolve().parents[2]
MAX_DURATION_S = 600


def test_a_short_run_measures_ours_beside_the_floors_and_every_frame_and_stick_arrives(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    done = subprocess.run(
        [sys.executable, "-m", "bench", "relay", "--quick", "--json", str(out)],
        capture_output=True,
        text=True,
        cwd=CHECKOUT,
        timeout=MAX_DURATION_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    rows = json.loads(out.read_text())["rows"]
    found = {(row["system"], row["metric"]) for row in rows}
    for system in ("ours", "forwarder, uvloop UDP to WebSocket", "forwarder, websockets.broadcast"):
        assert {(system, "cpu_per_frame"), (system, "latency_n"), (system, "memory")} <= found, done.stdout
    for row in rows:
        if row["system"] == "ours" and row["metric"] in ("not_arrived", "lost"):
            assert row["value"] == 0, row
    (sticks,) = [row for row in rows if row["case"].startswith("sticks") and row["metric"] == "latency_n"]
    assert sticks["value"] == 50
