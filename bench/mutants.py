"""Which faults `make test` finds: small changes of the code that keeps flights safe, and the tests that fail for them.

    python -m bench.mutants probe --folder DIR             # one run of the tests says which modules reach which change
    python -m bench.mutants kill --folder DIR [--jobs 2]   # makes one change after the other, and runs those modules
    python -m bench.mutants kill --folder DIR2 --at COMMIT --after DIR    # the survivors, by the tests of before
    python -m bench.mutants table --folder DIR             # how many were killed, by area

The changes are drawn by chance with a fixed seed (`--seed`), the same number from each area: a comparison that is off
by one or turned round, `and` for `or`, a condition that is turned round, another number, a call that is left out.
Whoever changes the tests draws the same ones before and after; nothing is chosen by hand.

Works in a clone of its own below DIR and never in this checkout. `probe` needs as long as the short tier. `kill` starts
with the cheapest modules and ends at the first test that fails, and fails again alone: only a change that survives
costs minutes. With `--after` it needs only the modules that changed since COMMIT, or that are in the short tier no
more: a module that is the same, and let the change live, did so before too.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

CHECKOUT: Final = Path(__file__).resolve().parents[1]
SEED: Final = 38
OF_EACH_AREA: Final = 6
KILLED_WITHIN_S: Final = 900.0
"""A change may also make a test hang."""
FIRST_BATCH_S: Final = 10.0
LAST_BATCH_S: Final = 300.0
NO_TESTS: Final = 5
"""pytest's exit status when a module has no test of the short tier."""
_LONG: Final = "pytest.mark.long"

_HOLD: Final = "onboard_agent/failsafe"
_CONTROL: Final = "server/control/core"
_PLANS: Final = "onboard_agent/transactions"
_AUDIT: Final = "server/audit/store"
_ALERTS: Final = "server/alerts/core"
_ZONES: Final = "server/airspace/core/zones"
AREAS: Final[dict[str, tuple[str, ...]]] = {
    "hold": (f"{_HOLD}/hold.py", f"{_HOLD}/stay_stage.py", f"{_HOLD}/lost_action.py"),
    "lease": (f"{_CONTROL}/lease.py", f"{_CONTROL}/lease_rules.py", f"{_CONTROL}/lease_types.py"),
    "fence": (f"{_HOLD}/holder.py", f"{_HOLD}/late_frames.py", f"{_CONTROL}/lease_changes.py"),
    "policy": (f"{_CONTROL}/policy.py", f"{_CONTROL}/loan_limits.py", f"{_CONTROL}/loan_requests.py"),
    "plans": (f"{_PLANS}/plan_replacement.py", f"{_PLANS}/plan_handler.py"),
    "access": ("server/kernel/access.py", "server/kernel/relations.py"),
    "sealing": ("wire/sealing.py", "wire/sealed_link.py", "wire/replay.py", "wire/rekeying.py"),
    "audit": (f"{_AUDIT}/chain.py", f"{_AUDIT}/sealer.py", f"{_AUDIT}/verifying.py"),
    "zones": ("wire/zones/area.py", "wire/zones/track.py", f"{_ZONES}/watch.py", f"{_ZONES}/check.py"),
    "alerts": (f"{_ALERTS}/rules.py", f"{_ALERTS}/service.py", f"{_ALERTS}/flight_conditions.py"),
}

_COMPARISONS: Final[dict[type[ast.cmpop], tuple[str, str]]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
}


@dataclass(frozen=True)
class Mutant:
    number: int
    area: str
    file: str
    line: int
    start: int
    """Offset of the changed text in the file, in bytes, as `end`."""
    end: int
    new: str
    is_statement: bool

    @property
    def words(self) -> str:
        return f"{self.area:8} {self.file}:{self.line}: {self.new}"


