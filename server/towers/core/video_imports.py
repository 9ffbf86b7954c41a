"""The video of other towers' drones for the viewers here: asks for what somebody watches, and passes it on.

Viewers here are judged and served like those of a drone of this tower. The drone's home is asked again every second, so
it stops by itself when this tower has died. No I/O; takes `now`.
"""

from collections import Counter, defaultdict
from collections.abc import Callable
from typing import Final, NamedTuple

from server.live.hub import Hub
from server.towers.core.place import Place
from server.towers.core.video_exports import Bus
from server.towers.core.video_messages import (
    Arrived,
    UnitsArrived,
    UnitSent,
    VideoMessage,
    VideoTold,
    WantedStream,
    WantKey,
    WantVideo,
)
from server.video.core.clock_offset import ClockOffset
from server.video.core.drone_video import DroneVideo
from server.video.core.elsewhere import OLDER_TOWER, OUT_OF_REACH, VideoElsewhere
from server.video.core.streams import StreamKey
from server.video.core.traffic import VideoTraffic
from wire.ids import DroneId, UserId
from wire.video import MalformedUnit

RENEW_EVERY_S: Final = 1.0
SILENT_AFTER_S: Final = 2.5
"""Without an answer for this long, the tower of the drone counts as out of reach for video."""
LATE_AFTER_S: Final = 0.5
"""A unit this late was kept somewhere while the bus stood still. It is dropped, and so is what depends on it."""


class _Source(NamedTuple):
    """Where the video of a drone comes from. `trouble`: why nothing can, as in VideoElsewhere."""

    tower: str
    trouble: str


class _HomeChannel:
    """Asks the drone's home for key pictures. Implements AgentVideoChannel."""

    def __init__(self, ask: Callable[[StreamKey], None]) -> None:
        self._ask = ask

    def ask_key(self, key: StreamKey) -> None:
        self._ask(key)

    def close(self, code: int, why: str) -> None:
        """Nothing to do: the service has forgotten it, and `tick` sees that."""


class _Import:
    """One drone of another tower."""

    def __init__(self, video: DroneVideo, source: _Source, channel: _HomeChannel, now: float) -> None:
        self.video = video
        self.source = source
        self.channel = channel
        self.elsewhere = VideoElsewhere(source.trouble)
        self.wanted: dict[StreamKey, int] = {}
        self.asked_at = float("-inf")
        self.answered_at = now


