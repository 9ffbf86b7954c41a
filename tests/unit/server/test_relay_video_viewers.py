"""Video in the hub: who receives units, slow viewers, and when viewers are removed."""

from dataclasses import replace

import pytest
from hub_world import FakeAgent, record
from video_relay_scene import MEDIUM, ONE, TWO, FakeViewer, Scene, streams_of, unit

from server.kernel.people import UserRef
from server.live.live_drone import LeaseView
from server.video.core.drone_video import LINGER_S
from server.video.core.fan_out import AT_ONCE
from server.video.core.situation import VideoCondition, VideoSituation
from server.video.core.streams import StreamKey
from server.video.core.viewer import DEAF_AFTER_S
from server.video.core.viewer_messages import MalformedVideoRequest, streams_named
from wire.ids import DroneId, Epoch, UserId
from wire.video import (
    HEADER_BYTES,
    CameraState,
    Codec,
    Quality,
    UnitHead,
    VideoState,
    decode_unit,
)


class FakeSink:
    quality, codec = MEDIUM

    def __init__(self) -> None:
        self.units: list[int] = []
        self.states: list[VideoCondition] = []
        self.why_ended: list[str] = []

    def unit(self, message: bytes, head: UnitHead, now: float) -> None:
        assert decode_unit(message).sequence == head.sequence
        self.units.append(head.sequence)

    def state(self, situation: VideoSituation) -> None:
        self.states.append(situation.condition)

    def ended(self, why: str) -> None:
        self.why_ended.append(why)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_of_many_viewers_some_are_written_to_at_once_and_the_others_later(scene: Scene) -> None:
    viewers = [FakeViewer(scene, 9) for _ in range(2 * AT_ONCE + 1)]
    scene.open_channel()
    scene.send(unit(0, key=True))
    assert sum(bool(one.units) for one in viewers) == AT_ONCE
    while scene.later:
        scene.later.pop()(scene.now)
    assert all(one.sequences == [0] for one in viewers)
    assert len({id(one) for one in viewers}) == scene.video.traffic.units_out == 2 * AT_ONCE + 1


def test_who_is_written_to_later_gets_what_has_come_meanwhile_once_and_in_order(scene: Scene) -> None:
    viewers = [FakeViewer(scene, 9) for _ in range(AT_ONCE + 3)]
    scene.open_channel()
    scene.send(unit(0, key=True), unit(1), unit(2))
    while scene.later:
        scene.later.pop()(scene.now)
        scene.draw()
    scene.send(unit(3))
    while scene.later:
        scene.later.pop()(scene.now)
        scene.draw()
    assert [one.sequences for one in viewers] == [[0, 1, 2, 3]] * len(viewers)


def test_a_flood_is_remembered_when_nothing_else_is(scene: Scene) -> None:
    scene.open_channel()
    video = scene.video.drone_of_ticket(scene.wanted[-1].ticket)
    assert video is not None
    while video.may_send(1_000_000, scene.now):
        pass
    scene.hub.detach_link(scene.agent.link)
    scene.wait(0.5)
    scene.link_up(12)
    again = scene.video.drone_of_ticket(scene.wanted[-1].ticket)
    assert again is video and not again.may_send(11_000_000, scene.now)
    scene.hub.detach_link(scene.agent.link)
    scene.wait(4.0)
    scene.link_up(13)
    forgiven = scene.video.drone_of_ticket(scene.wanted[-1].ticket)
    assert forgiven is not None and forgiven is not video and forgiven.may_send(11_000_000, scene.now)


def test_who_is_shut_out_gets_nothing_more_from_that_instant(scene: Scene) -> None:
    viewers = [FakeViewer(scene, 1) for _ in range(2 * AT_ONCE)]
    scene.open_channel()
    scene.send(unit(0, key=True))
    alice, admin = UserRef(UserId(1), "alice"), UserRef(UserId(9), "admin")
    lease = LeaseView(admin, alice, Epoch(5), video_moved=True)
    scene.hub.apply_lease(ONE, lease, event="taken", by=admin, reason="", now=scene.now)
    while scene.later:
        scene.later.pop()(scene.now)
    assert sum(bool(one.units) for one in viewers) == AT_ONCE
    assert {one.closed[0][0] for one in viewers} == {4403}
    assert scene.video.count()[0] == 0
    scene.hub.apply_lease(ONE, replace(lease, offered=True, epoch=Epoch(6)), event="given", by=admin, reason="", now=0)
    again = FakeViewer(scene, 1)
    assert again.closed == []
    assert again.sequences == [0]


def test_sessions_users_and_the_end_of_the_tower_end_viewers(scene: Scene) -> None:
    alice, admin = FakeViewer(scene, 1), FakeViewer(scene, 9)
    assert scene.hub.sockets_of(9) == 1
    scene.hub.end_sessions([1])
    assert [code for code, _ in alice.closed] == [4401]
    scene.hub.end_user(UserId(9), "the account was disabled")
    assert admin.closed == [(4401, "the account was disabled")]
    last = FakeViewer(scene, 9)
    scene.hub.close_all()
    assert last.closed[0][0] == 1001


