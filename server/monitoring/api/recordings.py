"""Counters of recordings, as Prometheus metrics (docs/metrics.md)."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.video.store.recordings import Recordings

_EVENTS = ("begun", "ended", "ready", "failed", "removed")


class RecordingCollector(Collector):
    """Reads existing counters."""

    def __init__(self, recordings: Recordings) -> None:
        self._recordings = recordings

    def collect(self) -> Iterator[Metric]:
        service, quota, counts = self._recordings.service, self._recordings.quota, self._recordings.notifier.counts
        events = CounterMetricFamily(
            "tower_recordings", "Recordings of video, by what became of them", labels=("event",)
        )
        for event in _EVENTS:
            events.add_metric((event,), counts[event])
        yield events
        for name, words, value in (
            ("tower_recordings_running", "Videos that are being recorded", service.running()),
            (
                "tower_recordings_finishing",
                "Recordings whose files are made or wait for it",
                self._recordings.finisher.waiting,
            ),
            (
                "tower_recordings_waiting_bytes",
                "What the disk does not have yet of all of them",
                service.waiting_bytes(),
            ),
            ("tower_recordings_budget_bytes", "Room for recordings", quota.budget_bytes),
        ):
            yield GaugeMetricFamily(name, words, value=value)
        kept = GaugeMetricFamily("tower_recordings_bytes", "Recordings on the disk", labels=("state",))
        kept.add_metric(("running",), service.running_bytes())
        kept.add_metric(("over",), quota.kept_bytes)
        yield kept
