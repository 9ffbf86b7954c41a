"""What strangers use of the tower, as Prometheus metrics (docs/metrics.md)."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.anonymous.core.budget import AnonymousBudget


class AnonymousCollector(Collector):
    def __init__(self, budget: AnonymousBudget) -> None:
        self._budget = budget

    def collect(self) -> Iterator[Metric]:
        budget = self._budget
        refused = CounterMetricFamily(
            "tower_anonymous_refused", "What was refused before a sign-in, by what was used up", labels=("what",)
        )
        for what, count in sorted(budget.refused.items()):
            refused.add_metric((what.value,), count)
        yield refused
        waiting = GaugeMetricFamily("tower_anonymous_waiting", "Strangers who wait for their turn", labels=("line",))
        for line, count in budget.waiting.items():
            waiting.add_metric((line,), count)
        yield waiting
        yield GaugeMetricFamily(
            "tower_anonymous_connections", "Connections that have not signed in", value=len(budget.connections)
        )
        yield GaugeMetricFamily(
            "tower_anonymous_handshakes", "WebSockets whose sign-in is not checked", value=budget.handshakes.total()
        )
        yield GaugeMetricFamily(
            "tower_known_addresses", "Remembered names and addresses of sign-ins", value=len(budget.known)
        )