def test_a_sink_gets_everything_from_a_key_on(scene: Scene) -> None:
    scene.video.attach(ONE, early := FakeSink(), scene.now)
    assert streams_of(scene.wanted[-1]) == [MEDIUM]
    scene.open_channel()
    scene.send(unit(4), unit(5, key=True), unit(6), unit(7))
    scene.video.attach(ONE, late := FakeSink(), scene.now)
    scene.send(unit(8), unit(20), unit(21), unit(22, key=True), unit(23))
    assert early.units == [5, 6, 7, 8, 22, 23]
    assert late.units == [5, 6, 7, 8, 22, 23]
    scene.video.update_state(scene.agent.link, VideoState(camera=CameraState.LOST))
    assert early.states[0] is VideoCondition.WAITING
    assert early.states[-1] is VideoCondition.CAMERA_LOST
    scene.video.detach(ONE, early)
    scene.send(unit(24, key=True))
    assert (early.units[-1], late.units[-1]) == (23, 24)
    scene.hub.close_all()
    assert (early.why_ended, len(late.why_ended)) == ([], 1)
    assert not scene.video.attach(DroneId(77), FakeSink(), scene.now)


def test_who_comes_when_pictures_have_stopped_sees_none_of_then(scene: Scene) -> None:
    first = FakeViewer(scene, 1)
    scene.open_channel()
    scene.video.update_state(scene.agent.link, VideoState(camera=CameraState.LIVE))
    scene.send(unit(0, key=True))
    assert first.states[-1] == "live"
    scene.wait(3)
    assert first.states[-1] == "waiting"
    late = FakeViewer(scene, 9)
    assert late.units == []
    scene.wait(8)
    assert late.states[-1] == "no-agent-video"
    assert "Drone 1" in late.reported[-1]["words"]
    scene.send(unit(1, key=True))
    assert (late.sequences, late.states[-1]) == ([1], "live")


def test_a_viewer_that_does_not_read_is_told_the_newest_only_and_one_that_is_deaf_is_ended(scene: Scene) -> None:
    viewer = FakeViewer(scene, 1)
    scene.open_channel()
    viewer.reads = False
    for camera in (CameraState.LOST, CameraState.LIVE, CameraState.LOST):
        scene.video.update_state(scene.agent.link, VideoState(camera=camera))
    scene.send(unit(0, key=True))
    assert viewer.states == ["waiting"]
    viewer.reads, viewer.draws = True, False
    scene.send(unit(1))
    assert viewer.states == ["waiting", "camera-lost"]
    assert viewer.sequences == [0]
    scene.wait(DEAF_AFTER_S + 1)
    assert viewer.closed[0][0] == 4408
    assert scene.video.count()[0] == 0


def test_what_was_skipped_is_told_once_a_second_and_counted(scene: Scene) -> None:
    viewer = FakeViewer(scene, 1)
    scene.open_channel()
    scene.send(unit(0, key=True))
    viewer.reads = False
    for number in range(1, 40):
        scene.now += 0.04
        scene.send(unit(number, key=number % 10 == 0))
    viewer.reads = True
    scene.send(unit(40, key=True))
    scene.wait(0.5)
    assert [one["count"] for one in viewer.reported if one["type"] == "skipped"] == [39]
    assert scene.video.traffic.skipped == 39
    assert viewer.sequences == [0, 40]


def test_nothing_is_remembered_of_drones_that_nobody_watches(scene: Scene) -> None:
    FakeAgent(scene.hub, 2, link_id=21, now=scene.now)
    scene.video.leave(FakeViewer(scene, 2, TWO).viewer)
    scene.wait(LINGER_S + 1)
    assert set(scene.video._drones) == {ONE}
    assert scene.video.count() == (0, 0)
    scene.hub.detach_link(scene.agent.link)
    scene.wait(1)
    assert scene.video._drones == {}
    assert scene.video._tickets == {}


def test_the_ticket_of_a_drone_that_was_removed_opens_nothing(scene: Scene) -> None:
    FakeViewer(scene, 1)
    scene.open_channel()
    ticket = scene.wanted[-1].ticket
    scene.world.apply(record(2, (2,)))
    scene.wait(1)
    assert scene.channel.closed
    assert scene.video.drone_of_ticket(ticket) is None
    assert (scene.video._drones, scene.video._tickets) == ({}, {})


def test_a_unit_costs_its_viewers_no_copy(scene: Scene) -> None:
    written: list[bytes] = []
    for _ in range(3):
        viewer = FakeViewer(scene, 9)
        viewer.viewer.write = written.append
    scene.open_channel()
    scene.send(unit(0, key=True))
    assert len({id(one) for one in written}) == 1
    assert len(written[0]) == 4 + HEADER_BYTES + 188


def test_of_several_codecs_the_first_that_the_agent_has_is_taken(scene: Scene) -> None:
    low = [StreamKey(Quality.LOW, codec) for codec in (Codec.H264, Codec.MPEG1)]
    assert scene.video.first_offered(ONE, low) == low[1], "nobody knows yet"
    assert scene.video.first_offered(DroneId(77), low) == low[1], "no such drone"
    for offered, taken in (((Codec.MPEG1,), low[1]), ((Codec.MPEG1, Codec.H264), low[0]), ((), low[1])):
        scene.video.update_state(scene.agent.link, VideoState(camera=CameraState.IDLE, codecs=offered))
        assert scene.video.first_offered(ONE, low) == taken


@pytest.mark.parametrize("codecs", ["", "av1", "mpeg1,av1", "mpeg1,h264,mpeg1", "h264,"])
def test_codecs_that_are_none_are_refused(codecs: str) -> None:
    with pytest.raises(MalformedVideoRequest):
        streams_named("low", codecs)
    assert streams_named("low", "h264,mpeg1") == [
        StreamKey(Quality.LOW, Codec.H264),
        StreamKey(Quality.LOW, Codec.MPEG1),
    ]
