"""The other towers and the bus, as Prometheus metrics (docs/metrics.md). Only with TOWER_BUS_URL."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.live.hub import Hub
from server.monitoring.api.collector import histogram_family
from server.towers.api.several_towers import SeveralTowers
from server.towers.core.place import Place


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
        dropped.add_metric(("not of a tower",), bus.refused)
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
        yield from self._video()

    def _video(self) -> Iterator[Metric]:
        video = self._several.video
        sent, taken = video.exports.traffic, video.imports.traffic
        connected = "1: the connection for video to the bus stands"
        yield GaugeMetricFamily("tower_bus_video_connected", connected, value=video.bus.is_connected)
        streams = GaugeMetricFamily("tower_bus_video_streams", "Streams of video on the bus", labels=("direction",))
        streams.add_metric(("in",), video.imports.streams())
        streams.add_metric(("out",), video.exports.streams())
        yield streams
        for name, words, units_in, units_out in (
            ("tower_bus_video_units", "Units of video from and to other towers", taken.units_in, sent.units_out),
            ("tower_bus_video_bytes", "Bytes of them", taken.bytes_in, sent.bytes_out),
        ):
            family = CounterMetricFamily(name, words, labels=("direction",))
            family.add_metric(("in",), units_in)
            family.add_metric(("out",), units_out)
            yield family
        skipped = "Units of video that the way to another tower was too slow for"
        yield CounterMetricFamily("tower_bus_video_skipped", skipped, value=sent.skipped)
        dropped = CounterMetricFamily("tower_bus_video_dropped", "Packets of video, by why", labels=("why",))
        dropped.add_metric(("not sent",), video.bus.dropped)
        dropped.add_metric(("not of a tower",), video.bus.refused)
        for why, count in (video.imports.dropped + taken.dropped).items():
            dropped.add_metric((why,), count)
        yield dropped
        age = "From capture to the arrival from another tower, clocks known"
        yield histogram_family("tower_bus_video_age_seconds", age, taken.age)
