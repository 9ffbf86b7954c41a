"""Checks every pinned package against the public lists of known vulnerabilities: `make audit`.

Fatal: any finding in the packages of the tower or the agent (pip-audit reports no severity), and a finding of high
severity in the console's packages. Not fatal: lists that do not answer, or do not know a package. That is reported, and
does not count as "none". Importing this module needs no network: the two readers are plain functions.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parent.parent
PIP_AUDIT: Final = "pip-audit==2.10.1"
WITHIN_S: Final = 150.0
FATAL_IN_CONSOLE: Final = ("high", "critical")


@dataclass(frozen=True)
class Found:
    """`weak`: the findings, for people. `unknown`: the number of packages that no list knows, None: the list did not
    answer."""

    weak: tuple[str, ...]
    unknown: int | None
    asked: int = 0


def read_pip_audit(text: str) -> Found:
    """Reads the output of `pip-audit --format json`."""
    try:
        packages: list[dict[str, Any]] = json.loads(text)["dependencies"]
    except (ValueError, KeyError, TypeError):
        return Found((), None)
    weak = tuple(
        f"{one['name']} {one['version']}: {weakness['id']} (fixed in {', '.join(weakness['fix_versions']) or 'none'})"
        for one in packages
        for weakness in one.get("vulns", ())
    )
    return Found(weak, sum("skip_reason" in one for one in packages), len(packages))


def read_npm_audit(text: str) -> Found:
    """Reads the output of `npm audit --json`."""
    try:
        told: dict[str, Any] = json.loads(text)
        counts, packages = told["metadata"]["vulnerabilities"], told["vulnerabilities"]
        asked = int(told["metadata"]["dependencies"]["total"])
    except (ValueError, KeyError, TypeError):
        return Found((), None)
    weak = tuple(
        f"{name}: {one['severity']} ({one['range']})"
        for name, one in packages.items()
        if one["severity"] in FATAL_IN_CONSOLE
    )
    assert len(weak) <= sum(counts.values())
    return Found(weak, 0, asked)


def say(what: str, found: Found) -> bool:
    """Prints the findings; returns whether none is fatal."""
    for one in found.weak:
        print(f"{what}: KNOWN WEAKNESS: {one}")
    if found.unknown is None:
        print(f"{what}: the list of known weaknesses does not answer here; nothing was checked")
    elif found.unknown:
        print(f"{what}: {found.unknown} of {found.asked} packages were NOT checked: the list did not know them")
    elif not found.weak:
        print(f"{what}: {found.asked} packages, no known weakness")
    return not found.weak


def _output_of(command: Sequence[str], folder: Path) -> str:
    """Returns the output, whatever the exit status; empty if the command does not end in time."""
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=WITHIN_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout


def _pip_audit() -> str:
    tools = ROOT / ".venv" / "audit"
    program = tools / "bin" / "pip-audit"
    if not program.exists():
        _output_of((sys.executable, "-m", "venv", str(tools)), ROOT)
        _output_of((str(tools / "bin" / "pip"), "-q", "--disable-pip-version-check", "install", PIP_AUDIT), ROOT)
    listed = ("--require-hashes", "--disable-pip", "-r", "requirements/run.txt")
    return _output_of((str(program), *listed, "--format", "json", "--progress-spinner", "off"), ROOT)


def main() -> int:
    python = say("Python", read_pip_audit(_pip_audit()))
    # All kinds of dependencies, because each of them can contribute to the console's pages.
    console = say("Console", read_npm_audit(_output_of(("npm", "audit", "--json"), ROOT / "web")))
    return 0 if python and console else 1


if __name__ == "__main__":
    raise SystemExit(main())
