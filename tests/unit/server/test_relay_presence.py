"""The hub notices that a holder has left or returned, which of several people flies, and who sees the drone."""

from dataclasses import replace
from unittest.mock import ANY

import pytest
from hub_world import (
    command_ack,
    command_long,
)
from safety_scene import ADMIN, ALICE, BOB, HELD, ONE, Scene

from server.control.core.holder_watch import GRACE_S, KEPT_FOR_S
from server.live import live_messages as live
from server.live.hub_events import HolderExpired, HolderGone, OfferLapsed, RightLost, TurnRequested
from server.live.live_drone import SILENT_AFTER_S, LeaseView
from wire.control_messages import (
    ControlChanged,
)
from wire.ids import Epoch, UserId
from wire.tagged import tag


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_a_holder_who_flew_by_hand_and_went_is_reported_after_2_s_and_expires_after_30(scene: Scene) -> None:
    scene.fly(0.5)
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=False)
    scene.hub.tick(2.9)
    assert scene.events == []
    scene.hub.tick(3.0)
    scene.hub.tick(3.1)
    assert scene.events == [HolderGone(ONE, UserId(1), 2.0)]
    scene.hub.tick(31.0)
    scene.hub.tick(31.1)
    assert scene.events[1:] == [HolderExpired(ONE, UserId(1))]


def test_the_agent_hears_that_the_holder_is_gone_before_it_hears_that_there_is_none(scene: Scene) -> None:
    """An expiry must not look like a deliberate release: the agent counts from the holder's absence."""
    scene.agent.posted.clear()
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    for second in range(2, 32):
        scene.hub.tick(float(second))
    assert HolderExpired(ONE, UserId(1)) in scene.events
    scene.lease(LeaseView(holder=None, taken_from=None, epoch=Epoch(2)), "expired", 31.5)
    reported = [one for one in scene.agent.posted if isinstance(one, ControlChanged)]
    assert [(one.holder, one.holder_present) for one in reported] == [("alice", False), (None, False)]
    assert reported[0].number < reported[1].number


def test_a_holder_who_went_while_a_mission_flew_is_no_reason_to_hold(scene: Scene) -> None:
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    scene.hub.tick(10.0)
    assert scene.events == []


def test_a_holder_who_is_back_in_time_is_not_reported(scene: Scene) -> None:
    scene.fly(0.5)
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    scene.hub.tick(2.0)
    scene.world.browser(1)
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=True)
    scene.hub.tick(40.0)
    assert scene.events == []


def test_a_program_without_a_live_channel_keeps_the_controls_for_as_long_as_it_says_so(scene: Scene) -> None:
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None
    for second in range(2, 90, 2):
        scene.hub.safety.keep(drone, ALICE.id, float(second))
        scene.hub.tick(second + 1.9)
        assert drone.somebody_flies()
    assert scene.events == []
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=True)
    scene.hub.tick(88.0 + KEPT_FOR_S)
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=False)
    scene.hub.tick(88.0 + KEPT_FOR_S + GRACE_S)
    assert scene.events == [HolderExpired(ONE, ALICE.id)]


def test_no_program_answers_for_sticks_or_for_another_holder(scene: Scene) -> None:
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None
    scene.fly(0.5)
    scene.hub.safety.keep(drone, ALICE.id, 0.9)
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    scene.hub.safety.keep(drone, ALICE.id, 2.9)
    scene.hub.tick(3.0)
    assert scene.events == [HolderGone(ONE, ALICE.id, 2.0)]
    scene.hub.safety.keep(drone, ALICE.id, 4.0)
    assert drone.somebody_flies()
    scene.lease(LeaseView(holder=BOB, taken_from=None, epoch=Epoch(2)), "acquired", 4.1)
    scene.hub.tick(4.2)
    assert not drone.somebody_flies()


def test_a_holder_whose_tab_has_frozen_counts_as_gone_and_is_back_with_the_next_answer(scene: Scene) -> None:
    """The connection stays open: only the pings show it."""

    def pass_time(until: float, *, answers: bool) -> None:
        while scene_now[0] < until:
            scene_now[0] += 0.25
            scene.hub.tick(scene_now[0])
            for event in scene.alice.events():
                if isinstance(event, live.Ping) and answers:
                    scene.alice.browser.trip.pong(event.sequence, scene_now[0] + 0.05)

    scene_now = [0.0]
    pass_time(10.0, answers=True)
    scene.agent.posted.clear()
    pass_time(10.0 + SILENT_AFTER_S - 0.5, answers=False)
    assert scene.agent.posted == []
    pass_time(10.0 + SILENT_AFTER_S + 1.0, answers=False)
    assert scene.agent.posted == [ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=False)]
    pass_time(18.0, answers=True)
    assert scene.agent.posted[1:] == [ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=True)]
    assert scene.events == []


def test_a_fence_stops_the_holder_at_once_and_is_lifted(scene: Scene) -> None:
    scene.hub.changes.fence(ONE)
    scene.fly(1.0)
    assert scene.agent.received() == []
    assert scene.notices(scene.alice) == ["not-in-control"]
    scene.hub.changes.unfence(ONE)
    scene.fly(1.1)
    assert len(scene.agent.received()) == 1


