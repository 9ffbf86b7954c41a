"""The free space of the disk that holds the tower's data, read on request. docs/metrics.md lists it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector


class DiskCollector(Collector):
    """`folder`: any folder on that disk. A missing folder yields no metric."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def collect(self) -> Iterator[Metric]:
        try:
            disk = shutil.disk_usage(self._folder)
        except OSError:
            return
        yield GaugeMetricFamily("tower_disk_free_bytes", "Of the disk that TOWER_VAR is on", value=disk.free)
        yield GaugeMetricFamily("tower_disk_size_bytes", "Of that disk in all", value=disk.total)
