"""The other towers and the bus, as Prometheus metrics (docs/metrics.md). Only with TOWER_BUS_URL."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.api.bus.several_towers import SeveralTowers
from server.live.hub import Hub
from server.live.towers.place import Place


class TowersCollector(Collector):
    """Reads existing facts."""

    def __init__(self, several: SeveralTowers, hub: Hub) -> None:
        self._several = several
        self._hub = hub

    def collect(self) -> Iterator[Metric]:
        towers, bus = self._several.towers, self._several.bus
        connected = "1: the connection to the bus stands"
        yield GaugeMetricFamily("tower_bus_connected", connected, value=bus.is_connected)
        dropped = CounterMetricFamily("tower_bus_packets_dropped", "Packets, by why", labels=("why",))
        dropped.add_metric(("not sent",), bus.dropped)
        dropped.add_metric(("not understood",), towers.packets_dropped)
        yield dropped
        others = GaugeMetricFamily("tower_other_towers", "Other towers of this database", labels=("state",))
        ready = sum(1 for _ in towers.ready())
        others.add_metric(("heard",), ready)
        others.add_metric(("not heard",), len(towers.others) - ready)
        yield others
        yield GaugeMetricFamily(
            "tower_visitors", "Browsers of other towers that this one serves", value=len(towers.visitors)
        )
        places = Counter(drone.place for drone in self._hub.state.drones.values())
        homes = GaugeMetricFamily("tower_drone_homes", "Drones by the place of their home", labels=("place",))
        for place in Place:
            homes.add_metric((place.value,), places[place])
        yield homes
