"""What each module of tests costs in processor time, by kind of process (`pytest --costs FILE`).

Wall time says how busy the machine was; processor time says what a test asks of it. The time of the process that runs
the tests is exact. Its programs are looked at once a second, by their entries in `/proc`: what a program used after
the last look is missed (a program that ran for less altogether counts as `unseen`, for the whole run only), and what a
program of several modules uses counts for the module that runs at the time.
"""

import contextlib
import json
import os
import resource
import threading
import time
from collections import defaultdict
from collections.abc import Generator, Mapping
from pathlib import Path
from typing import Any, Final

import pytest

LOOK_EVERY_S: Final = 1.0
DEAREST: Final = 20
TESTS: Final = "tests"
"""The process that runs the tests."""
WALL: Final = "wall"
"""How long the module took. No kind of processor time: never part of a sum."""

_TICKS_PER_S: Final = os.sysconf("SC_CLK_TCK")
_PROGRAMS: Final = ("tower-agent", "tower-sim", "tower")

Costs = dict[str, dict[str, float]]
"""Seconds by module and kind."""


def kind_of(arguments: list[str]) -> str:
    """Returns what a program is, from its command line."""
    words = [Path(word).name for word in arguments]
    if not words:
        return "other"
    if "chrom" in arguments[0]:  # it writes its arguments as one
        return next(
            (f"chromium {part}" for part in ("renderer", "gpu") if f"--type={part}" in " ".join(arguments)), "chromium"
        )
    if words[0].startswith(("postgres", "node", "nats-server")):
        return words[0].split(":")[0].removesuffix("-server")
    if "bench" in words[1:3]:
        return "bench"
    return next((name for word in words[:3] for name in _PROGRAMS if word == name), "other")


def sum_of(costs: Mapping[str, float]) -> float:
    """Returns the processor time of all kinds in seconds."""
    return sum(seconds for kind, seconds in costs.items() if kind != WALL)


def _stat(pid: int) -> list[str] | None:
    """Returns the fields of `/proc/PID/stat` after the name, or None for a process that has ended."""
    try:
        with Path(f"/proc/{pid}/stat").open("rb", buffering=0) as file:
            return file.read().decode(errors="replace").rpartition(")")[2].split()
    except OSError:
        return None


