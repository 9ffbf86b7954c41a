"""Video in the hub: requests to agents, tickets, clocks and codecs."""

import pytest
from video_relay_scene import MEDIUM, ONE, FakeViewer, Scene, streams_of, unit

from server.video.core.drone_video import LINGER_S
from wire.video import (
    ClockAnswer,
    Quality,
)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_an_agent_is_asked_while_somebody_watches_and_a_little_longer(scene: Scene) -> None:
    assert [streams_of(one) for one in scene.wanted] == [[]]
    viewer = FakeViewer(scene, 1)
    assert streams_of(scene.wanted[-1]) == [MEDIUM]
    scene.wait(1)
    scene.video.leave(viewer.viewer)
    scene.wait(LINGER_S - 0.5)
    again = FakeViewer(scene, 1)
    assert len(scene.wanted) == 2
    scene.video.leave(again.viewer)
    scene.wait(LINGER_S + 0.5)
    assert streams_of(scene.wanted[-1]) == []
    assert {one.ticket for one in scene.wanted} == {scene.wanted[0].ticket}


def test_a_new_link_has_a_new_ticket_and_the_old_one_opens_nothing(scene: Scene) -> None:
    FakeViewer(scene, 1)
    scene.open_channel()
    old, channel = scene.wanted[-1].ticket, scene.channel
    scene.link_up(12)
    assert channel.closed[0][0] == 4401
    assert scene.video.drone_of_ticket(old) is None
    assert scene.wanted[-1].ticket != old
    assert streams_of(scene.wanted[-1]) == [MEDIUM]
    scene.hub.detach_link(scene.agent.link)
    assert scene.video.drone_of_ticket(scene.wanted[-1].ticket) is None
    assert scene.video.drone_of_ticket("") is None


def test_units_of_nobodys_stream_or_of_a_channel_that_was_replaced_go_nowhere(scene: Scene) -> None:
    viewer = FakeViewer(scene, 1)
    scene.open_channel()
    old = scene.channel
    scene.open_channel()
    assert old.closed[0][0] == 4409
    new, scene.channel = scene.channel, old
    scene.send(unit(0, key=True))
    scene.channel = new
    scene.send(unit(0, key=True, quality=Quality.HIGH))
    assert viewer.units == []
    assert scene.video.traffic.dropped == {"unwanted": 2}
    scene.send(unit(1))
    assert scene.channel.keys == [MEDIUM]
    scene.send(unit(2, key=True))
    assert viewer.sequences == [2]


def test_the_time_of_capture_is_by_the_towers_clock_once_it_is_known(scene: Scene) -> None:
    viewer = FakeViewer(scene, 1)
    scene.open_channel()
    scene.send(unit(0, key=True))
    assert viewer.units[-1].capture_us == 0
    scene.video._drones[ONE].clock._asked[5] = scene.now - 0.02
    scene.video.clock_answered(scene.agent.link, ClockAnswer(number=5, at_us=1_000_000), scene.now)
    scene.send(unit(1, capture_us=1_000_000))
    assert abs(viewer.units[-1].capture_us - (scene.now - 0.01) * 1e6) < 10


@pytest.mark.parametrize(("clock_us", "capture_us"), [(2**62, 2**64 - 1), (1, 2**64 - 1)])
def test_a_clock_that_cannot_be_right_is_not_known(scene: Scene, clock_us: int, capture_us: int) -> None:
    viewer = FakeViewer(scene, 1)
    scene.open_channel()
    scene.video._drones[ONE].clock._asked[5] = scene.now - 0.02
    scene.video.clock_answered(scene.agent.link, ClockAnswer(number=5, at_us=clock_us), scene.now)
    scene.send(unit(0, key=True, capture_us=capture_us))
    assert viewer.units[-1].capture_us == 0