def mutants_of(file: str, area: str, text: str) -> Iterator[Mutant]:
    """Yields all changes of a file, without their numbers."""
    starts = [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def mutant(node: ast.expr | ast.stmt, new: str, *, is_statement: bool = False) -> Mutant:
        assert node.end_lineno is not None and node.end_col_offset is not None
        start, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        return Mutant(0, area, file, node.lineno, start, end, new, is_statement)

    for node in _run_when_called(ast.parse(text)):
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARISONS:
            _, turned = _COMPARISONS[type(node.ops[0])]
            yield mutant(node, f"({ast.unparse(node.left)} {turned} {ast.unparse(node.comparators[0])})")
        elif isinstance(node, ast.BoolOp):
            other = " or " if isinstance(node.op, ast.And) else " and "
            yield mutant(node, f"({other.join(f'({ast.unparse(value)})' for value in node.values)})")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            yield mutant(node, f"bool({ast.unparse(node.operand)})")
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield mutant(node, f"({node.value!r} + 1)")
        elif isinstance(node, ast.Constant) and type(node.value) is bool:
            yield mutant(node, repr(not node.value))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            yield mutant(node, "pass", is_statement=True)


def _run_when_called(tree: ast.Module) -> Iterator[ast.expr | ast.stmt]:
    """The statements and expressions in the bodies of functions: the rest runs once, at the import."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            stack: list[ast.AST] = list(reversed(function.body))
            while stack:
                node = stack.pop()
                if isinstance(
                    node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.JoinedStr | ast.match_case
                ):
                    continue  # a nested function has a turn of its own; patterns and texts take no other expression
                if isinstance(node, ast.expr | ast.stmt):
                    yield node
                stack.extend(ast.iter_child_nodes(node))


def draw(root: Path, seed: int, of_each: int = OF_EACH_AREA) -> list[Mutant]:
    """Draws the changes: the same ones for the same code and seed."""
    chance, drawn = random.Random(seed), []
    for area, files in AREAS.items():
        every = [one for file in files for one in mutants_of(file, area, (root / file).read_text())]
        taken: list[Mutant] = []
        for one in chance.sample(every, len(every)):
            # Two probes cannot stand within each other.
            if all(one.file != other.file or one.end <= other.start or other.end <= one.start for other in taken):
                taken.append(one)
            if len(taken) == of_each:
                break
        drawn += taken
    return [Mutant(**{**asdict(one), "number": number}) for number, one in enumerate(drawn)]


def mutated(text: str, one: Mutant) -> str:
    data = text.encode()
    return (data[: one.start] + one.new.encode() + data[one.end :]).decode()


def probed(text: str, mutants: list[Mutant]) -> str:
    """Returns the file with a note for each change that is reached, and no change."""
    data = text.encode()
    for one in sorted(mutants, key=lambda one: -one.start):
        old = data[one.start : one.end]
        hit = f"__builtins_hit__({one.number})".encode()
        new = hit + b"; " + old if one.is_statement else b"(" + hit + b" or " + old + b")"
        data = data[: one.start] + new + data[one.end :]
    return data.decode()


# Loaded by a .pth file of the clone's environment: in every program of a test, however it was started.
_PROBE: Final = """
import builtins, os
_seen = set()
def _hit(number):
    test = os.environ.get("PYTEST_CURRENT_TEST", "").split("::")[0]
    if (number, test) not in _seen:
        _seen.add((number, test))
        with open({file!r}, "a") as hits:
            hits.write(f"{{number}} {{test}}\\n")
    return None
builtins.__builtins_hit__ = _hit
"""


class Clone:
    """A clone with an environment of its own."""

    def __init__(self, folder: Path, commit: str = "HEAD") -> None:
        self.folder = folder
        self.root = folder / "main"
        self.python = self.root / ".venv" / "bin" / "python"
        self._commit = commit

    def make(self) -> None:
        if self.python.exists():
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(["git", "clone", "-q", str(CHECKOUT), str(self.root)], check=True)
        commit = subprocess.run(
            ["git", "rev-parse", self._commit], cwd=CHECKOUT, check=True, capture_output=True, text=True
        )
        subprocess.run(["git", "checkout", "-q", commit.stdout.strip()], cwd=self.root, check=True)
        subprocess.run(["make", "-j2", "setup"], cwd=self.root, check=True, stdout=subprocess.DEVNULL)
        parts = os.environ | {"PYTHON": str(self.python)}
        subprocess.run(["deploy/install_test_parts.sh"], cwd=self.root, check=True, env=parts)

    @property
    def packages(self) -> Path:
        return next((self.root / ".venv" / "lib").glob("python3*/site-packages"))

    def test(self, *options: str, within_s: float | None = None) -> int:
        """Runs the short tier of these modules. Returns pytest's exit status, or -1 if it did not end in time."""
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        command = [str(self.python), "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not long", *options]
        with (self.folder / "tests.log").open("ab") as log:
            tests = subprocess.Popen(
                command, cwd=self.root, env=environment | {"CI": "true"}, stdout=log, stderr=log, start_new_session=True
            )
            try:
                return tests.wait(within_s)
            except subprocess.TimeoutExpired:
                return -1
            finally:
                if tests.poll() is None:
                    os.killpg(tests.pid, signal.SIGKILL)
                    tests.wait()


def probe(folder: Path, seed: int) -> None:
    """Writes the drawn changes and the modules that reach each of them."""
    clone = Clone(folder)
    clone.make()
    mutants = draw(clone.root, seed)
    hits = folder / "hits.txt"
    (clone.packages / "mutant_probe.py").write_text(_PROBE.format(file=str(hits)))
    (clone.packages / "mutant_probe.pth").write_text("import mutant_probe\n")
    originals = {file: (clone.root / file).read_text() for file in {one.file for one in mutants}}
    try:
        for file, text in originals.items():
            (clone.root / file).write_text(probed(text, [one for one in mutants if one.file == file]))
        clone.test("-n", "4", f"--costs={folder / 'costs.json'}")
    finally:
        for file, text in originals.items():
            (clone.root / file).write_text(text)
        (clone.packages / "mutant_probe.pth").unlink()
    reached: dict[int, set[str]] = defaultdict(set)
    for line in hits.read_text().splitlines():
        number, _, module = line.partition(" ")
        if module:
            reached[int(number)].add(module)
    plan = [asdict(one) | {"modules": sorted(reached[one.number])} for one in mutants]
    (folder / "mutants.json").write_text(json.dumps(plan, indent=1))
    print(f"{len(plan)} changes; no test reaches {sum(not one['modules'] for one in plan)} of them")


def kill(folder: Path, jobs: int, commit: str, after: Path | None) -> None:
    """Runs the tests of each change that has no verdict yet, and appends its verdict."""
    source = after or folder
    plan = json.loads((source / "mutants.json").read_text())
    if after is not None:
        plan = _survivors(after, plan, commit)
    costs = json.loads((source / "costs.json").read_text())
    verdicts = folder / "verdicts.jsonl"
    known = {json.loads(line)["number"] for line in verdicts.read_text().splitlines()} if verdicts.exists() else set()
    clones = [Clone(folder, commit), *(Clone(folder / f"beside-{number}", commit) for number in range(1, jobs))]
    for clone in clones:
        clone.make()
    (folder / "mutants.json").write_text(json.dumps(plan, indent=1))
    free = list(clones)

    def judge(row: dict[str, object]) -> None:
        clone = free.pop()
        modules = [module for module in map(str, row.pop("modules")) if (clone.root / module).exists()]  # type: ignore[call-overload]
        modules.sort(key=lambda module: costs.get(module, {}).get("wall", 60.0))
        one = Mutant(**row)  # type: ignore[arg-type]
        file = clone.root / one.file
        original, began = file.read_text(), time.monotonic()
        if original != (source / "main" / one.file).read_text():
            raise SystemExit(f"{one.file} is not the same at {commit}: no comparison of its tests")
        try:
            file.write_text(mutated(original, one))
            killer = _killer(clone, modules, costs)
        finally:
            file.write_text(original)
            free.append(clone)
        with verdicts.open("a") as lines:
            verdict = {"number": one.number, "killer": killer, "seconds": round(time.monotonic() - began)}
            lines.write(json.dumps(verdict) + "\n")
        print(f"{one.words}  ->  {killer or 'SURVIVES'}", flush=True)

    with ThreadPoolExecutor(jobs) as beside:
        list(beside.map(judge, [row for row in plan if row["number"] not in known]))


def _survivors(after: Path, plan: list[dict[str, Any]], commit: str) -> list[dict[str, Any]]:
    """Returns the changes that survived there, each with the modules that said something else at this commit."""
    killed = {line["number"] for line in _verdicts(after) if line["killer"]}
    changed = subprocess.run(
        ["git", "diff", "--name-only", commit, "HEAD", "--", "tests"],
        cwd=CHECKOUT, check=True, capture_output=True, text=True,
    ).stdout.splitlines()  # fmt: skip
    marked = [
        str(one.relative_to(CHECKOUT)) for one in CHECKOUT.glob("tests/*/**/test_*.py") if _LONG in one.read_text()
    ]
    others = {*changed, *marked}
    return [
        row | {"modules": sorted({*marked, *(module for module in row["modules"] if module in others)})}
        for row in plan
        if row["number"] not in killed
    ]


def _killer(clone: Clone, modules: list[str], costs: dict[str, Any]) -> str:
    """Returns the first module whose tests fail, and fail again alone."""
    report = clone.folder / "failed.xml"
    for batch in _batches(modules, costs):
        status = clone.test("-x", "--junit-xml", str(report), *batch, within_s=KILLED_WITHIN_S)
        if status in (0, NO_TESTS):
            continue
        suspects = batch if status == -1 else [module for module in batch if _failed_in(report, module)] or batch
        for module in suspects:
            if clone.test("-x", module, within_s=KILLED_WITHIN_S) not in (0, NO_TESTS):
                return module
        # It was no fault of the change: the rest of the batch has not run.
        for module in batch:
            if module not in suspects and clone.test("-x", module, within_s=KILLED_WITHIN_S) not in (0, NO_TESTS):
                return module
    return ""


def _batches(modules: list[str], costs: dict[str, Any]) -> Iterator[list[str]]:
    """Yields the modules, cheapest first, in batches that grow: each start of pytest costs seconds."""
    batch: list[str] = []
    took_s, at_most_s = 0.0, FIRST_BATCH_S
    for module in modules:
        wall_s = costs.get(module, {}).get("wall", 60.0)
        if batch and took_s + wall_s > at_most_s:
            yield batch
            batch, took_s, at_most_s = [], 0.0, min(2 * at_most_s, LAST_BATCH_S)
        batch.append(module)
        took_s += wall_s
    if batch:
        yield batch


def _failed_in(report: Path, module: str) -> bool:
    name = module.removesuffix(".py").replace("/", ".")
    cases = ElementTree.parse(report).iter("testcase") if report.exists() else ()
    return any(
        (case.get("classname") or "").startswith(name) and (case.findall("failure") or case.findall("error"))
        for case in cases
    )


def _verdicts(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "verdicts.jsonl").read_text().splitlines()]


