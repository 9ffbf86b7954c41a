"""The video of one drone: viewers of its streams, and the messages to and from its agent. Pure."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

from server.link.core.agent_link import AgentLink
from server.link.core.token_bucket import TokenBucket
from server.video.core.clock_offset import ClockOffset
from server.video.core.elsewhere import VideoElsewhere
from server.video.core.situation import Known, VideoSituation, situation_of
from server.video.core.streams import Relayed, Stream, StreamKey, StreamSink
from server.video.core.viewer import LockstepGroup, Recipient
from wire.ids import UserId
from wire.video import VIDEO, ClockProbe, Codec, StreamRequest, VideoState, VideoWanted

LINGER_S: Final = 3.0
"""A stream continues this long after its last viewer leaves, so that a viewer who returns does not restart it."""
SILENT_AFTER_S: Final = 2.0
"""Without a picture for this long (or for four intervals of a slow stream) the stream is not live."""
ASK_KEY_EVERY_S: Final = 1.0
BYTES_PER_S: Final = 4_000_000.0
BYTES_BURST: Final = 12_000_000.0
UNITS_PER_S: Final = 400.0
UNITS_BURST: Final = 1_200.0
"""All qualities with both codecs are some 800 kB and 130 units a second."""


class AgentVideoChannel(Protocol):
    """The WebSocket on which an agent sends its units; or the bus, for a drone of another tower."""

    def ask_key(self, key: StreamKey) -> None:
        """Asks for a key picture of this stream."""

    def close(self, code: int, why: str) -> None:
        """Ends it."""


@dataclass
class Flow:
    """One stream, and who takes it. `sinks`: whether each has had its first key picture."""

    stream: Stream = field(default_factory=Stream)
    viewers: dict[int, Recipient] = field(default_factory=dict)
    """All of them."""
    lockstep_groups: list[LockstepGroup] = field(default_factory=list)
    alone: dict[int, Recipient] = field(default_factory=dict)
    """Viewers in no lockstep group."""
    sinks: dict[StreamSink, bool] = field(default_factory=dict)
    lingers_until: float = float("-inf")
    unit_at: float = float("-inf")
    """When the newest unit came."""
    silent_after_s: float = SILENT_AFTER_S
    wanted_since: float = float("-inf")
    key_asked_at: float = float("-inf")
    size: tuple[int, int] = (0, 0)
    """Of the newest picture."""
    rate_hz: float = 0.0
    bits_per_s: int = 0
    reported: VideoSituation | None = None
    """The state last sent to its viewers."""

    @property
    def taken(self) -> bool:
        """Whether it has viewers now."""
        return bool(self.viewers or self.sinks)

    def record(self, unit: Relayed, now: float) -> None:
        """To those who take everything, from a key picture on."""
        for sink, has_key in list(self.sinks.items()):
            if has_key or unit.head.key:
                self.sinks[sink] = True
                sink.unit(unit.message, unit.head, now)

    def leave_lockstep(self, viewer: Recipient) -> None:
        """Out of its lockstep group, if it is in one: what it was sent is on its account from here on."""
        lockstep = viewer.lockstep
        if lockstep is not None:
            lockstep.leave(viewer)
            self.left_lockstep(viewer)

    def left_lockstep(self, viewer: Recipient) -> None:
        """It has left its lockstep group."""
        lockstep, viewer.lockstep = viewer.lockstep, None
        self.alone[viewer.number] = viewer
        if lockstep is not None and not len(lockstep) and not lockstep.is_due:
            self.lockstep_groups.remove(lockstep)

    def join_lockstep(self, viewer: Recipient, now: float) -> None:
        """Into a lockstep group, if it is in step and there is a place."""
        if viewer.lockstep is not None or not viewer.is_in_step(now):
            return
        lockstep = next((one for one in self.lockstep_groups if one.has_place()), None)
        if lockstep is None:
            lockstep = LockstepGroup(self.stream, self.left_lockstep)
            self.lockstep_groups.append(lockstep)
        lockstep.join(viewer)
        viewer.lockstep = lockstep
        del self.alone[viewer.number]

    def is_live(self, now: float) -> bool:
        """Whether pictures come."""
        return now - self.unit_at <= self.silent_after_s


class DroneVideo:
    """One for each drone that has a camera, or is watched. `new_ticket`: another one each time."""

    def __init__(self, name: str, new_ticket: Callable[[], str]) -> None:
        self.name = name
        self.flows: dict[StreamKey, Flow] = {}
        self.link: AgentLink | None = None
        self.ticket = ""
        self.state: VideoState | None = None
        self.channel: AgentVideoChannel | None = None
        self.clock = ClockOffset()
        """Of whoever sends the units."""
        self.elsewhere: VideoElsewhere | None = None
        """Another tower has the drone: what that one says. None: this one asks the agent itself."""
        # Of the drone, and not of its channel: a flood that is cut off does not go on by coming again.
        self._bytes = TokenBucket(BYTES_PER_S, BYTES_BURST, float("-inf"))
        self._units = TokenBucket(UNITS_PER_S, UNITS_BURST, float("-inf"))
        self._new_ticket = new_ticket
        self._wanted: tuple[StreamKey, ...] = ()

    @property
    def takes_video(self) -> bool:
        """Whether the agent has a camera, by its hello."""
        return self.link is not None and VIDEO in self.link.takes

    @property
    def wanted(self) -> tuple[StreamKey, ...]:
        """The streams requested from the agent."""
        return self._wanted

    def is_idle(self, now: float) -> bool:
        """Whether there is nothing to remember, a flood neither."""
        return not self.takes_video and not self.flows and self._bytes.is_full(now) and self._units.is_full(now)

    def linked(self, link: AgentLink | None, now: float) -> None:
        """Another link, or none: what was known of the last one's clock, camera and channel is over."""
        self.link = link
        self._begin_again("the agent's link has ended", now)
        self.ticket = self._new_ticket() if self.takes_video else ""
        self.send_wanted()

    def moved(self, elsewhere: VideoElsewhere | None, now: float) -> None:
        """Another tower has the drone, or none has it any more. Not for one with a link."""
        self._begin_again("the drone is at another tower", now)
        self.elsewhere = elsewhere

    def _begin_again(self, why: str, now: float) -> None:
        self.state, self.clock, self.elsewhere = None, ClockOffset(), None
        self.end_channel(why)
        for flow in self.flows.values():
            flow.unit_at, flow.wanted_since = float("-inf"), now
            flow.stream.broken()

    def end_channel(self, why: str, code: int = 4401) -> None:
        """The video channel that there is, if any."""
        channel, self.channel = self.channel, None
        if channel is not None:
            channel.close(code, why)

    def may_send(self, unit_bytes: int, now: float) -> bool:
        """Whether its agent may send one more unit; it counts as sent."""
        return self._units.take(1.0, now) and self._bytes.take(unit_bytes, now)

    def flow(self, key: StreamKey, now: float) -> Flow:
        """A requested stream."""
        flow = self.flows.get(key)
        if flow is None:
            flow = self.flows[key] = Flow(wanted_since=now)
            self._check_wanted()
        return flow

    @property
    def codecs(self) -> tuple[Codec, ...]:
        """Those that can be requested, as far as is known."""
        if self.elsewhere is not None:
            return self.elsewhere.codecs
        return () if self.state is None else self.state.codecs

    def bars(self, user_id: UserId) -> bool:
        """Whether the tower that has the drone does not let them watch."""
        return self.elsewhere is not None and self.elsewhere.barred == user_id

    def ask_key(self, key: StreamKey, now: float) -> None:
        """Asks for a key picture, not too often."""
        flow = self.flows[key]
        if self.channel is not None and now - flow.key_asked_at >= ASK_KEY_EVERY_S:
            flow.key_asked_at = now
            self.channel.ask_key(key)

    def attach(self, sink: StreamSink, now: float) -> None:
        """From the newest key picture on, every unit of its stream."""
        key = StreamKey(sink.quality, sink.codec)
        flow = self.flow(key, now)
        flow.sinks[sink] = bool(flow.stream.group)
        sink.state(self.situation(key, now))
        for unit in flow.stream.group:
            sink.unit(unit.message, unit.head, unit.at)

    def end_sinks(self, why: str) -> None:
        """Nothing comes any more."""
        for flow in self.flows.values():
            sinks, flow.sinks = list(flow.sinks), {}
            for sink in sinks:
                sink.ended(why)

    def send_wanted(self) -> None:
        """Sends the wanted streams to the agent, whatever was sent before."""
        self._wanted = tuple(sorted(self.flows))
        if self.link is not None and self.takes_video:
            self.link.post(VideoWanted(ticket=self.ticket, streams=tuple(StreamRequest(*key) for key in self._wanted)))

    def _check_wanted(self) -> None:
        if tuple(sorted(self.flows)) != self._wanted:
            self.send_wanted()

    def tick(self, now: float) -> None:
        """Called several times a second: ends streams without viewers, detects silent ones, probes the clock."""
        for key, flow in list(self.flows.items()):
            if flow.taken:
                flow.lingers_until = now + LINGER_S
            elif now >= flow.lingers_until:
                del self.flows[key]
                continue
            if flow.stream.group and not flow.is_live(now):
                flow.stream.broken()  # a new viewer must not see an old picture
        self._check_wanted()
        if self._wanted and self.takes_video:
            self._probe(now)

    def _probe(self, now: float) -> None:
        number = self.clock.probe(now) if self.link is not None else None
        if self.link is not None and number is not None:
            self.link.send_newest(ClockProbe(number=number), now)

    def situation(self, key: StreamKey, now: float) -> VideoSituation:
        """How it is with one stream."""
        flow = self.flows.get(key)
        live = flow is not None and flow.is_live(now)
        asked_for_s = 0.0 if flow is None else now - max(flow.wanted_since, flow.unit_at)
        if self.elsewhere is not None:
            return self.elsewhere.situation(self.name, key, live=live, asked_for_s=asked_for_s)
        known = Known(
            name=self.name,
            linked=self.link is not None,
            takes_video=self.takes_video,
            state=self.state,
            live=live,
            asked_for_s=asked_for_s,
        )
        return situation_of(known, key.codec)

    def send_situation(self, now: float) -> None:
        """To all who take a stream, where it has changed."""
        for key, flow in self.flows.items():
            if not flow.taken:
                flow.reported = None
                continue
            situation = self.situation(key, now)
            if situation != flow.reported:
                flow.reported = situation
                for viewer in flow.viewers.values():
                    viewer.situation(situation)
                for sink in list(flow.sinks):
                    sink.state(situation)
