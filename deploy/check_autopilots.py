"""The autopilot check of `make check`: code names an autopilot only in its profile.

    python deploy/check_autopilots.py

Exit status 1 if code of the tower, the agent, the console or the wire names an autopilot outside `wire/autopilots/`,
and `NAMED` has no reason for it. Comments and docstrings may name one: they cite what was measured. The simulator
imitates autopilots, and is not checked.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

PROFILES: Final = "wire/autopilots/"
FOLDERS: Final = ("server", "onboard_agent", "connect", "wire", "web/src")
NAME: Final = re.compile(
    r"ardu(pilot|copter|plane|rover|sub)|(?<![a-z])px4|MAV_AUTOPILOT_(?!INVALID\b)\w+"
    r"|(?-i:(COPTER|PLANE|ROVER|SUB)_MODE)",
    re.IGNORECASE,
)

NAMED: Final[Mapping[str, str]] = {
    "wire/dialect.py": "`ardupilotmega` is the name of the MAVLink dialect",
    "server/control/api/receiver_routes.py": "the description of a field gives the names as examples",
    "server/flights/core/imports/": "reads the log formats of two autopilots, which are their own",
    "web/src/words/flight_words.ts": "the names of those formats",
    "web/src/words/help_words.ts": "the help says which of those files can be opened",
    "web/src/parts/replay/ImportsPanel.svelte": "says which of those files can be uploaded",
    "web/src/parameters/load_facts.ts": "loads the parameter texts of each family from files of their own",
    "web/src/parameters/facts/": "one set of files with the parameter texts of each family",
}
"""A file or folder to the reason why its code names an autopilot. Remove entries that are no longer needed."""


def names_in_python(text: str) -> Iterator[int]:
    """Yields the line of each name and string that names an autopilot, except of docstrings."""
    tree = ast.parse(text)
    docstrings = {
        id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if id(node) in docstrings:
            continue
        words: list[str] = []
        match node:
            case ast.Constant(value=str(value)):
                words = [value]
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name) | ast.keyword(arg=str(name)):
                words = [name]
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                words = [name]
            case ast.ImportFrom(module=module, names=aliases):
                words = [module or "", *(alias.name for alias in aliases)]
            case ast.Import(names=aliases):
                words = [alias.name for alias in aliases]
        if any(NAME.search(word) for word in words):
            yield node.lineno  # type: ignore[attr-defined]


_COMMENT: Final = re.compile(r"/\*.*?\*/|<!--.*?-->|(?<![:'\"])//[^\n]*", re.DOTALL)


def names_in_typescript(text: str) -> Iterator[int]:
    """The same of a TypeScript or Svelte file, except of comments."""
    code = _COMMENT.sub(lambda found: "\n" * found[0].count("\n"), text)
    for number, line in enumerate(code.splitlines(), 1):
        if NAME.search(line):
            yield number


def findings(paths: Iterator[Path] | list[Path]) -> tuple[list[str], set[str]]:
    """Returns what is named without a reason, and the entries of `NAMED` that are in use."""
    found, used = [], set()
    for path in paths:
        name = path.as_posix()
        if name.startswith(PROFILES) or "generated" in path.parts:
            continue
        text = path.read_text(encoding="utf-8")
        lines = sorted(set(names_in_python(text) if path.suffix == ".py" else names_in_typescript(text)))
        entry = next((one for one in NAMED if name == one or (one.endswith("/") and name.startswith(one))), None)
        if lines and entry is not None:
            used.add(entry)
        elif lines:
            found += [f"{name}:{line}" for line in lines]
    return found, used


def main() -> int:
    """Prints the findings; returns the exit status."""
    patterns = [f"{folder}/**/*.{kind}" for folder in FOLDERS for kind in ("py", "ts", "svelte")]
    patterns += [f"{folder}/*.{kind}" for folder in FOLDERS for kind in ("py", "ts", "svelte")]
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *(f":(glob){one}" for one in patterns)],
        capture_output=True,
        text=True,
        check=True,
    )
    found, used = findings([path for path in map(Path, sorted(set(listed.stdout.splitlines()))) if path.exists()])
    unused = sorted(set(NAMED) - used)
    print(f"autopilots: named outside {PROFILES} in {len(used)} places with a reason, {len(found)} without")
    for where in found:
        print(f"  {where}: names an autopilot. Ask its profile, or give the reason in {sys.argv[0]}")
    for entry in unused:
        print(f"  {entry}: names none any more. Remove the entry from {sys.argv[0]}")
    return int(bool(found or unused))


if __name__ == "__main__":
    sys.exit(main())
