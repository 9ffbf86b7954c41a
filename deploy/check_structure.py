"""The structure checks of `make check`: circular imports, files that are too long, and long lines of documents.

    python deploy/check_structure.py

Imports count wherever they are, including below `TYPE_CHECKING` and in functions: a circle is a circle for the reader.
Exit status 1 if files import each other in a circle, a file has more than `MAX_LINES` lines, or a line of a document
has more than `MAX_COLUMNS` characters. `LONG_FILES` may only shrink: remove entries that are no longer needed.
"""

import ast
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

MAX_LINES: Final = 600
MAX_COLUMNS: Final = 120
PACKAGES: Final = ("server", "onboard_agent", "connect", "control_tower", "wire", "simulator")

LONG_FILES: Final[Mapping[str, int]] = {}
"""Files longer than `MAX_LINES`, and the length permitted for each."""


def modules_of(package: str) -> dict[str, Path]:
    """Returns names and files of all modules of a package."""
    found = {}
    for path in sorted(Path(package).rglob("*.py")):
        parts = path.with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports_of(path: Path, modules: Mapping[str, Path]) -> Iterator[str]:
    """Yields those of these modules that a file imports."""
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
    """Returns the strongly connected components of more than one module, largest first (Tarjan, without recursion)."""
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


def files_like(*patterns: str) -> list[Path]:
    """Returns all hand-written files of these kinds under version control."""
    names = subprocess.run(["git", "ls-files", *patterns], capture_output=True, text=True, check=True)
    return [path for path in map(Path, names.stdout.splitlines()) if path.exists() and "generated" not in path.parts]


def long_lines(path: Path) -> list[int]:
    """Returns the numbers of all lines of a document that are longer than `MAX_COLUMNS`."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return [number for number, line in enumerate(lines, 1) if len(line) > MAX_COLUMNS]


def main() -> int:
    """Prints the findings; returns the exit status."""
    wrong = False
    for package in PACKAGES:
        modules = modules_of(package)
        graph = {name: set(imports_of(path, modules)) - {name} for name, path in modules.items()}
        found = circles(graph)
        wrong |= bool(found)
        print(f"{package}: {len(modules)} files, circles: {len(found) or 'none'}")
        for circle in found:
            print(f"  {', '.join(circle)}")
    lengths = {
        path: len(path.read_text(encoding="utf-8").splitlines()) for path in files_like("*.py", "*.ts", "*.svelte")
    }
    longest = sorted(lengths, key=lambda path: lengths[path], reverse=True)
    print("longest files:", ", ".join(f"{path} {lengths[path]}" for path in longest[:6]))
    for path, lines in lengths.items():
        if lines > LONG_FILES.get(path.as_posix(), MAX_LINES):
            wrong = True
            print(f"  {path}: {lines} lines, {LONG_FILES.get(path.as_posix(), MAX_LINES)} allowed")
    documents = files_like("*.md")
    print(f"documents: {len(documents)} files of {MAX_COLUMNS} columns")
    for path in documents:
        for number in long_lines(path):
            wrong = True
            print(f"  {path}:{number}: more than {MAX_COLUMNS} characters")
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
