"""`python -m bench control` on loopback, as short as possible: keeps the benchmark working."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long("shows only that a benchmark still runs")

CHECKOUT = Path(__file__).resolve().parents[2]
MAX_DURATION_S = 400


def test_a_short_run_measures_take_and_give_and_no_old_frame_passes(tmp_path: Path) -> None:
    only = ("--loopback", "--flavour", "ardupilot", "--radio", "with", "--case", "take and give", "--rounds", "2")
    out = tmp_path / "out.json"
    done = subprocess.run(
        [sys.executable, "-m", "bench", "control", *only, "--json", str(out)],
        capture_output=True,
        text=True,
        cwd=CHECKOUT,
        timeout=MAX_DURATION_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    rows = json.loads(out.read_text())["rows"]
    found = {(row["case"].split(",")[0], row["metric"]): row["value"] for row in rows}
    assert not [row for row in rows if row["metric"] in ("failed", "given_up")], done.stdout
    for verb in ("take", "give", "accept"):
        assert found[verb, "request_to_confirmed_n"] == 2
        assert 0 < found[verb, "request_to_confirmed_p50"] < 5000
        assert found[verb, "old_holders_frames_after_hold_began"] == 0
