"""Prometheus metrics of database, lock, retention and alert channels (docs/metrics.md)."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.alerts.store.channels.deliverer import OUTCOMES, AlertDeliverer
from server.alerts.store.writer import AlertWriter
from server.storage.database import Database
from server.storage.retention import Retention
from server.towers.store.membership import TowerMembership
from server.towers.store.tower_lock import TowerLock


class UpkeepCollector(Collector):
    """Reads existing facts; asks the database nothing."""

    def __init__(
        self,
        database: Database,
        lock: TowerLock | TowerMembership,
        retention: Retention,
        deliverer: AlertDeliverer,
        alerts: AlertWriter,
    ) -> None:
        self._database = database
        self._lock = lock
        self._retention = retention
        self._deliverer = deliverer
        self._alerts = alerts

    def collect(self) -> Iterator[Metric]:
        writes = "1: the database took the last write of the tower's lock, half a second ago; 0: not"
        yield GaugeMetricFamily("tower_database_writable", writes, value=self._lock.is_renewed)
        failing = "1: the last transaction found the database locked, full, silent or gone"
        yield GaugeMetricFamily("tower_database_failing", failing, value=self._database.answers.failing)
        removed = CounterMetricFamily("tower_retention_removed", "What was too old or too much", labels=("what",))
        for what, count in sorted(self._retention.removed.items()):
            removed.add_metric((what,), count)
        yield removed
        words = "Deliveries of alerts to channels: attempts and what became of them"
        deliveries = CounterMetricFamily("tower_alert_deliveries", words, labels=("outcome",))
        for outcome in OUTCOMES:
            deliveries.add_metric((outcome,), self._deliverer.counts[outcome])
        yield deliveries
        words = "Deliveries that were given up in the last seven days, of all towers of the database"
        yield GaugeMetricFamily("tower_alert_deliveries_given_up", words, value=self._deliverer.given_up)
        words = "Changes of alerts that were not stored, because too many waited for the database"
        yield CounterMetricFamily("tower_alerts_not_stored", words, value=self._alerts.lost)
