"""The video of this tower's drones for people at other towers: one recipient for each stream and tower.

A tower is a viewer who is never calm: it gets the newest group of pictures from the key picture on, confirms what has
arrived, and is sent nothing old (server.video.core.pacing). What it is not sent in time it never gets, so a tower that
reads slowly delays neither another one nor itself. Judges nobody: the tower of the viewer does, which has the same
fleet, and is told whom the controls bar. No I/O; takes `now`.
"""

from collections import Counter
from collections.abc import Callable
from typing import Final, Protocol

from server.live.hub import Hub
from server.towers.core.place import Place
from server.towers.core.video_messages import (
    StreamTold,
    UnitsArrived,
    UnitSent,
    VideoMessage,
    VideoTold,
    WantKey,
    WantVideo,
)
from server.video.core.pacing import ViewerPace
from server.video.core.situation import VideoSituation
from server.video.core.streams import StreamKey
from server.video.core.traffic import VideoTraffic
from server.video.core.viewer import Recipient
from server.video.core.viewer_messages import Drawn
from server.video.core.websocket_bytes import payload_of
from wire.ids import DroneId

EXPIRES_AFTER_S: Final = 3.0
"""A tower says every second what it wants. One that does not is dead, or cannot be heard."""
UNCONFIRMED_S: Final = 1.0
"""The bus may lose a confirmation. After this the tower gets the newest key picture, as at its beginning."""
BYTES_PER_S: Final = 12_500_000
"""Of video to one tower: 60 streams of the highest quality. Beyond it pictures are left out."""
BURST_BYTES: Final = BYTES_PER_S // 4
MAX_DRONES: Final = 1_000
"""Whose video one tower may take at the same time."""


class Bus(Protocol):
    """The way to the other towers, as far as video goes."""

    def send(self, tower: str, message: VideoMessage) -> None:
        """Sends a message, or drops it."""

    def has_room(self) -> bool:
        """False while the bus does not take what waits."""


class _Budget:
    """What one tower may be sent still."""

    def __init__(self, now: float) -> None:
        self.left = float(BURST_BYTES)
        self._at = now

    def refill(self, now: float) -> None:
        self.left = min(float(BURST_BYTES), self.left + (now - self._at) * BYTES_PER_S)
        self._at = now


class TowerRecipient(Recipient):
    """Another tower, for one stream. `told`: how it is with it now."""

    def __init__(
        self,
        number: int,
        drone_id: DroneId,
        key: StreamKey,
        *,
        write: Callable[[bytes], None],
        has_room: Callable[[], bool],
        told: Callable[[], None],
        traffic: VideoTraffic,
    ) -> None:
        super().__init__(number, drone_id, key, write=write, has_room=has_room)
        self.newest: VideoSituation | None = None
        self._told = told
        self._traffic = traffic
        self._counted = 0

    def pump(self, traffic: VideoTraffic, now: float) -> None:
        """Counts apart from the viewers of this tower."""
        super().pump(self._traffic, now)

    def situation(self, situation: VideoSituation) -> None:
        """Needs no room: it is short, and is said again every second."""
        self._tell(situation)

    def _tell(self, situation: VideoSituation) -> None:
        self.newest = situation
        self._told()

    def tick(self, now: float) -> None:
        """Several times a second."""
        self._traffic.skipped += self.pace.skipped - self._counted
        self._counted = self.pace.skipped
        if self.pace.silent_for(now) > UNCONFIRMED_S:
            self.begin_again(now)

    def begin_again(self, now: float) -> None:
        """From the newest key picture on."""
        if self.stream is not None:
            self.pace, self._counted = ViewerPace(), 0
            self.pace.watch(self.stream, now)
            self.pump(self._traffic, now)


class _Export:
    """One drone for one tower."""

    def __init__(self) -> None:
        self.expires_at = 0.0
        self.recipients: dict[StreamKey, TowerRecipient] = {}
        self.said: VideoTold | None = None
        self.is_changing = False


