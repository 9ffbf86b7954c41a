"""Video between two towers, without a bus: tower `a` has the drone, the viewers are at tower `b`."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from hub_world import HubWorld
from video_relay_scene import MEDIUM, ONE, FakeViewer, Scene, streams_of, unit

from server.towers.core.messages import MalformedPacket
from server.towers.core.place import Place
from server.towers.core.video_exports import BURST_BYTES, EXPIRES_AFTER_S, UNCONFIRMED_S, VideoExports
from server.towers.core.video_imports import LATE_AFTER_S, SILENT_AFTER_S, VideoImports
from server.towers.core.video_messages import (
    UnitsArrived,
    UnitSent,
    VideoMessage,
    VideoTold,
    WantedStream,
    WantKey,
    WantVideo,
    decode_video,
    encode_video,
    read_video_header,
)
from server.video.core.drone_video import LINGER_S
from server.video.core.viewer import VideoViewer
from server.video.core.viewer_messages import Drawn
from wire.ids import UserId
from wire.video import MAX_UNIT_BYTES, CameraState, Codec, Quality, VideoState

A, B = "aa" * 16, "bb" * 16
NATS_MAX_PAYLOAD = 1_000_000
B_AHEAD_S = 1_000.0
"""The clocks of two machines."""


class FarScene:
    """Tower b, as FakeViewer wants it."""

    def __init__(self) -> None:
        self.hub = HubWorld().hub
        self.video = self.hub.video
        self.now = 100.0 + B_AHEAD_S
        self.drawn: list[tuple[VideoViewer, int]] = []

    def draw(self) -> None:
        drawn, self.drawn = self.drawn, []
        for viewer, sequence in drawn:
            self.video.got(viewer, Drawn(sequence), self.now)


class Way:
    """One tower's way to the other. `loses`: which messages never arrive."""

    def __init__(self, sender: str) -> None:
        self.sender = sender
        self.sent: list[VideoMessage] = []
        self.room = True
        self.loses: Callable[[VideoMessage], bool] = lambda message: False
        self._packets: list[bytes] = []

    def send(self, tower: str, message: VideoMessage) -> None:
        self.sent.append(message)
        if not self.loses(message):
            self._packets.append(encode_video(self.sender, message, 0.0))

    def has_room(self) -> bool:
        return self.room

    def take(self) -> list[VideoMessage]:
        packets, self._packets = self._packets, []
        return [decode_video(read_video_header(packet).body) for packet in packets]


class Pair:
    def __init__(self) -> None:
        self.a, self.b = Scene(), FarScene()
        self.from_a, self.from_b = Way(A), Way(B)
        self.is_heard, self.sends_video, self.home = True, True, A
        self.b_lives = True
        self.late_s = 0.0
        self.exports = VideoExports(self.a.hub, self.from_a, is_heard=lambda tower: self.is_heard)
        self.imports = VideoImports(
            self.b.hub,
            self.from_b,
            home_of=lambda drone_id: self.home,
            sends_video=lambda tower: self.sends_video,
            wake=lambda: None,
        )
        self.place(Place.ELSEWHERE)

    def place(self, place: Place) -> None:
        self.b.hub.state.drones[ONE].place = place

    def exchange(self) -> None:
        """Until nobody has anything to say."""
        while True:
            to_b, to_a = self.from_a.take(), self.from_b.take()
            for message in to_b if self.b_lives else ():
                self.imports.heard(A, message, self.late_s, self.b.now)
            for message in to_a:
                self.exports.heard(B, message, self.a.now)
            if self.b_lives:
                self.imports.confirm(self.b.now)
                self.b.draw()
            if not (to_a or to_b):
                return

    def wait(self, seconds: float, *, step_s: float = 0.1) -> None:
        until = self.a.now + seconds
        while self.a.now < until - 1e-9:
            self.a.now += step_s
            self.b.now += step_s
            self.a.hub.tick(self.a.now)
            self.exports.tick(self.a.now)
            if self.b_lives:
                self.b.hub.tick(self.b.now)
                self.imports.tick(self.b.now)
            self.exchange()

    def send(self, *units: bytes) -> None:
        for one in units:
            self.a.send(one)
            self.exchange()

    def watch(self, user_id: int = 1) -> FakeViewer:
        viewer = FakeViewer(self.b, user_id)  # type: ignore[arg-type]
        self.exchange()
        return viewer

    @property
    def asked(self) -> list[tuple[Quality, Codec]]:
        return streams_of(self.a.wanted[-1])


@pytest.fixture
def pair() -> Pair:
    return Pair()


