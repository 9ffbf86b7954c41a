"""The hub measures links: round trips, pings, late sticks and late commands."""

from dataclasses import replace

import pytest
from hub_world import (
    LATER,
    command_long,
    heartbeat,
    record,
    sticks,
)
from safety_scene import ALICE, BOB, ONE, Scene

from server.kernel.fleet import LoanRecord
from server.live import live_messages as live
from server.live.hub_events import RttTooLong
from server.live.live_drone import LeaseView
from wire.control_messages import (
    AutopilotState,
    SafetySettings,
)
from wire.dialect import build, decode, mavlink
from wire.drops import DropReason
from wire.ids import Epoch
from wire.tagged import split_tagged, stamp, tag


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_a_round_trip_that_stays_too_long_while_flying_by_hand_is_reported_once(scene: Scene) -> None:
    def beat(now: float, browser_rtt: float) -> None:
        scene.keep_alive(now)
        scene.agent.answer_pings(now)
        for event in scene.alice.events():
            if isinstance(event, live.Ping):
                scene.alice.browser.trip.pong(event.sequence, now + browser_rtt)
        scene.fly(now)

    for tenth in range(20):
        beat(tenth / 10, 0.1)
    assert scene.events == []
    for tenth in range(20, 60):
        beat(tenth / 10, 0.7)
    (event,) = scene.events
    assert isinstance(event, RttTooLong)
    assert 500 < event.rtt_ms < 1000


def test_while_somebody_has_the_controls_and_for_a_while_after_it_the_tower_pings_by_itself(scene: Scene) -> None:
    def tower_pings(now: float) -> bool:
        """Whether the tower schedules a ping of its own and sends it when due."""
        scene.keep_alive(now)
        keepalive = scene.agent.link.sealed.keepalive
        set_for = keepalive.next_ping_at
        scene.keep_alive(now + 0.51)
        return set_for <= now + 0.5 and keepalive.next_ping_at > set_for

    assert all(tower_pings(now) for now in (1.0, 1.6, 2.2))
    scene.lease(LeaseView(holder=None, taken_from=None, epoch=Epoch(2)), "revoked", 3.0)
    assert tower_pings(3.1), "a hold may be on its way"
    assert tower_pings(50.0)
    assert not any(tower_pings(70.0 + second) for second in range(3))
    scene.lease(LeaseView(holder=ALICE, taken_from=None, epoch=Epoch(3)), "acquired", 80.0)
    assert tower_pings(80.1)


def test_a_drone_that_nobody_flies_still_goes_offline_and_comes_back(scene: Scene) -> None:
    scene.lease(LeaseView(holder=None, taken_from=None, epoch=Epoch(2)), "released")
    for second in range(70):
        scene.keep_alive(float(second))
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None and drone.online
    assert drone.settled_lease is drone.lease, "it is looked at less"
    scene.hub.tick(72.0)
    assert drone.online
    scene.hub.tick(72.5)
    assert not drone.online
    scene.keep_alive(73.0)
    assert drone.online


def test_two_windows_of_one_pilot_do_not_fly_by_turns(scene: Scene) -> None:
    other = scene.world.browser(1)
    scene.fly(0.5)
    scene.fly(0.6, other)
    scene.fly(0.7)
    assert len(scene.agent.received()) == 2
    assert "other-hands" in scene.notices(other)
    assert scene.notices(scene.alice) == []
    # Commands from the other one pass, so it may hold; and once the first has stopped, it may fly.
    other.send(tag(ONE, command_long()), now=0.8)
    scene.fly(1.8, other)
    assert len(scene.agent.received()) == 2
    assert scene.notices(other) == []


def test_a_window_that_was_closed_does_not_keep_the_next_one_out(scene: Scene) -> None:
    scene.fly(0.5)
    scene.hub.detach_browser(scene.alice.browser, 0.6)
    scene.agent.received()
    scene.fly(0.7, scene.world.browser(1))
    assert len(scene.agent.received()) == 1


def test_a_clock_that_stood_still_makes_nothing_late_once_a_ping_is_answered(scene: Scene) -> None:
    """A laptop slept for 20 s: its stamps are 20 s behind from now on."""
    for now in range(1, 10):
        scene.keep_alive(now)
        scene.alice.send(stamp(now * 1000) + tag(ONE, sticks()), now=now + 0.05)
    scene.agent.received()
    for tenths in range(300, 320):
        now, slept = tenths / 10, tenths * 100 - 20_000
        scene.keep_alive(now)
        for event in scene.alice.events():
            if isinstance(event, live.Ping):
                scene.alice.browser.trip.pong(event.sequence, now + 0.02)
        scene.alice.send(stamp(slept) + tag(ONE, sticks()), now=now + 0.05)
    assert len(scene.agent.received()) >= 18


def test_late_sticks_and_late_commands_are_discarded_and_answered(scene: Scene) -> None:
    settings = SafetySettings(sticks_late_s=0.4, commands_late_s=2.0)
    scene.hub.changes.apply_safety(ONE, settings)
    assert scene.agent.posted[-1] == settings

    def send(frame: bytes, sent_s: float, now: float) -> None:
        scene.alice.send(stamp(int(sent_s * 1000)) + tag(ONE, frame), now=now)

    send(sticks(), 50.0, 1.0)
    send(sticks(), 50.1, 1.6)
    assert len(scene.agent.received()) == 1
    send(command_long(), 50.2, 2.0)
    assert len(scene.agent.received()) == 1
    scene.agent.send(heartbeat(), now=3.0)
    scene.agent.received()
    send(command_long(), 50.4, 3.6)
    assert scene.agent.received() == []
    assert scene.hub.state.drops[DropReason.LATE] == 2
    assert "late" in scene.notices(scene.alice)


@pytest.mark.parametrize("heard", [True, False])
def test_where_a_silent_autopilot_stands_is_not_where_it_was_armed(scene: Scene, heard: bool) -> None:
    scene.hub.reports.receive(scene.agent.link, AutopilotState(heard=heard, armed=False, airborne=False))
    lent = replace(record(1, (1,), holder=1, epoch=1), loans=(LoanRecord(BOB, LATER, True, 50.0, None),))
    scene.world.apply(lent, record(2, (2,)))
    place = mavlink.MAVLink_global_position_int_message(0, 470000000, 80000000, 500000, 0, 0, 0, 0, 0)
    scene.agent.send(build(place, system_id=1, component_id=1, sequence=0), now=0.1)
    scene.hub.tick(0.2)
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None
    assert (drone.home is not None) is heard


def test_a_refused_command_is_answered_in_mavlink_to_its_sender_alone(scene: Scene) -> None:
    admin = scene.world.browser(9)
    scene.alice.frames()
    admin.send(tag(ONE, command_long(22)))
    ((drone_id, frame),) = split_tagged(b"".join(admin.frames()))
    ack = decode(frame)
    assert ack is not None
    assert (drone_id, ack.command, ack.result) == (1, 22, 10)
    assert (ack.target_system, ack.target_component) == (255, 190)
    assert scene.alice.frames() == []
