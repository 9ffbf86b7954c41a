"""Turns the relay's plain counters into Prometheus metrics, on request only.

docs/metrics.md lists the same metrics; a test compares the two.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
    SummaryMetricFamily,
)
from prometheus_client.registry import Collector

from server.alerts.core.severity import Severity
from server.link.core.traffic import LATENCY_BOUNDS_S, Histogram, Traffic
from server.live.hub import Hub
from server.live.live_counts import count_live
from server.storage.database import Database

Counted = Callable[[Traffic], int]

_COUNTERS: Final[tuple[tuple[str, str, tuple[tuple[str, str, Counted], ...]], ...]] = (
    (
        "tower_frames",
        "MAVLink frames by peer and direction",
        (
            ("agent", "in", lambda traffic: traffic.frames_from_agents),
            ("agent", "out", lambda traffic: traffic.frames_to_agents),
            ("browser", "in", lambda traffic: traffic.frames_from_browsers),
            ("browser", "out", lambda traffic: traffic.frames_to_browsers),
        ),
    ),
    (
        "tower_bytes",
        "Bytes of datagrams and WebSocket messages by peer and direction",
        (
            ("agent", "in", lambda traffic: traffic.bytes_from_agents),
            ("agent", "out", lambda traffic: traffic.bytes_to_agents),
            ("browser", "in", lambda traffic: traffic.bytes_from_browsers),
            ("browser", "out", lambda traffic: traffic.bytes_to_browsers),
        ),
    ),
    (
        "tower_messages",
        "Datagrams (agents) and binary WebSocket messages (browsers) by peer and direction",
        (
            ("agent", "in", lambda traffic: traffic.datagrams_from_agents),
            ("agent", "out", lambda traffic: traffic.datagrams_to_agents),
            ("browser", "in", lambda traffic: traffic.messages_from_browsers),
            ("browser", "out", lambda traffic: traffic.messages_to_browsers),
        ),
    ),
)


class RelayCollector(Collector):
    """The hub's counters and its present state. `database`: the connections to it. `held_s`: for how long the event
    loop stood still, by place."""

    def __init__(self, hub: Hub, database: Database, held_s: Mapping[str, float]) -> None:
        self._hub = hub
        self._held_s = held_s
        self._database_pool = database

    def collect(self) -> Iterator[Metric]:
        traffic = self._hub.state.traffic
        for name, words, sides in _COUNTERS:
            family = CounterMetricFamily(name, words, labels=("peer", "direction"))
            for peer, direction, counted in sides:
                family.add_metric((peer, direction), counted(traffic))
            yield family
        yield _by("tower_drops", "Datagrams, frames and messages not passed on", "reason", self._hub.state.drops)
        yield _by("tower_refusals", "Refusals that a browser was told of", "code", traffic.refusals)
        yield _by("tower_browser_closes", "Live connections closed by the tower", "code", traffic.browser_closes)
        yield _by("tower_control_events", "Changes of who has the controls", "event", traffic.control_events)
        yield _by("tower_hold_steps", "Steps of holds as agents reported them", "step", traffic.hold_steps)
        yield _by(
            "tower_separation_alerts", "Drones near each other: levels told to people", "level", traffic.separation
        )
        yield _by("tower_alerts_opened", "Alerts opened", "severity", self._hub.alerts.opened)
        open_alerts, present = self._hub.alerts.counts(), "Alerts that are open"
        gauge = GaugeMetricFamily("tower_alerts_open", present, labels=("severity",))
        for severity in Severity:
            gauge.add_metric((severity.value,), open_alerts[severity.value])
        yield gauge
        near = self._hub.separation.counts()
        yield CounterMetricFamily(
            "tower_separation_cut_short",
            "Times when not all drones near each other were looked at",
            value=near.cut_short,
        )
        pairs = GaugeMetricFamily("tower_separation_pairs", "Pairs of drones near each other", labels=("level",))
        pairs.add_metric(("caution",), near.cautions)
        pairs.add_metric(("warning",), near.warnings)
        yield pairs
        yield CounterMetricFamily("tower_holds_ordered", "Holds that the tower ordered", value=traffic.holds_ordered)
        for name, words, links in (
            ("tower_links_orphaned", "Control channels of agents lost, their links going on", traffic.links_orphaned),
            ("tower_links_resumed", "Links that went on with another control channel", traffic.links_resumed),
        ):
            yield CounterMetricFamily(name, words, value=links)
        yield CounterMetricFamily(
            "tower_frames_lost", "Transactional frames browsers were too slow for", value=traffic.frames_lost
        )
        yield histogram_family(
            "tower_up_latency_seconds", "Agent's socket to browser's socket, frames due at once", traffic.up
        )
        yield _by("tower_faults", "Errors of the tower that others did not notice", "part", traffic.faults)
        yield _by("tower_loop_held_seconds", "Time for which the event loop stood still", "where", dict(self._held_s))
        yield histogram_family("tower_down_latency_seconds", "Browser's socket to agent's socket", traffic.down)
        yield histogram_family("tower_loop_late_seconds", "How late the hub's clock beats", traffic.loop_late)
        yield from self._video()
        yield from self._present()
        yield from self._database()

    def _video(self) -> Iterator[Metric]:
        traffic = self._hub.video.traffic
        for name, words, came, went in (
            ("tower_video_units", "Units of video by peer and direction", traffic.units_in, traffic.units_out),
            ("tower_video_bytes", "Bytes of them", traffic.bytes_in, traffic.bytes_out),
        ):
            family = CounterMetricFamily(name, words, labels=("peer", "direction"))
            family.add_metric(("agent", "in"), came)
            family.add_metric(("viewer", "out"), went)
            yield family
        yield CounterMetricFamily(
            "tower_video_skipped", "Units of video that viewers were too slow for", value=traffic.skipped
        )
        yield _by("tower_video_dropped", "Units of agents that went to nobody", "why", traffic.dropped)
        yield _by("tower_video_closes", "Viewers' connections closed by the tower", "code", traffic.closes)
        yield histogram_family("tower_video_age_seconds", "From capture to the tower, clocks known", traffic.age)
        yield histogram_family("tower_video_wait_seconds", "From arrival to being written to a viewer", traffic.wait)
        viewers, streams = self._hub.video.count()
        yield GaugeMetricFamily("tower_video_viewers", "Viewers of video", value=viewers)
        yield GaugeMetricFamily("tower_video_streams", "Streams that agents are asked for", value=streams)

    def _present(self) -> Iterator[Metric]:
        counts = count_live(self._hub.state)
        for name, words, value in (
            ("tower_browsers", "Live connections of browsers and programs", counts.browsers),
            ("tower_users", "Users who have one", counts.users),
            ("tower_agents", "Agents signed in", counts.agents),
            ("tower_drones", "Drones there are", counts.drones),
            ("tower_drones_online", "Drones whose data channel works", counts.online),
            ("tower_drones_held", "Drones whose controls somebody has", counts.held),
        ):
            yield GaugeMetricFamily(name, words, value=value)
        versions = GaugeMetricFamily("tower_agent_versions", "Agents signed in by their version", labels=("version",))
        for version, agents in sorted(counts.agent_versions.items()):
            versions.add_metric((version,), agents)
        yield versions
        queues = ("text", "transactional", "state")
        yield _depths("tower_queue_depth", "What waits for all browsers together", queues, counts.waiting)
        yield _depths("tower_queue_deepest", "What waits for the slowest of them", queues, counts.deepest)
        of_agents = ("message", "datagram")
        yield _depths("tower_agent_queue_depth", "What waits for all agents together", of_agents, counts.agents_waiting)
        yield _depths(
            "tower_agent_queue_deepest", "What waits for the slowest of them", of_agents, counts.agents_deepest
        )

    def _database(self) -> Iterator[Metric]:
        answers = self._database_pool.answers
        seconds = SummaryMetricFamily("tower_database_transaction_seconds", "How long the database took for each")
        seconds.add_metric((), answers.transactions, answers.total_s)
        yield seconds
        failures = "Transactions that found it locked, full, silent or gone"
        yield CounterMetricFamily("tower_database_failures", failures, value=answers.failures)
        pool = self._database_pool.pool_use()
        if pool is None:
            return
        family = GaugeMetricFamily("tower_database_connections", "Of the pool, by state", labels=("state",))
        family.add_metric(("in_use",), pool.in_use)
        family.add_metric(("idle",), pool.idle)
        yield family
        yield GaugeMetricFamily("tower_database_pool_size", "Connections kept open at most", value=pool.size)


def _depths(name: str, words: str, queues: Sequence[str], depths: Sequence[int]) -> GaugeMetricFamily:
    family = GaugeMetricFamily(name, words, labels=("queue",))
    for queue, depth in zip(queues, depths, strict=True):
        family.add_metric((queue,), depth)
    return family


def _by(name: str, words: str, label: str, counts: Mapping[Any, float]) -> CounterMetricFamily:
    family = CounterMetricFamily(name, words, labels=(label,))
    for key, count in sorted(counts.items(), key=lambda item: str(item[0])):
        family.add_metric((str(key),), count)
    return family


def histogram_family(name: str, words: str, histogram: Histogram) -> HistogramMetricFamily:
    """The buckets of `histogram`, as Prometheus has them."""
    family = HistogramMetricFamily(name, words)
    family.add_metric((), list(_added_up(histogram.counts)), histogram.total_s)
    return family


def _added_up(counts: Iterable[int]) -> Iterator[tuple[str, float]]:
    total = 0
    for bound, count in zip((*map(str, LATENCY_BOUNDS_S), "+Inf"), counts, strict=True):
        total += count
        yield bound, total