def test_the_camera_runs_while_somebody_watches_at_another_tower(pair: Pair) -> None:
    assert pair.asked == []
    viewer = pair.watch()
    assert pair.asked == [MEDIUM], "at once"
    pair.wait(5)
    assert pair.asked == [MEDIUM]
    assert (pair.exports.streams(), pair.imports.streams()) == (1, 1)
    pair.b.video.leave(viewer.viewer)
    pair.wait(LINGER_S + 0.5)
    assert pair.asked == []
    assert (pair.exports.streams(), pair.imports.streams()) == (0, 0)
    sent = len(pair.from_b.sent)
    pair.wait(3)
    assert len(pair.from_b.sent) == sent, "nothing is said while nobody watches"


@pytest.mark.parametrize("is_heard", [True, False], ids=["its renewal is missed", "its end is noticed"])
def test_the_camera_stops_when_the_viewers_tower_has_died(pair: Pair, is_heard: bool) -> None:
    pair.watch()
    pair.wait(1)
    pair.b_lives = False
    pair.is_heard = is_heard
    pair.wait((EXPIRES_AFTER_S if is_heard else 0.1) + LINGER_S + 0.3)
    assert pair.asked == []


def test_pictures_come_with_the_time_of_the_viewers_tower(pair: Pair) -> None:
    viewer = pair.watch()
    pair.a.open_channel()
    video = pair.a.video._drones[ONE]
    video.clock._asked[5] = pair.a.now
    video.clock.answered(5, 1_000_000, pair.a.now)
    pair.send(unit(0, key=True, capture_us=1_000_000), unit(1, capture_us=1_050_000))
    assert viewer.sequences == [0, 1]
    assert viewer.units[0].capture_us == round(pair.b.now * 1e6)
    assert viewer.states[-1] == "live"
    assert pair.imports.traffic.units_in == pair.exports.traffic.units_out == 2
    assert pair.b.video.traffic.units_in == pair.a.video.traffic.units_out == 0, "counted apart"


def test_what_is_watched_there_is_counted_and_told_here(pair: Pair) -> None:
    first, second = pair.watch(), pair.watch(9)
    flow = pair.a.video._drones[ONE].flows[MEDIUM]
    assert sum(one.people for one in flow.viewers.values()) == 2
    pair.a.video.update_state(pair.a.agent.link, VideoState(camera=CameraState.LOST, words="unplugged"))
    pair.exchange()
    assert (first.states[-1], second.states[-1]) == ("camera-lost", "camera-lost")
    assert "unplugged" in first.reported[-1]["words"]


def test_a_unit_that_the_bus_loses_costs_no_more_than_a_moment(pair: Pair) -> None:
    viewer = pair.watch()
    pair.a.open_channel()
    pair.send(unit(0, key=True), unit(1))
    pair.from_a.loses = lambda message: isinstance(message, UnitSent)
    pair.send(unit(2))
    pair.from_a.loses = lambda message: False
    pair.send(unit(3))
    assert WantKey(ONE, *MEDIUM) in pair.from_b.sent
    assert viewer.sequences == [0, 1, 0, 1, 2, 3], "the newest group again, from its key picture on"
    assert pair.a.channel.keys == [], "the agent is not troubled"


def test_a_tower_that_does_not_read_is_sent_nothing_old_and_goes_on_with_a_key(pair: Pair) -> None:
    viewer = pair.watch()
    beside = FakeViewer(pair.a, 1)
    pair.a.open_channel()
    pair.send(unit(0, key=True), unit(1))
    pair.from_a.room = False
    pair.send(*(unit(number) for number in range(2, 30)))
    pair.from_a.room = True
    pair.wait(0.5)
    pair.send(unit(30, key=True), unit(31))
    assert viewer.sequences == [0, 1, 30, 31]
    assert beside.sequences == list(range(32)), "the viewers of this tower notice nothing"
    pair.wait(0.2)
    assert pair.exports.traffic.skipped == 28


def test_more_than_a_tower_may_take_is_left_out(pair: Pair) -> None:
    pair.watch()
    pair.a.open_channel()
    large = b"\x47" * 200_000

    def sent() -> int:
        return sum(len(one.unit) for one in pair.from_a.sent if isinstance(one, UnitSent))

    for number in range(40):
        pair.send(unit(number, key=True, payload=large, bits_per_s=100_000_000))
    assert BURST_BYTES - 200_100 <= sent() <= BURST_BYTES + 200_100
    before = sent()
    pair.wait(0.1)
    pair.send(unit(40, key=True, payload=large, bits_per_s=100_000_000))
    assert sent() > before


def test_lost_confirmations_stop_the_pictures_for_a_second(pair: Pair) -> None:
    viewer = pair.watch()
    pair.a.open_channel()
    pair.from_b.loses = lambda message: isinstance(message, UnitsArrived)
    pair.send(unit(0, key=True), unit(1), unit(2))
    assert viewer.sequences == [0], "whether the way takes anything is not known"
    pair.from_b.loses = lambda message: False
    pair.wait(UNCONFIRMED_S + 0.3)
    pair.send(unit(3, key=True), unit(4))
    assert viewer.sequences[-2:] == [3, 4]


