"""A worker of the tests that ends: its other tests run in the next one, and the run ends."""

import os
import re
import subprocess
import sys
from pathlib import Path

WITHIN_S = 60.0
CONFTEST = """
import sys
sys.path.insert(0, {tests!r})
from worlds.side_by_side import Groups

def pytest_xdist_make_scheduler(config, log):
    return Groups(config, log)
"""


def test_a_worker_that_ends_late_takes_no_other_test_with_it(tmp_path: Path) -> None:
    tests = Path(__file__).resolve().parents[1]
    (tmp_path / "conftest.py").write_text(CONFTEST.format(tests=str(tests)))
    for number in range(6):
        (tmp_path / f"test_quick_{number}.py").write_text("def test_quick() -> None: pass\n")
    ends = "import os, time\ndef test_that_ends_it() -> None:\n    time.sleep(1)\n    os._exit(3)\n"
    (tmp_path / "test_the_last.py").write_text(ends + "def test_after() -> None: pass\n")
    (tmp_path / "test_the_last_of_all.py").write_text("def test_alone() -> None: pass\n")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "no:cacheprovider", "--rootdir", str(tmp_path)],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=WITHIN_S, check=False,
    )  # fmt: skip
    assert done.returncode == 1, done.stdout + done.stderr
    assert re.search(r"1 failed, 8 passed", done.stdout), done.stdout
    assert "crashed while running 'test_the_last.py::test_that_ends_it'" in done.stdout
