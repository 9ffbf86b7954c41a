"""A hub with one drone that offers video, and fake viewers."""

import json
from collections.abc import Callable
from typing import Any

from hub_world import LATER, NAMES, FakeAgent, HubWorld

from server.kernel.people import Principal, Role
from server.video.core.streams import StreamKey
from server.video.core.viewer import VideoViewer
from server.video.core.viewer_messages import Drawn
from wire.control_messages import ToAgent
from wire.ids import DroneId, UserId
from wire.video import (
    VIDEO,
    Codec,
    Quality,
    Unit,
    VideoWanted,
    decode_unit,
    encode_unit,
)

ONE, TWO = DroneId(1), DroneId(2)

MEDIUM = StreamKey(Quality.MEDIUM, Codec.MPEG1)


def unit(sequence: int, *, key: bool = False, **fields: Any) -> bytes:
    values = Unit(Quality.MEDIUM, Codec.MPEG1, sequence, key, False, 77, 320, 240, 24.0, 450_000, 3, b"\x47" * 188)
    return encode_unit(values._replace(**fields))


class FakeViewer:
    """Reads at once and reports what it has drawn, unless told not to."""

    def __init__(self, scene: "Scene", user_id: int, drone_id: DroneId = ONE, key: StreamKey = MEDIUM) -> None:
        self.units: list[Unit] = []
        self.reported: list[dict[str, Any]] = []
        self.closed: list[tuple[int, str]] = []
        self.reads, self.draws = True, True
        self._scene = scene
        role = Role.ADMIN if user_id == 9 else Role.OPERATOR
        principal = Principal(UserId(user_id), NAMES[user_id], role, user_id, LATER)
        self.viewer = VideoViewer(
            scene.video.next_number(),
            principal,
            drone_id,
            key,
            scene.now,
            write=self._write,
            send_text=lambda text: self.reported.append(json.loads(text)),
            has_room=lambda: self.reads,
            close=lambda code, why: self.closed.append((code, why)),
        )
        scene.video.enter(self.viewer, scene.now)

    def _write(self, message: bytes) -> None:
        head = {126: 4, 127: 10}.get(message[1], 2)
        self.units.append(decode_unit(message[head:]))
        if self.draws:
            self._scene.drawn.append((self.viewer, self.units[-1].sequence))

    @property
    def sequences(self) -> list[int]:
        return [one.sequence for one in self.units]

    @property
    def states(self) -> list[str]:
        return [one["state"] for one in self.reported if one["type"] == "state"]


class FakeChannel:
    def __init__(self) -> None:
        self.keys: list[StreamKey] = []
        self.closed: list[tuple[int, str]] = []

    def ask_key(self, key: StreamKey) -> None:
        self.keys.append(key)

    def close(self, code: int, why: str) -> None:
        self.closed.append((code, why))


class Scene:
    """Drone 1 has a camera."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.video = self.hub.video
        self.now = 100.0
        self.drawn: list[tuple[VideoViewer, int]] = []
        self.later: list[Callable[[float], None]] = []
        self.video.fan_out.later = self.later.append
        self.channel = FakeChannel()
        self.link_up(11)

    def link_up(self, link_id: int) -> None:
        self.agent = FakeAgent(self.hub, 1, link_id=link_id, now=self.now, takes={VIDEO})

    @property
    def wanted(self) -> list[VideoWanted]:
        return [one for one in self.agent.posted if isinstance(one, VideoWanted)]

    def open_channel(self) -> None:
        video = self.video.drone_of_ticket(self.wanted[-1].ticket)
        assert video is not None
        self.channel = FakeChannel()
        self.video.open_channel(video, self.channel)

    def send(self, *units: bytes) -> None:
        video = self.video.drone_of_ticket(self.wanted[-1].ticket)
        assert video is not None
        for one in units:
            self.video.unit(video, self.channel, one, self.now)
            self.draw()

    def draw(self) -> None:
        drawn, self.drawn = self.drawn, []
        for viewer, sequence in drawn:
            self.video.got(viewer, Drawn(sequence), self.now)

    def wait(self, seconds: float) -> None:
        until = self.now + seconds
        while self.now < until:
            self.now += 0.1
            self.hub.tick(self.now)


def streams_of(message: ToAgent) -> list[tuple[Quality, Codec]]:
    assert isinstance(message, VideoWanted)
    return [(one.quality, one.codec) for one in message.streams]