def test_late_units_are_dropped_and_what_depends_on_them(pair: Pair) -> None:
    viewer = pair.watch()
    pair.a.open_channel()
    pair.send(unit(0, key=True))
    pair.late_s = LATE_AFTER_S + 0.1
    pair.send(unit(1))
    pair.late_s = 0.0
    assert viewer.sequences == [0]
    assert pair.imports.dropped["late"] == 1


def test_whom_the_home_bars_sees_nothing_more_and_the_others_do(pair: Pair) -> None:
    alice, admin = pair.watch(1), pair.watch(9)
    pair.imports.heard(A, VideoTold(ONE, 1, []), 0.0, pair.b.now)
    assert alice.closed[0][0] == 4403
    assert admin.closed == []
    again = pair.watch(1)
    assert again.closed[0][0] == 4403
    assert pair.b.video._drones[ONE].bars(UserId(1))


def test_a_change_of_rights_is_told_at_once(pair: Pair) -> None:
    pair.watch()
    pair.from_a.sent.clear()
    pair.a.video.recheck(ONE)
    assert pair.from_a.sent == [], "nothing has changed"
    lease = pair.a.hub.state.drones[ONE].lease
    owner = pair.a.hub.state.drones[ONE].record.owners[0]
    pair.a.hub.state.drones[ONE].lease = replace(lease, taken_from=owner, video_moved=True)
    pair.a.video.recheck(ONE)
    assert [one.barred for one in pair.from_a.sent if isinstance(one, VideoTold)] == [owner.id]


def test_a_tower_out_of_reach_is_told_and_it_comes_back_by_itself(pair: Pair) -> None:
    viewer = pair.watch()
    pair.a.open_channel()
    pair.send(unit(0, key=True))
    pair.place(Place.OUT_OF_REACH)
    pair.wait(0.1)
    assert viewer.states[-1] == "offline"
    assert viewer.reported[-1]["words"] == "The tower that has Drone 1 is not within reach."
    pair.place(Place.ELSEWHERE)
    pair.wait(0.2)
    pair.send(unit(1, key=True))
    assert viewer.states[-1] == "live"
    assert viewer.sequences[-1] == 1


def test_a_home_that_does_not_answer_counts_as_out_of_reach(pair: Pair) -> None:
    viewer = pair.watch()
    pair.from_a.loses = lambda message: True
    pair.wait(SILENT_AFTER_S + 0.3)
    assert viewer.states[-1] == "offline"
    pair.from_a.loses = lambda message: False
    pair.wait(1.5)
    assert viewer.states[-1] == "waiting"


def test_an_older_tower_is_not_asked(pair: Pair) -> None:
    pair.sends_video = False
    viewer = pair.watch()
    assert viewer.states[-1] == "no-agent-video"
    assert "older version" in viewer.reported[-1]["words"]
    assert pair.from_b.sent == []


def test_a_drone_that_comes_here_is_asked_for_nowhere_else(pair: Pair) -> None:
    pair.watch()
    pair.wait(0.2)
    pair.place(Place.HERE)
    pair.wait(0.1)
    assert pair.from_b.sent[-1] == WantVideo(ONE, [])
    pair.wait(LINGER_S + 0.3)
    assert pair.asked == []
    assert pair.b.video._drones[ONE].elsewhere is None


def test_a_drone_that_has_left_is_sent_to_nobody(pair: Pair) -> None:
    pair.watch()
    pair.a.hub.state.drones[ONE].place = Place.ELSEWHERE
    pair.wait(0.1)
    assert pair.exports.streams() == 0


def test_a_stranger_among_the_towers_is_sent_nothing(pair: Pair) -> None:
    pair.is_heard = False
    pair.exports.heard("cc" * 16, WantVideo(ONE, [WantedStream(*MEDIUM, 1)]), pair.a.now)
    assert pair.exports.streams() == 0
    assert pair.from_a.sent == []


def test_the_largest_unit_fits_into_a_packet() -> None:
    assert len(encode_video(A, UnitSent(0xFFFFFFFF, bytes(MAX_UNIT_BYTES)), 0.0)) < NATS_MAX_PAYLOAD


@pytest.mark.parametrize("body", [b"", b"\x00", b"\x93\x00\x01\xc0", bytes(40)])
def test_what_no_tower_sends_is_not_understood(body: bytes) -> None:
    with pytest.raises(MalformedPacket):
        decode_video(body)
    with pytest.raises(MalformedPacket):
        read_video_header(body[:19])


def test_messages_survive_the_bus() -> None:
    told = VideoTold(7, 0, [], 3, 99)
    assert decode_video(read_video_header(encode_video(A, told, 5.0)).body) == told
    assert read_video_header(encode_video(A, told, 5.0))[:2] == (A, 5000)