def test_a_new_lease_lifts_the_fence(scene: Scene) -> None:
    scene.hub.changes.fence(ONE)
    scene.lease(replace(HELD, epoch=Epoch(2)), "acquired")
    scene.fly(1.0)
    assert [epoch for epoch, _ in scene.agent.received()] == [2]


def test_assist_changes_turns_by_the_epoch_and_loses_no_command(scene: Scene) -> None:
    admin = scene.world.browser(9)
    assisted = replace(HELD, assistant=ADMIN, epoch=Epoch(2))
    scene.lease(assisted, "assisting")
    scene.fly(1.0)
    assert [epoch for epoch, _ in scene.agent.received()] == [2]
    # The admin's command requests the turn and waits for it; meanwhile all frames are refused.
    admin.send(tag(ONE, command_long(400)), now=1.1)
    scene.fly(1.11)
    assert scene.agent.received() == []
    assert scene.events == [TurnRequested(ONE, "assistant")]
    scene.lease(replace(assisted, epoch=Epoch(3)), "turn", now=1.12)
    assert scene.agent.received() == [(3, command_long(400))]
    reported = scene.agent.posted[-1]
    assert reported == ControlChanged(number=ANY, epoch=3, holder="alice", holder_present=True, assistant_flies=True)
    assert scene.notices(scene.alice) == ["assisted"]
    scene.fly(1.2)
    assert scene.agent.received() == []
    # One second after the last command of the admin the turn goes back.
    scene.keep_alive(2.0)
    assert len(scene.events) == 1
    scene.keep_alive(2.1)
    assert scene.events[1:] == [TurnRequested(ONE, "holder")]
    scene.lease(replace(assisted, epoch=Epoch(4)), "turn", now=2.11)
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=4, holder="alice", holder_present=True)
    scene.fly(2.2)
    assert [epoch for epoch, _ in scene.agent.received()] == [4]


def test_an_assistant_whose_last_browser_goes_assists_no_longer(scene: Scene) -> None:
    admin, second = scene.world.browser(9), scene.world.browser(9)
    scene.lease(replace(HELD, assistant=ADMIN, epoch=Epoch(2)), "assisting")
    scene.hub.detach_browser(admin.browser, 1.0)
    assert scene.events == []
    scene.hub.detach_browser(second.browser, 1.1)
    assert scene.events == [RightLost(ONE, UserId(9), "assistant", "the assistant's browser is gone")]


def test_a_command_that_waited_too_long_for_its_turn_is_not_executed(scene: Scene) -> None:
    admin = scene.world.browser(9)
    assisted = replace(HELD, assistant=ADMIN, epoch=Epoch(2))
    scene.lease(assisted, "assisting")
    admin.send(tag(ONE, command_long(400)), now=1.0)
    scene.lease(replace(assisted, epoch=Epoch(3)), "turn", now=2.5)
    assert scene.agent.received() == []


def test_an_operator_without_the_view_gets_no_frames_but_knows_the_drone(scene: Scene) -> None:
    scene.alice.frames()
    taken = LeaseView(holder=ADMIN, taken_from=ALICE, epoch=Epoch(2), view_taken=True)
    scene.lease(taken, "taken")
    (view,) = [event.drone for event in scene.alice.events() if isinstance(event, live.DroneChanged)]
    assert not view.may_watch
    scene.agent.send(command_ack())
    assert scene.alice.frames() == []
    assert scene.hub.squads.view(ONE, UserId(9), scene.world.browser(9).browser.viewer.role).may_watch  # type: ignore[union-attr]


def test_the_view_comes_back_with_the_offer_and_goes_with_it(scene: Scene) -> None:
    def sees(lease: LeaseView, event: str) -> bool:
        scene.lease(lease, event)
        (view,) = [event.drone for event in scene.alice.events() if isinstance(event, live.DroneChanged)]
        scene.alice.frames()
        scene.agent.send(command_ack())
        assert bool(scene.alice.frames()) is view.may_watch
        return view.may_watch

    taken = LeaseView(holder=ADMIN, taken_from=ALICE, epoch=Epoch(2), view_taken=True)
    assert not sees(taken, "taken")
    assert sees(replace(taken, offered=True, epoch=Epoch(3)), "given")
    assert not sees(replace(taken, epoch=Epoch(4)), "taken"), "the offer is over"
    assert sees(LeaseView(holder=ALICE, taken_from=None, epoch=Epoch(5)), "accepted")


def test_an_offer_lapses_after_a_minute(scene: Scene) -> None:
    scene.lease(LeaseView(holder=ADMIN, taken_from=ALICE, epoch=Epoch(2), offered=True), "given")
    scene.world.browser(9)
    scene.hub.tick(10.0)
    scene.hub.tick(69.9)
    assert scene.events == []
    scene.hub.tick(70.0)
    assert scene.events == [OfferLapsed(ONE)]