def table(folder: Path) -> None:
    plan = {row["number"]: row for row in json.loads((folder / "mutants.json").read_text())}
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for verdict in _verdicts(folder):
        of_area = counts[plan[verdict["number"]]["area"]]
        of_area["all"] += 1
        of_area["killed"] += bool(verdict["killer"])
    print(f"{'area':10} {'changes':>8} {'killed':>8}")
    for area, of_area in [*sorted(counts.items()), ("all", sum(counts.values(), Counter()))]:
        print(f"{area:10} {of_area['all']:8} {of_area['killed']:8}")
    for verdict in _verdicts(folder):
        if not verdict["killer"]:
            row = plan[verdict["number"]]
            print(f"  survives: {row['file']}:{row['line']}: {row['new']} (reached by {len(row['modules'])} modules)")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.mutants")
    parser.add_argument("step", choices=("probe", "kill", "table"))
    parser.add_argument("--folder", type=Path, required=True, help="where clones and verdicts are kept")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--at", default="HEAD", help="the commit whose tests run")
    parser.add_argument("--after", type=Path, help="a folder with verdicts: only what survived there")
    said = parser.parse_args()
    folder: Path = said.folder.resolve()
    if said.step == "probe":
        probe(folder, said.seed)
    elif said.step == "kill":
        kill(folder, said.jobs, said.at, said.after)
    else:
        table(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
