"""What `make test` and `make test-long` run: a tier, a few tests at a time, and the few that failed once more, alone.

Tests share the machine. A test that fails beside others and passes alone does not fail the run, but it is a defect all
the same, of the test or of what it tests: the run names it at the end, with the last lines of its failure. More than
`MAX_SECOND_TRIES` failures are no coincidence, and get no second try.

`--long` adds what the short tier leaves out (README.md beside this file) and tries more examples. A long run of a clean
checkout that passes leaves a stamp, without which `make release` releases nothing.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "deploy"))

from packages.long_stamp import write_stamp

MAX_SECOND_TRIES: Final = 8
TESTS_FAILED: Final = 1
"""pytest's exit status when tests ran and some failed; 2 and up are errors of the run itself."""
LAST_LINES: Final = 15
"""How much of a failure is printed again at the end: the assertion, and what led to it."""

LAST_FAILED: Final = Path(".pytest_cache/v/cache/lastfailed")
FIRST_TRY: Final = Path(".pytest_cache/first_try.xml")
COSTS: Final = Path(".pytest_cache/costs.json")


def run(*options: str) -> int:
    """Run pytest with these options; its exit status."""
    return subprocess.run([sys.executable, "-m", "pytest", *options], check=False).returncode


def failed_tests() -> list[str]:
    """The tests that failed in the last run."""
    return sorted(json.loads(LAST_FAILED.read_text())) if LAST_FAILED.exists() else []


def failures_of_first_try() -> dict[str, str]:
    """The failures of the first run, by the address that pytest's report has for a test."""
    found: dict[str, str] = {}
    for case in ElementTree.parse(FIRST_TRY).iter("testcase") if FIRST_TRY.exists() else ():
        for failure in (*case.findall("failure"), *case.findall("error")):
            found[f"{case.get('classname')}.{case.get('name')}"] = failure.text or failure.get("message") or ""
    return found


def address_of(test: str) -> str:
    """`tests/unit/test_it.py::test_that[a/b]` as the report writes it: `tests.unit.test_it.test_that[a/b]`."""
    place, bracket, parameters = test.partition("[")
    module, *names = place.split("::")
    return ".".join([module.removesuffix(".py").replace("/", "."), *names]) + bracket + parameters


def print_failures(tests: list[str]) -> None:
    """Print why each of these failed in the first run."""
    failures = failures_of_first_try()
    for test in tests:
        lines = failures.get(address_of(test), "(the report has no words of it)").strip().splitlines()
        print(f"\n{test} failed beside other tests:", *lines[-LAST_LINES:], sep="\n    ", flush=True)


def run_tier(*options: str) -> int:
    """Run a tier; its exit status."""
    workers = os.environ.get("TEST_WORKERS", "4")
    for leftover in (LAST_FAILED, FIRST_TRY):
        leftover.unlink(missing_ok=True)
    status = run(*options, "-n", workers, f"--costs={COSTS}", f"--junit-xml={FIRST_TRY}")
    failed = failed_tests()
    if status != TESTS_FAILED or not 0 < len(failed) <= MAX_SECOND_TRIES or not all("::" in one for one in failed):
        return status  # a name without "::" is no test: workers that disagree on what there is to run, for example
    print(f"\n{len(failed)} failed beside other tests. Once more, alone:", *failed, sep="\n  ", flush=True)
    status = run(*options, "--last-failed", "--last-failed-no-failures=none")
    still = failed_tests()
    print_failures([test for test in failed if test not in still])
    if status == 0:
        print("\nThese pass only alone. Find the reason:", *failed, sep="\n  ", flush=True)
    return status


def main() -> int:
    """Run the tests; the exit status for `make`."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--long", action="store_true", help="everything, and more examples")
    if not parser.parse_args().long:
        return run_tier("-m", "not long")
    status = run_tier("--hypothesis-profile=long")
    if status == 0:
        print(write_stamp(), flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main())
