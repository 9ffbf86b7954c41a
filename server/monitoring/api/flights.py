"""Counters of recorded flights, as Prometheus metrics (docs/metrics.md)."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.flights.store.flights import Flights


class FlightCollector(Collector):
    """Reads existing counters."""

    def __init__(self, flights: Flights) -> None:
        self._flights = flights

    def collect(self) -> Iterator[Metric]:
        recorder, writer = self._flights.recorder, self._flights.writer
        service, quota = self._flights.service, self._flights.quota
        events = CounterMetricFamily("tower_flights", "Flights, by what became of them", labels=("event",))
        for event, count in sorted({**recorder.counts, "removed": quota.removed}.items()):
            events.add_metric((event,), count)
        yield events
        frames = CounterMetricFamily("tower_flight_frames", "Frames by what became of them", labels=("end",))
        frames.add_metric(("recorded",), writer.frames_written)
        frames.add_metric(("no_room",), writer.frames_refused)
        frames.add_metric(("not_written",), writer.frames_unwritten)
        frames.add_metric(("from_drone",), self._flights.gaps.frames)
        yield frames
        fetcher = self._flights.hub.black_box
        gaps = CounterMetricFamily("tower_flight_gaps", "Gaps, by what became of them", labels=("end",))
        for end in ("fetched", "failed"):
            gaps.add_metric((end,), fetcher.counts[end])
        yield gaps
        for name, words, value in (
            ("tower_flights_recording", "Flights that are being recorded", recorder.running),
            ("tower_flights_failing", "1: the disk keeps flights from being recorded; 0: not", int(service.failing)),
            ("tower_flights_waiting_bytes", "What the disk does not have yet", writer.waiting_bytes),
            ("tower_flights_before_bytes", "Memory for what came before flights", recorder.ring_bytes()),
            ("tower_flight_gaps_waiting", "Gaps that are not fetched yet", fetcher.waiting),
            ("tower_flights_budget_bytes", "Room for flights", quota.budget_bytes),
        ):
            yield GaugeMetricFamily(name, words, value=value)
        kept = GaugeMetricFamily("tower_flights_bytes", "Flights on the disk", labels=("state",))
        kept.add_metric(("running",), service.running_bytes())
        kept.add_metric(("over",), quota.kept_bytes)
        yield kept