class Programs:
    """The programs that this process started, and theirs, with the processor time each has used."""

    def __init__(self) -> None:
        self._pid = os.getpid()
        self._worker = os.environ.get("PYTEST_XDIST_WORKER", "")
        self._run = os.environ.get("PYTEST_XDIST_TESTRUNUID", "")
        self._kinds: dict[tuple[int, str], str] = {}
        """By process id and start: a process id is used again."""
        self._strangers: set[int] = set()
        """Processes of somebody else that were there at the last look. Most are, and they are not looked at again."""
        self._used: dict[tuple[int, str], int] = {}

    def look(self) -> dict[str, float]:
        """Returns the seconds that each kind has used since the last look."""
        used: dict[str, float] = defaultdict(float)
        with os.scandir("/proc") as entries:
            there = {int(entry.name) for entry in entries if entry.name.isdigit()}
        self._strangers &= there
        for pid in there - self._strangers:
            if (fields := _stat(pid)) is None:
                continue
            key, ticks = (pid, fields[19]), int(fields[11]) + int(fields[12])
            if key not in self._kinds and not self._is_ours(pid):
                self._strangers.add(pid)
                continue
            kind = self._kinds.get(key, "other")
            if kind == "other":
                kind = self._kinds[key] = self._kind(pid)  # it may have become another program since
            used[kind] += (ticks - self._used.get(key, 0)) / _TICKS_PER_S
            self._used[key] = ticks
        return used

    def total_s(self) -> float:
        return sum(self._used.values()) / _TICKS_PER_S

    def _is_ours(self, pid: int) -> bool:
        if pid == self._pid:
            return False
        ancestor = pid
        while (fields := _stat(ancestor)) is not None and (ancestor := int(fields[1])) > 1:
            if ancestor == self._pid:
                return True
        with contextlib.suppress(OSError):  # a daemon has another parent and keeps the environment
            environment = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
            return bool(self._worker) and {
                f"PYTEST_XDIST_WORKER={self._worker}".encode(),
                f"PYTEST_XDIST_TESTRUNUID={self._run}".encode(),
            } <= set(environment)
        return False

    def _kind(self, pid: int) -> str:
        with contextlib.suppress(OSError):
            return kind_of(Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")[:-1])
        return "other"


class Meter:
    """Measures the modules that this process runs."""

    def __init__(self) -> None:
        self.costs: Costs = defaultdict(lambda: defaultdict(float))
        self._module = "(collection)"
        self._programs = Programs()
        self._lock = threading.Lock()
        self._ends = threading.Event()
        self._own_s = 0.0
        self._thread = threading.Thread(target=self._look_now_and_then, name="costs", daemon=True)
        self._thread.start()

    def enter(self, module: str) -> None:
        if module != self._module:
            self._count()
            self._module = module

    def end(self) -> None:
        self._ends.set()
        self._thread.join()
        self._count()
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        unseen_s = children.ru_utime + children.ru_stime - self._programs.total_s()
        self.costs["(short programs)"]["unseen"] += max(0.0, unseen_s)

    def _look_now_and_then(self) -> None:
        while not self._ends.wait(LOOK_EVERY_S):
            self._count()

    def _count(self) -> None:
        with self._lock:
            costs = self.costs[self._module]
            for kind, seconds in self._programs.look().items():
                costs[kind] += seconds
            own_s = time.process_time()
            costs[TESTS] += own_s - self._own_s
            self._own_s = own_s


class CostsPlugin:
    """Collects what all workers measured, writes it and prints the dearest."""

    def __init__(self, config: pytest.Config, file: Path) -> None:
        self._config = config
        self._file = file
        self._all: Costs = defaultdict(lambda: defaultdict(float))
        self._started = time.monotonic()
        is_only_distributing = getattr(config.option, "dist", "no") != "no" and not hasattr(config, "workerinput")
        self._meter = None if is_only_distributing else Meter()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, bool, bool]:
        assert self._meter is not None
        module = item.nodeid.split("::")[0]
        self._meter.enter(module)
        started = time.monotonic()
        try:
            return (yield)
        finally:
            self._meter.costs[module][WALL] += time.monotonic() - started

    def pytest_sessionfinish(self) -> None:
        if self._meter is None:
            return
        self._meter.end()
        if hasattr(self._config, "workerinput"):
            self._config.workeroutput["costs"] = json.dumps(self._meter.costs)  # type: ignore[attr-defined]
        else:
            self._add(self._meter.costs)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        self._add(json.loads(getattr(node, "workeroutput", {}).get("costs", "{}")))

    def _add(self, costs: Mapping[str, Mapping[str, float]]) -> None:
        for module, kinds in costs.items():
            for kind, seconds in kinds.items():
                self._all[module][kind] += seconds

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if hasattr(self._config, "workerinput"):
            return
        rounded = {
            module: {kind: round(seconds, 2) for kind, seconds in sorted(kinds.items()) if seconds >= 0.005}
            for module, kinds in sorted(self._all.items())
        }
        self._file.parent.mkdir(parents=True, exist_ok=True)
        self._file.write_text(json.dumps(rounded, indent=1) + "\n")
        terminalreporter.section("processor time")
        for line in table_of(rounded, time.monotonic() - self._started):
            terminalreporter.write_line(line)


def table_of(costs: Mapping[str, Mapping[str, float]], run_s: float) -> list[str]:
    """Returns the sums by kind and the dearest modules, as lines for people."""
    kinds: dict[str, float] = defaultdict(float)
    for of_module in costs.values():
        for kind, seconds in of_module.items():
            kinds[kind] += seconds
    kinds.pop(WALL, None)
    by_kind = sorted(kinds.items(), key=lambda one: -one[1])
    lines = [f"{sum(kinds.values()):8.0f} s in {run_s:.0f} s: " + ", ".join(f"{kind} {s:.0f}" for kind, s in by_kind)]
    for module in sorted(costs, key=lambda name: -sum_of(costs[name]))[:DEAREST]:
        of_module = costs[module]
        dearest = sorted((kind for kind in of_module if kind != WALL), key=lambda kind: -of_module[kind])[:3]
        parts = ", ".join(f"{kind} {of_module[kind]:.0f}" for kind in dearest)
        lines.append(f"{sum_of(of_module):8.1f} s  {module} ({of_module.get(WALL, 0.0):.0f} s long; {parts})")
    return lines
