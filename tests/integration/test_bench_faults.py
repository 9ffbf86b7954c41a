"""`python -m bench faults --quick`: a tower killed under a drone flown by hand. Its times on a busy machine are not
asserted; whose sticks arrive, and what is kept, is."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from worlds.nats import nats_program
from worlds.postgres import postgres_programs

pytestmark = pytest.mark.long("shows only that a benchmark still runs")

CHECKOUT = Path(__file__).resolve().parents[2]
MAX_DURATION_S = 300


def test_no_sticks_of_two_people_and_nothing_acknowledged_is_lost(
    tmp_path: Path, missing: Callable[[str], None]
) -> None:
    if nats_program() is None or postgres_programs() is None:
        missing("PostgreSQL or NATS (Debian: apt-get install postgresql nats-server)")
    out = tmp_path / "out.json"
    done = subprocess.run(
        [sys.executable, "-m", "bench", "faults", "--quick", "--json", str(out)],
        capture_output=True,
        text=True,
        cwd=CHECKOUT,
        timeout=MAX_DURATION_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    found = {row["metric"]: row["value"] for row in json.loads(out.read_text())["rows"]}
    assert (found["rounds"], found["sticks of two people"], found["acknowledged and lost"]) == (1, 0, 0), found
    assert found["acknowledged"] > 3, found
    assert found["fault to link at another tower_n"] == 1, found