class VideoImports:
    """One for a tower. `home_of`: the tower that has a drone; `sends_video`: whether that tower's version can send
    video to others; `wake`: asks for a call of `confirm` in some hundredths of a second."""

    def __init__(
        self,
        hub: Hub,
        bus: Bus,
        *,
        home_of: Callable[[DroneId], str | None],
        sends_video: Callable[[str], bool],
        wake: Callable[[], None],
    ) -> None:
        self._hub = hub
        self._bus = bus
        self._home_of = home_of
        self._sends_video = sends_video
        self._wake = wake
        self._imports: dict[DroneId, _Import] = {}
        self._clocks: dict[str, ClockOffset] = {}
        self._arrived: defaultdict[str, dict[tuple[DroneId, StreamKey], tuple[int, float]]] = defaultdict(dict)
        self.traffic = VideoTraffic()
        self.dropped: Counter[str] = Counter()
        """Packets of video, by why."""
        hub.video.on_watched = self._watched

    def streams(self) -> int:
        """So many are asked for at other towers."""
        return sum(len(one.wanted) for one in self._imports.values())

    def heard(self, tower: str, message: VideoMessage, late_s: float, now: float) -> None:
        """A tower sends what it was asked for. `late_s`: by how much longer than usual that was under way."""
        if not isinstance(message, UnitSent | VideoTold):
            return
        one = self._imports.get(DroneId(message.drone_id))
        if one is None or one.source.tower != tower or one.video.elsewhere is not one.elsewhere:
            self.dropped["unwanted"] += 1
        elif isinstance(message, VideoTold):
            self._told(tower, one, message, now)
        elif late_s > LATE_AFTER_S:
            self.dropped["late"] += 1
        else:
            self._unit(tower, DroneId(message.drone_id), one, message.unit, now)

    def confirm(self, now: float) -> None:
        """Tells the other towers what has arrived."""
        for tower, units in self._arrived.items():
            told = [
                Arrived(drone_id, *key, sequence, min(10_000.0, (now - at) * 1000))
                for (drone_id, key), (sequence, at) in units.items()
            ]
            if told:
                self._bus.send(tower, UnitsArrived(told))
        self._arrived.clear()

    def tick(self, now: float) -> None:
        """Ten times a second."""
        watched = dict(self._hub.video.watched())
        for drone_id, one in list(self._imports.items()):
            if watched.get(drone_id) is not one.video:
                self._end(drone_id, now)
        for drone_id, video in watched.items():
            self._watched(drone_id, video, now)
        towers = {one.source.tower for one in self._imports.values()}
        for tower in [tower for tower in self._clocks if tower not in towers]:
            del self._clocks[tower]

    # -- inside --------------------------------------------------------------------------------------------------

    def _watched(self, drone_id: DroneId, video: DroneVideo, now: float) -> None:
        source = self._source_of(drone_id)
        one = self._imports.get(drone_id)
        if one is not None and (one.source != source or one.video.elsewhere is not one.elsewhere):
            self._end(drone_id, now)
            one = None
        if source is None:
            return
        if one is None:
            one = self._begin(drone_id, video, source, now)
        if not source.trouble:
            self._renew(drone_id, one, now)

    def _source_of(self, drone_id: DroneId) -> _Source | None:
        """None: of no other tower."""
        drone = self._hub.state.drones.get(drone_id)
        if drone is None or drone.link is not None or drone.place not in (Place.ELSEWHERE, Place.OUT_OF_REACH):
            return None
        home = self._home_of(drone_id)
        if home is None or drone.place is Place.OUT_OF_REACH:
            return _Source("", OUT_OF_REACH)
        return _Source(home, "" if self._sends_video(home) else OLDER_TOWER)

    def _begin(self, drone_id: DroneId, video: DroneVideo, source: _Source, now: float) -> _Import:
        channel = _HomeChannel(lambda key: self._bus.send(source.tower, WantKey(drone_id, *key)))
        one = self._imports[drone_id] = _Import(video, source, channel, now)
        video.moved(one.elsewhere, now)
        if not source.trouble:
            video.channel = channel
            video.clock = self._clocks.setdefault(source.tower, ClockOffset())
        video.send_situation(now)
        return one

    def _end(self, drone_id: DroneId, now: float) -> None:
        one = self._imports.pop(drone_id)
        if one.source.tower and one.wanted:
            self._bus.send(one.source.tower, WantVideo(drone_id, []))
        if one.video.elsewhere is one.elsewhere:
            one.video.moved(None, now)
            one.video.send_situation(now)

    def _renew(self, drone_id: DroneId, one: _Import, now: float) -> None:
        wanted = {key: len(flow.viewers) for key, flow in one.video.flows.items() if flow.viewers}
        for key in one.wanted:
            if key not in wanted and key in one.video.flows:
                one.video.flows[key].stream.broken()  # a viewer who returns must not see an old picture
        if wanted != one.wanted or now - one.asked_at >= RENEW_EVERY_S:
            one.wanted, one.asked_at = wanted, now
            streams = [WantedStream(*key, people) for key, people in sorted(wanted.items())]
            probe = self._clocks[one.source.tower].probe(now) or 0
            self._bus.send(one.source.tower, WantVideo(drone_id, streams, probe))
        if now - one.answered_at > SILENT_AFTER_S and not one.elsewhere.trouble:
            one.elsewhere.trouble = OUT_OF_REACH
            one.video.send_situation(now)

    def _told(self, tower: str, one: _Import, message: VideoTold, now: float) -> None:
        one.answered_at = now
        if message.probe:
            self._clocks[tower].answered(message.probe, message.at_us, now)
        told = {StreamKey(stream.quality, stream.codec): stream.situation for stream in message.streams}
        one.elsewhere.tell(told, UserId(message.barred) if message.barred else None)
        self._hub.video.told_elsewhere(one.video, now)

    def _unit(self, tower: str, drone_id: DroneId, one: _Import, unit: bytes, now: float) -> None:
        try:
            head = self._hub.video.unit(one.video, one.channel, unit, now, self.traffic)
        except MalformedUnit:
            self.dropped["malformed"] += 1
            return
        if not any(self._arrived.values()):
            self._wake()
        self._arrived[tower][drone_id, StreamKey(head.quality, head.codec)] = (head.sequence, now)
