"""The results of a benchmark: rows, percentiles, the table for people and the JSON for programs."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

SPREAD = {"p50": 0.5, "p95": 0.95, "p99": 0.99, "max": 1.0}


@dataclass(frozen=True, slots=True)
class Row:
    case: str
    system: str
    metric: str
    value: float
    unit: str


def percentile(values: Iterable[float], share: float) -> float:
    """Returns the smallest value that at least `share` of them do not exceed (nearest rank), without interpolation."""
    ordered = sorted(values)
    if not ordered:
        return math.nan
    return ordered[max(math.ceil(share * len(ordered)) - 1, 0)]


@dataclass
class Report:
    """Collects the rows of one run, and prints each at once, so that an aborted run is not lost."""

    bench: str
    system: str = "ours"
    rows: list[Row] = field(default_factory=list)
    console: Console = field(default_factory=lambda: Console(width=None if sys.stdout.isatty() else 170))
    began: float = field(default_factory=time.time)

    def add(self, case: str, metric: str, value: float, unit: str) -> None:
        self.rows.append(Row(case, self.system, metric, round(value, 3), unit))

    def spread(self, case: str, metric: str, values: list[float], unit: str) -> None:
        """Adds p50, p95, p99 and the maximum, with the number of values."""
        for name, share in SPREAD.items():
            if values:
                self.add(case, f"{metric}_{name}", percentile(values, share), unit)
        self.add(case, f"{metric}_n", len(values), "count")

    def say(self, words: str) -> None:
        self.console.print(words, highlight=False)

    def as_table(self) -> Table:
        """A line for each metric of a case; percentiles are side by side."""
        table = Table(title=f"bench {self.bench}")
        for name in ("case", "system", "metric", "value", *SPREAD, "n", "unit"):
            table.add_column(name, justify="left" if name in ("case", "system", "metric", "unit") else "right")
        lines: dict[tuple[str, str, str], dict[str, Row]] = {}
        for row in self.rows:
            stem, _, end = row.metric.rpartition("_")
            spread = end in (*SPREAD, "n")
            line = lines.setdefault((row.case, row.system, stem if spread else row.metric), {})
            line[end if spread else "value"] = row
        last = ""
        for (case, system, metric), line in lines.items():
            if case != last and last:
                table.add_section()
            figures = [f"{line[name].value:g}" if name in line else "" for name in ("value", *SPREAD, "n")]
            unit = next(row.unit for name, row in line.items() if name != "n" or len(line) == 1)
            table.add_row("" if case == last else case, system, metric, *figures, unit)
            last = case
        return table

    def as_json(self) -> dict[str, Any]:
        rows = [asdict(row) for row in self.rows]
        for row in rows:
            if not math.isfinite(row["value"]):
                row["value"] = None
        return {"bench": self.bench, "machine": machine(), "began_unix_s": round(self.began), "rows": rows}

    def write(self, file: Path) -> None:
        file.write_text(json.dumps(self.as_json(), indent=1) + "\n")


def machine() -> dict[str, Any]:
    """Returns the conditions that the figures depend on."""
    return {
        "cpus": os.cpu_count(),
        "load_1min": round(os.getloadavg()[0], 2),
        "architecture": platform.machine(),
        "kernel": platform.release(),
        "python": platform.python_version(),
    }
