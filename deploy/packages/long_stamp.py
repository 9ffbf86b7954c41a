"""The stamp of a long run of the tests: which content of the checkout passed it, and when."""

from __future__ import annotations

import json
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

CHECKOUT: Final = Path(__file__).resolve().parents[2]
STAMP: Final = Path(".pytest_cache") / "long_tests.json"


class NotTested(Exception):
    """One line: why this checkout counts as not tested."""


def write_stamp(checkout: Path = CHECKOUT) -> str:
    """Writes the stamp, unless there are changes that no commit holds. Returns what it did, in one line."""
    if changed := _git(checkout, "status", "--porcelain"):
        return f"no stamp for a release: {len(changed.splitlines())} files differ from the commit"
    stamp = checkout / STAMP
    stamp.parent.mkdir(exist_ok=True)
    tree = _tree(checkout)
    stamp.write_text(json.dumps({"tree": tree, "at": datetime.now(UTC).isoformat(timespec="seconds")}) + "\n")
    return f"stamped for a release: {tree[:12]}"


def require_stamp(checkout: Path = CHECKOUT) -> str:
    """Returns when the content of this commit passed. Raises NotTested."""
    try:
        stamp = json.loads((checkout / STAMP).read_text())
        tree, at = stamp["tree"], str(stamp["at"])
    except (OSError, ValueError, KeyError, TypeError):
        raise NotTested("the long tests have not passed here: run `make test-long` first") from None
    if tree != _tree(checkout) or _git(checkout, "status", "--porcelain"):
        raise NotTested(f"the checkout has changed since the long tests passed ({at}): run `make test-long` again")
    return at


def _tree(checkout: Path) -> str:
    return _git(checkout, "rev-parse", "HEAD^{tree}")


def _git(checkout: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=checkout, check=True, capture_output=True, text=True).stdout.strip()
