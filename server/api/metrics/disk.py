"""The free room of the disk that the tower's data is on, when somebody asks. docs/metrics.md lists it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector


class DiskCollector(Collector):
    """`folder`: somewhere on that disk. Nothing is told of a folder that is not there."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def collect(self) -> Iterator[Metric]:
        try:
            free = shutil.disk_usage(self._folder).free
        except OSError:
            return
        yield GaugeMetricFamily("tower_disk_free_bytes", "Of the disk that TOWER_VAR is on", value=free)
