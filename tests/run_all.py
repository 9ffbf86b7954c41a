"""What `make test` runs: every test, a few at a time, and the few that failed once more, alone.

Tests share the machine, and some assert how long a thing takes. A test that fails beside others and passes alone
does not fail the run, but it is a defect all the same, of the test or of what it tests: the run names it at the end.
More than `MAX_SECOND_TRIES` failures are no coincidence, and get no second try.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Final

MAX_SECOND_TRIES: Final = 5
TESTS_FAILED: Final = 1
"""pytest's exit status when tests ran and some failed; 2 and up are errors of the run itself."""

LAST_FAILED: Final = Path(".pytest_cache/v/cache/lastfailed")


def run(*options: str) -> int:
    """Run pytest with these options; its exit status."""
    return subprocess.run([sys.executable, "-m", "pytest", *options], check=False).returncode


def failed_tests() -> list[str]:
    """The tests that failed in the last run."""
    return sorted(json.loads(LAST_FAILED.read_text())) if LAST_FAILED.exists() else []


def main() -> int:
    """Run all tests; the exit status for `make`."""
    workers = os.environ.get("TEST_WORKERS", "3")
    LAST_FAILED.unlink(missing_ok=True)
    status = run("-n", workers, "--durations=40", "--durations-min=10")
    failed = failed_tests()
    if status != TESTS_FAILED or not 0 < len(failed) <= MAX_SECOND_TRIES or not all("::" in one for one in failed):
        return status  # a name without "::" is no test: workers that disagree on what there is to run, for example
    print(f"\n{len(failed)} failed beside other tests. Once more, alone:", *failed, sep="\n  ", flush=True)
    status = run("--last-failed", "--last-failed-no-failures=none")
    if status == 0:
        print("\nThese pass only alone. Find the reason:", *failed, sep="\n  ", flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main())