class VideoExports:
    """One for a tower. `is_heard`: whether that tower is within reach."""

    def __init__(self, hub: Hub, bus: Bus, *, is_heard: Callable[[str], bool]) -> None:
        self._hub = hub
        self._bus = bus
        self._is_heard = is_heard
        self._exports: dict[tuple[str, DroneId], _Export] = {}
        self._budgets: dict[str, _Budget] = {}
        self.traffic = VideoTraffic()
        hub.video.on_rights = self._rights_changed

    def streams(self) -> int:
        """So many are sent to other towers."""
        return sum(len(one.recipients) for one in self._exports.values())

    def heard(self, tower: str, message: VideoMessage, now: float) -> None:
        """A tower says what its people see."""
        match message:
            case WantVideo():
                self._want(tower, message, now)
            case UnitsArrived():
                for unit in message.units:
                    recipient = self._recipient(tower, unit.drone_id, StreamKey(unit.quality, unit.codec))
                    if recipient is not None:
                        self._hub.video.got(recipient, Drawn(unit.sequence, held_ms=unit.held_ms), now)
            case WantKey():
                recipient = self._recipient(tower, message.drone_id, StreamKey(message.quality, message.codec))
                if recipient is not None:
                    recipient.begin_again(now)
            case _:
                pass

    def tick(self, now: float) -> None:
        """Ten times a second."""
        for budget in self._budgets.values():
            budget.refill(now)
        for (tower, drone_id), export in list(self._exports.items()):
            drone = self._hub.state.drones.get(drone_id)
            is_here = drone is not None and drone.place is Place.HERE
            if now >= export.expires_at or not is_here or not self._is_heard(tower):
                self._end(tower, drone_id)
                continue
            for recipient in export.recipients.values():
                recipient.tick(now)

    def _recipient(self, tower: str, drone_id: int, key: StreamKey) -> TowerRecipient | None:
        export = self._exports.get((tower, DroneId(drone_id)))
        return None if export is None else export.recipients.get(key)

    def _want(self, tower: str, message: WantVideo, now: float) -> None:
        drone_id = DroneId(message.drone_id)
        drone = self._hub.state.drones.get(drone_id)
        if not message.streams or drone is None or drone.place is not Place.HERE or not self._is_heard(tower):
            self._end(tower, drone_id)
            return
        export = self._exports.get((tower, drone_id))
        if export is None:
            if Counter(one for one, _ in self._exports)[tower] >= MAX_DRONES:
                return
            export = self._exports[tower, drone_id] = _Export()
        export.expires_at = now + EXPIRES_AFTER_S
        export.is_changing = True
        wanted = {one.key: one.people for one in message.streams}
        for key in [key for key in export.recipients if key not in wanted]:
            self._release(export.recipients.pop(key))
        for key, people in wanted.items():
            if key not in export.recipients:
                recipient = export.recipients[key] = self._new_recipient(tower, drone_id, key, export, now)
                self._hub.video.serve(recipient, now)
            export.recipients[key].people = people
        export.is_changing = False
        probe, at_us = message.probe, round(now * 1e6) if message.probe else 0
        self._say(tower, drone_id, export, probe=probe, at_us=at_us, anyway=True)

    def _new_recipient(
        self, tower: str, drone_id: DroneId, key: StreamKey, export: _Export, now: float
    ) -> TowerRecipient:
        budget = self._budgets.setdefault(tower, _Budget(now))

        def write(framed: bytes) -> None:
            budget.left -= len(framed)
            self._bus.send(tower, UnitSent(drone_id, payload_of(framed)))

        return TowerRecipient(
            self._hub.video.next_number(),
            drone_id,
            key,
            write=write,
            has_room=lambda: budget.left > 0 and self._bus.has_room(),
            told=lambda: self._say(tower, drone_id, export),
            traffic=self.traffic,
        )

    def _say(
        self,
        tower: str,
        drone_id: DroneId,
        export: _Export,
        *,
        probe: int = 0,
        at_us: int = 0,
        anyway: bool = False,
    ) -> None:
        drone = self._hub.state.drones.get(drone_id)
        if drone is None or export.is_changing:
            return
        streams = [
            StreamTold(*key, one.newest.condition, one.newest.words, list(one.newest.codecs))
            for key, one in export.recipients.items()
            if one.newest is not None
        ]
        said = VideoTold(drone_id, drone.no_video_user_id or 0, streams)
        if anyway or said != export.said:
            export.said = said
            self._bus.send(tower, VideoTold(drone_id, said.barred, streams, probe, at_us))

    def _rights_changed(self, drone_id: DroneId | None) -> None:
        for (tower, one), export in self._exports.items():
            if drone_id is None or one == drone_id:
                self._say(tower, one, export)

    def _end(self, tower: str, drone_id: DroneId) -> None:
        export = self._exports.pop((tower, drone_id), None)
        if export is not None:
            for recipient in export.recipients.values():
                self._release(recipient)
        if not any(one == tower for one, _ in self._exports):
            self._budgets.pop(tower, None)

    def _release(self, recipient: TowerRecipient) -> None:
        recipient.ended = True
        self._hub.video.release(recipient)
