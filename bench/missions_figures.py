"""The results of `bench missions`: seconds by system and action, failures, traffic on the line; and their rows."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, field
from typing import Final

from bench.namespaces import Carried
from bench.rows import Report

OURS: Final = "ours"
PEER: Final = "MAVSDK"
Key = tuple[str, str]
"""(system, action)."""


@dataclass
class Figures:
    """For one environment: loopback, or the emulated line."""

    report: Report
    took_s: dict[Key, list[float]] = field(default_factory=dict)
    failures: dict[Key, int] = field(default_factory=dict)
    carried: dict[Key, list[Carried]] = field(default_factory=dict)
    counts: dict[Key, int] = field(default_factory=dict)

    def took(self, system: str, what: str, seconds: float) -> None:
        self.took_s.setdefault((system, what), []).append(seconds)
        self.report.say(f"  {system}: {what}: {seconds:.3f} s")

    def failed(self, system: str, what: str, words: str) -> None:
        self.failures[system, what] = self.failures.get((system, what), 0) + 1
        self.report.say(f"  {system}: {what}: failed: {words}")

    def announce(self, where: str) -> None:
        """Adds the rows: a case for each action, with both systems."""
        for what in dict.fromkeys(what for _, what in (*self.took_s, *self.failures)):
            for system in (OURS, PEER):
                self._add_figures(f"{what}, {where}", (system, what))
            self._add_ratio(f"{what}, {where}", what)
        self.report.system = OURS

    def _add_figures(self, case: str, key: Key) -> None:
        self.report.system, _ = key
        if key not in self.took_s and key not in self.failures:
            return
        self.report.spread(case, "took", self.took_s.get(key, []), "s")
        self.report.add(case, "failed", self.failures.get(key, 0), "count")
        if key in self.counts:
            self.report.add(case, "values", self.counts[key], "count")
        if key in self.carried:
            up, lost_up, down, lost_down, *_ = (
                statistics.mean(column) for column in zip(*self.carried[key], strict=True)
            )
            self.report.add(case, "packets from the drone, a round", up + lost_up, "count")
            self.report.add(case, "of these lost", lost_up, "count")
            self.report.add(case, "packets to the drone, a round", down + lost_down, "count")
            self.report.add(case, "of those lost", lost_down, "count")

    def _add_ratio(self, case: str, what: str) -> None:
        """The ratio to MAVSDK's time for the same over the drone's line alone, wherever the tower's user was."""
        ours, theirs = self.took_s.get((OURS, what)), self.took_s.get((PEER, what.partition(",")[0]))
        if ours and theirs:
            self.report.system = OURS
            ratio = statistics.median(theirs) / statistics.median(ours)
            self.report.add(case, "times as fast as MAVSDK, medians", ratio, "ratio")
            self.report.add(case, "times as fast as MAVSDK, our worst to its best", min(theirs) / max(ours), "ratio")
