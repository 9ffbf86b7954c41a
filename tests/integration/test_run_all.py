"""What `make test` does with tests that fail beside others: one more try, alone, and the words of the first failure."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Final

TESTS: Final = Path(__file__).resolve().parents[1]
WITHIN_S: Final = 120.0
PASSES_ALONE: Final = """
from pathlib import Path
import pytest

@pytest.mark.parametrize("number", range({tests}), ids=lambda number: f"a/b::{{number}}")
def test_shy(number: int) -> None:
    seen = Path(__file__).with_suffix(f".{{number}}")
    is_first = not seen.exists()
    seen.touch()
    assert not is_first, "somebody looks"
"""


def run_all(folder: Path) -> tuple[int, str]:
    (folder / "pytest.ini").write_text("[pytest]\nmarkers = long\n")
    # An option of our conftest.
    (folder / "conftest.py").write_text("def pytest_addoption(parser): parser.addoption('--costs')\n")
    (folder / "test_good.py").write_text("def test_good() -> None: pass\n")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    # Other plugins take seconds to load, in each of the processes.
    environment |= {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": "-p xdist.plugin", "TEST_WORKERS": "2"}
    done = subprocess.run(
        [sys.executable, str(TESTS / "run_all.py")],
        cwd=folder, env=environment, capture_output=True, text=True, timeout=WITHIN_S,
        check=False,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def test_what_passes_alone_fails_nothing_and_is_named_with_its_first_failure(tmp_path: Path) -> None:
    (tmp_path / "test_shy.py").write_text(PASSES_ALONE.format(tests=8))
    status, said = run_all(tmp_path)
    assert status == 0, said
    for number in range(8):
        name = re.escape(f"test_shy.py::test_shy[a/b::{number}]")
        assert re.search(rf"^{name} failed beside other tests:(\n    .*)*AssertionError: somebody looks", said, re.M), (
            said
        )
    assert "These pass only alone. Find the reason:" in said


def test_a_second_failure_fails_the_run(tmp_path: Path) -> None:
    (tmp_path / "test_shy.py").write_text(PASSES_ALONE.format(tests=1))
    (tmp_path / "test_bad.py").write_text("def test_bad() -> None: assert False, 'always'\n")
    status, said = run_all(tmp_path)
    assert status == 1, said
    assert re.search(r"1 failed, 1 passed", said), said
    assert "test_shy.py::test_shy[a/b::0] failed beside other tests:" in said
    assert "test_bad.py::test_bad failed beside other tests:" not in said
    assert "These pass only alone" not in said


def test_more_than_eight_failures_get_no_second_try(tmp_path: Path) -> None:
    (tmp_path / "test_shy.py").write_text(PASSES_ALONE.format(tests=9))
    status, said = run_all(tmp_path)
    assert status == 1, said
    assert "Once more, alone" not in said
