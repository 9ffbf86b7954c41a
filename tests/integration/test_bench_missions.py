"""`python -m bench missions --quick`: keeps the benchmark working, with wide limits for a busy machine."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from bench.namespaces import why_not
from bench.peers.mavsdk_server import SERVER

pytestmark = pytest.mark.long("shows only that a benchmark still runs")

CHECKOUT = Path(__file__).resolve().parents[2]
MAX_DURATION_S = 400
LINE = ", 20 items, 300 ms RTT, 2.5 % lost each way"


def test_a_short_run_flies_ours_and_mavsdk_over_the_same_line(tmp_path: Path, missing: Callable[[str], None]) -> None:
    reason = why_not()
    if reason is not None:
        missing(reason)
    if not (Path(sys.prefix) / "stock-clients" / SERVER).exists():
        missing("MAVSDK (deploy/install_test_parts.sh)")
    out = tmp_path / "out.json"
    done = subprocess.run(
        [sys.executable, "-m", "bench", "missions", "--quick", "--network", "--json", str(out)],
        capture_output=True,
        text=True,
        cwd=CHECKOUT,
        timeout=MAX_DURATION_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    rows = json.loads(out.read_text())["rows"]
    found = {(row["case"].removesuffix(LINE), row["system"], row["metric"]): row["value"] for row in rows}
    assert not [row for row in rows if row["metric"] == "failed" and row["value"]], done.stdout
    for whose in ("", ", person behind a line too"):
        assert found[f"upload and verify{whose}", "ours", "took_n"] == 1
        assert found[f"all parameters{whose}", "ours", "values"] == 1390
    assert found["all parameters", "MAVSDK", "values"] == 1390
    # Twenty items each way take MAVSDK at least 40 round trips on any machine.
    assert found["upload and verify", "MAVSDK", "took_p50"] > 40 * 0.3
    assert found["upload and verify", "ours", "took_p50"] < found["upload and verify", "MAVSDK", "took_p50"]
    # The emulated line is in between and loses packets.
    assert found["TCP handshake of drone and tower", "ours", "took_p50"] > 0.299
    carried, lost = ("packets from the drone, a round", "of these lost")
    assert 0 < found["upload and verify", "MAVSDK", lost] < found["upload and verify", "MAVSDK", carried] / 5
