"""What `make check` says about the structure: circles of imports, and files that are too long.

    python deploy/check_structure.py

Imports count wherever they stand, also below `TYPE_CHECKING` and in functions: a circle is a circle for the reader.
Exit status 1 where a file has more than `MAX_LINES` lines or a circle has more files than `KNOWN_CIRCLES` allows. The
allowances only ever shrink: remove what is no longer needed.
"""

import ast
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

MAX_LINES: Final = 400
PACKAGES: Final = ("server", "onboard_agent", "connect", "wire", "simulator")

LONG_FILES: Final[Mapping[str, int]] = {
    "server/live/operations/service.py": 402,
    "server/live/hub.py": 496,
    "tests/integration/test_agent_cameras.py": 458,
    "tests/integration/test_drone_identity.py": 643,
    "tests/integration/test_server_passkeys.py": 465,
    "tests/integration/test_server_recordings.py": 585,
    "tests/integration/test_server_teams.py": 425,
    "tests/integration/test_server_video.py": 404,
    "tests/model/plan_world.py": 447,
    "tests/unit/onboard_agent/test_agent_onboard.py": 580,
    "tests/unit/onboard_agent/test_open_hold_flown.py": 608,
    "tests/unit/onboard_agent/transactions/test_metadata.py": 448,
    "tests/unit/onboard_agent/transactions/test_parameter_reading.py": 573,
    "tests/unit/onboard_agent/transactions/test_plan_watch.py": 557,
    "tests/unit/server/test_operation_service.py": 540,
    "tests/unit/server/test_relay_safety.py": 609,
    "tests/unit/server/test_relay_video.py": 432,
    "tests/unit/simulator/test_simulator_measured_facts.py": 717,
    "tests/unit/simulator/test_simulator_missions.py": 469,
    "web/src/link/tower.ts": 429,
    "web/src/pages/Missions.svelte": 469,
    "web/src/parts/missions/DroneStrip.svelte": 477,
    "web/src/parts/missions/ItemTable.svelte": 427,
    "web/test/link/tower.test.ts": 464,
    "web/test/plan/old_formats.test.ts": 421,
}
"""Files that are longer than `MAX_LINES`, and how long they may be."""

KNOWN_CIRCLES: Final[Mapping[str, Sequence[int]]] = {"simulator": (18,)}
"""For each package, the sizes of its circles in files, largest first."""


def modules_of(package: str) -> dict[str, Path]:
    """Names and files of all modules of a package."""
    found = {}
    for path in sorted(Path(package).rglob("*.py")):
        parts = path.with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports_of(path: Path, modules: Mapping[str, Path]) -> Iterator[str]:
    """The modules among these that a file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                below = f"{node.module}.{alias.name}"
                if below in modules:
                    yield below
                elif node.module in modules:
                    yield node.module


def circles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Strongly connected components of more than one module, largest first (Tarjan, without recursion)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []
    for start in sorted(graph):
        if start in index:
            continue
        work: list[tuple[str, Iterator[str]]] = [(start, iter(sorted(graph[start])))]
        index[start] = low[start] = len(index)
        stack.append(start)
        while work:
            node, targets = work[-1]
            target = next(targets, None)
            if target is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    at = stack.index(node)
                    component, stack[at:] = stack[at:], []
                    if len(component) > 1:
                        found.append(sorted(component))
            elif target not in index:
                index[target] = low[target] = len(index)
                stack.append(target)
                work.append((target, iter(sorted(graph[target]))))
            elif target in stack:
                low[node] = min(low[node], index[target])
    return sorted(found, key=len, reverse=True)


def source_files() -> list[Path]:
    """All Python, TypeScript and Svelte files under version control that people write."""
    names = subprocess.run(["git", "ls-files", "*.py", "*.ts", "*.svelte"], capture_output=True, text=True, check=True)
    return [path for path in map(Path, names.stdout.splitlines()) if path.exists() and "generated" not in path.parts]


def main() -> int:
    """Print what there is; the exit status."""
    wrong = False
    for package in PACKAGES:
        modules = modules_of(package)
        graph = {name: set(imports_of(path, modules)) - {name} for name, path in modules.items()}
        found = circles(graph)
        sizes = [len(circle) for circle in found]
        allowed = list(KNOWN_CIRCLES.get(package, ()))
        print(f"{package}: {len(modules)} files, circles of {sizes or 'none'}")
        if sizes != allowed:
            wrong = True
            print(f"  allowed: {allowed or 'none'}", *(f"  {', '.join(circle)}" for circle in found), sep="\n")
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in source_files()}
    longest = sorted(lengths, key=lambda path: lengths[path], reverse=True)
    print("longest files:", ", ".join(f"{path} {lengths[path]}" for path in longest[:6]))
    for path, lines in lengths.items():
        if lines > LONG_FILES.get(path.as_posix(), MAX_LINES):
            wrong = True
            print(f"  {path}: {lines} lines, {LONG_FILES.get(path.as_posix(), MAX_LINES)} allowed")
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
