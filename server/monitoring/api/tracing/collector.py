"""Prometheus metrics of the spans that the tower sends (docs/metrics.md)."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.monitoring.api.tracing.tracing import Tracing


class TelemetryCollector(Collector):
    def __init__(self, tracing: Tracing) -> None:
        self._tracing = tracing

    def collect(self) -> Iterator[Metric]:
        queue = self._tracing.queue
        if queue is None:
            return
        spans = CounterMetricFamily("tower_telemetry_spans", "Spans for the collector", labels=("outcome",))
        for outcome, count in queue.counts.items():
            spans.add_metric((outcome,), count)
        yield spans
        yield GaugeMetricFamily("tower_telemetry_spans_waiting", "Spans that were not sent yet", value=queue.waiting)
