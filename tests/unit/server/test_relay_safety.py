"""What the hub watches for safety: holders who go, turns of an assistant, round trips, lateness, fences, rehearsals."""

from dataclasses import replace
from unittest.mock import ANY

import pytest
from hub_world import (
    FIRST_ORDER,
    LATER,
    FakeAgent,
    FakeBrowser,
    HubWorld,
    command_ack,
    command_long,
    heartbeat,
    record,
    sticks,
)

from server.domain.fleet import LoanRecord
from server.domain.people import UserRef
from server.live.hub_events import (
    ControlsMoved,
    HolderExpired,
    HolderGone,
    HoldStepReported,
    HubEvent,
    LossParametersReported,
    OfferLapsed,
    RightLost,
    RttTooLong,
    TurnWanted,
)
from server.live.relay import live_messages as live
from server.live.relay.agent_link import COPIES_AT_ONCE
from server.live.relay.holder_watch import GRACE_S, KEPT_FOR_S
from server.live.relay.live_drone import SILENT_AFTER_S, LeaseView, LossCheckMark
from wire.control_messages import (
    AutopilotState,
    ControlChanged,
    HoldCause,
    HoldOrder,
    HoldProgress,
    HoldStep,
    LossParameters,
    SafetySettings,
    decode_to_agent,
    encode_message,
)
from wire.dialect import build, decode, mavlink
from wire.drops import Dropped, DropReason
from wire.ids import DroneId, Epoch, UserId
from wire.tagged import split_tagged, stamp, tag

ONE = DroneId(1)
ALICE, BOB, ADMIN = UserRef(UserId(1), "alice"), UserRef(UserId(2), "bob"), UserRef(UserId(9), "admin")
HELD = LeaseView(holder=ALICE, taken_from=None, epoch=Epoch(1))


class Scene:
    """alice holds drone 1, which is online; everything the hub notices is kept."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.events: list[HubEvent] = []
        self.agent: FakeAgent = self.world.agent(1)
        self.hub.on_event = self.events.append  # that the agent has linked is no news here
        self.alice: FakeBrowser = self.world.browser(1)
        self.lease(HELD, "acquired")
        self.alice.events()

    def lease(self, lease: LeaseView, event: str, now: float = 0.0) -> None:
        self.hub.apply_lease(ONE, lease, event=event, by=ADMIN, reason="", now=now)

    def keep_alive(self, now: float) -> None:
        """The link is heard, and time passes."""
        self.agent.send(heartbeat(), now=now)
        self.hub.tick(now)

    def rehearsal_is_over(self, now: float) -> None:
        """The alarm goes off that the link was given for the end of the rehearsed loss of the tower."""
        self.agent.alarms.pop()[1](now)

    def fly(self, now: float, browser: FakeBrowser | None = None) -> None:
        (browser or self.alice).send(tag(ONE, sticks()), now=now)

    def notices(self, browser: FakeBrowser) -> list[str]:
        return [event.code for event in browser.events() if isinstance(event, live.Notice)]


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
    """An expiry must not look like somebody who let go of the controls on purpose: the agent counts from the first."""
    scene.agent.posted.clear()
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    for second in range(2, 32):
        scene.hub.tick(float(second))
    assert HolderExpired(ONE, UserId(1)) in scene.events
    scene.lease(LeaseView(holder=None, taken_from=None, epoch=Epoch(2)), "expired", 31.5)
    told = [one for one in scene.agent.posted if isinstance(one, ControlChanged)]
    assert [(one.holder, one.holder_present) for one in told] == [("alice", False), (None, False)]
    assert told[0].number < told[1].number


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
    drone = scene.hub.drone(ONE)
    assert drone is not None
    for second in range(2, 90, 2):
        scene.hub.keep_controls(drone, ALICE.id, float(second))
        scene.hub.tick(second + 1.9)
        assert drone.somebody_flies()
    assert scene.events == []
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=True)
    scene.hub.tick(88.0 + KEPT_FOR_S)
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=False)
    scene.hub.tick(88.0 + KEPT_FOR_S + GRACE_S)
    assert scene.events == [HolderExpired(ONE, ALICE.id)]


def test_no_program_answers_for_sticks_or_for_another_holder(scene: Scene) -> None:
    drone = scene.hub.drone(ONE)
    assert drone is not None
    scene.fly(0.5)
    scene.hub.keep_controls(drone, ALICE.id, 0.9)
    scene.hub.detach_browser(scene.alice.browser, 1.0)
    scene.hub.keep_controls(drone, ALICE.id, 2.9)
    scene.hub.tick(3.0)
    assert scene.events == [HolderGone(ONE, ALICE.id, 2.0)]
    scene.hub.keep_controls(drone, ALICE.id, 4.0)
    assert drone.somebody_flies()
    scene.lease(LeaseView(holder=BOB, taken_from=None, epoch=Epoch(2)), "acquired", 4.1)
    scene.hub.tick(4.2)
    assert not drone.somebody_flies()


def test_a_holder_whose_tab_has_frozen_counts_as_gone_and_is_back_with_the_next_answer(scene: Scene) -> None:
    """The connection stays open: only the pings tell."""

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
    scene.hub.fence(ONE)
    scene.fly(1.0)
    assert scene.agent.received() == []
    assert scene.notices(scene.alice) == ["not-in-control"]
    scene.hub.unfence(ONE)
    scene.fly(1.1)
    assert len(scene.agent.received()) == 1


def test_a_new_lease_lifts_the_fence(scene: Scene) -> None:
    scene.hub.fence(ONE)
    scene.lease(replace(HELD, epoch=Epoch(2)), "acquired")
    scene.fly(1.0)
    assert [epoch for epoch, _ in scene.agent.received()] == [2]


def test_assist_changes_turns_by_the_epoch_and_loses_no_command(scene: Scene) -> None:
    admin = scene.world.browser(9)
    assisted = replace(HELD, assistant=ADMIN, epoch=Epoch(2))
    scene.lease(assisted, "assisting")
    scene.fly(1.0)
    assert [epoch for epoch, _ in scene.agent.received()] == [2]
    # The admin's command asks for the turn and waits for it; meanwhile nobody's frames pass.
    admin.send(tag(ONE, command_long(400)), now=1.1)
    scene.fly(1.11)
    assert scene.agent.received() == []
    assert scene.events == [TurnWanted(ONE, "assistant")]
    scene.lease(replace(assisted, epoch=Epoch(3)), "turn", now=1.12)
    assert scene.agent.received() == [(3, command_long(400))]
    told = scene.agent.posted[-1]
    assert told == ControlChanged(number=ANY, epoch=3, holder="alice", holder_present=True, assistant_flies=True)
    assert scene.notices(scene.alice) == ["assisted"]
    scene.fly(1.2)
    assert scene.agent.received() == []
    # One second after the last command of the admin the turn goes back.
    scene.keep_alive(2.0)
    assert len(scene.events) == 1
    scene.keep_alive(2.1)
    assert scene.events[1:] == [TurnWanted(ONE, "holder")]
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
    taken = LeaseView(holder=ADMIN, taken_from=ALICE, epoch=Epoch(2), blind=True)
    scene.lease(taken, "taken")
    (view,) = [event.drone for event in scene.alice.events() if isinstance(event, live.DroneChanged)]
    assert not view.may_watch
    scene.agent.send(command_ack())
    assert scene.alice.frames() == []
    assert scene.hub.drone_view(ONE, UserId(9), scene.world.browser(9).browser.viewer.role).may_watch  # type: ignore[union-attr]


def test_the_view_comes_back_with_the_offer_and_goes_with_it(scene: Scene) -> None:
    def sees(lease: LeaseView, event: str) -> bool:
        scene.lease(lease, event)
        (view,) = [event.drone for event in scene.alice.events() if isinstance(event, live.DroneChanged)]
        scene.alice.frames()
        scene.agent.send(command_ack())
        assert bool(scene.alice.frames()) is view.may_watch
        return view.may_watch

    taken = LeaseView(holder=ADMIN, taken_from=ALICE, epoch=Epoch(2), blind=True)
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
        """Whether a ping of its own is set, and goes out when it is due."""
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
    drone = scene.hub.drone(ONE)
    assert drone is not None and drone.settled and drone.online
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
    # Commands of the other one pass: it may hold. And when the first has stopped, it may fly.
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
    """A laptop that slept for 20 s: its stamps are 20 s behind from now on."""
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
    scene.hub.apply_safety(ONE, settings)
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
    assert scene.hub.drops[DropReason.LATE] == 2
    assert "late" in scene.notices(scene.alice)


@pytest.mark.parametrize("heard", [True, False])
def test_where_a_silent_autopilot_stands_is_not_where_it_was_armed(scene: Scene, heard: bool) -> None:
    scene.hub.report(scene.agent.link, AutopilotState(heard=heard, armed=False, airborne=False))
    lent = replace(record(1, (1,), holder=1, epoch=1), loans=(LoanRecord(BOB, LATER, True, 50.0, None),))
    scene.world.apply(lent, record(2, (2,)))
    place = mavlink.MAVLink_global_position_int_message(0, 470000000, 80000000, 500000, 0, 0, 0, 0, 0)
    scene.agent.send(build(place, system_id=1, component_id=1, sequence=0), now=0.1)
    scene.hub.tick(0.2)
    drone = scene.hub.drone(ONE)
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


def test_every_refused_command_is_counted_and_answered_in_both_forms(scene: Scene) -> None:
    admin = scene.world.browser(9)
    for number in range(3):
        whole = mavlink.MAVLink_command_int_message(1, 1, 3, 192, 0, 0, 0, 0, 0, 0, 1, 2, 3)
        admin.send(tag(ONE, build(whole, system_id=255, component_id=190, sequence=number)), now=1.0)
    assert scene.hub.drops[DropReason.NOT_IN_CONTROL] == 3
    answers = [decode(frame) for _, frame in split_tagged(b"".join(admin.frames()))]
    assert [(ack.command, ack.result) for ack in answers if ack is not None] == [(192, 10)] * 3
    assert scene.notices(admin) == ["not-in-control"]
    scene.hub.tick(2.1)
    (summed,) = [event for event in admin.events() if isinstance(event, live.Notice)]
    assert (summed.code, summed.count) == ("not-in-control", 2)
    assert scene.agent.received() == []


def test_disarming_in_the_air_is_asked_twice(scene: Scene) -> None:
    scene.hub.report(scene.agent.link, AutopilotState(heard=True, armed=True, airborne=True))
    disarm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 0, 21196, 0, 0, 0, 0, 0)
    frame = build(disarm, system_id=255, component_id=190, sequence=0)
    scene.alice.send(tag(ONE, frame), now=1.0)
    assert scene.agent.received() == []
    assert scene.notices(scene.alice) == ["ask-twice"]
    scene.alice.send(tag(ONE, frame), now=2.0)
    assert scene.agent.received() == [(1, frame)]


def test_arming_waits_until_a_dangerous_loss_check_is_acknowledged(scene: Scene) -> None:
    admin = scene.world.browser(9)
    scene.lease(replace(HELD, assistant=ADMIN, epoch=Epoch(2)), "assisting")
    scene.alice.events()
    scene.hub.set_loss_check(ONE, LossCheckMark(dangerous=True, version="a"))
    assert scene.alice.events() == [live.LossCheckChanged(ONE)]
    scene.alice.send(tag(ONE, command_long(400)), now=1.0)
    assert scene.notices(scene.alice) == ["loss-check"]
    mark = LossCheckMark(dangerous=True, read_by=frozenset({UserId(1)}), version="b")
    for _ in range(2):
        scene.hub.set_loss_check(ONE, mark)
    assert scene.alice.events() == [live.LossCheckChanged(ONE)], "what has not changed is not told"
    admin.send(tag(ONE, command_long(400)), now=2.0)
    assert scene.agent.received() == [], "the assistant has not read it"
    scene.alice.send(tag(ONE, command_long(400)), now=2.0)
    assert len(scene.agent.received()) == 1


def test_controls_that_another_process_moved_are_reported(scene: Scene) -> None:
    scene.world.apply(record(1, (1,), holder=1, epoch=1), record(2, (2,)))
    assert scene.events == []
    scene.world.apply(record(1, (1,), epoch=2), record(2, (2,)))
    assert scene.events == [ControlsMoved(ONE)]


def test_whoever_loses_the_right_is_reported(scene: Scene) -> None:
    scene.world.apply(record(1, (), holder=1, epoch=1), record(2, (2,)))
    assert [(e.user_id, e.whose) for e in scene.events if isinstance(e, RightLost)] == [(1, "holder")]


def test_the_last_session_of_a_holder_that_ends_is_reported(scene: Scene) -> None:
    second = scene.world.browser(1, session_id=77)
    scene.hub.end_sessions([scene.alice.browser.viewer.session_id])
    assert scene.events == []
    scene.hub.end_sessions([77])
    assert second.closed
    (event,) = scene.events
    assert isinstance(event, RightLost)
    assert (event.drone_id, event.whose) == (1, "holder")


def test_a_rehearsed_loss_of_the_operator_looks_like_one(scene: Scene) -> None:
    scene.hub.rehearse_operator_loss(ONE, for_s=5.0, now=1.0)
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=False)
    scene.fly(1.5)
    assert scene.agent.received() == []
    scene.keep_alive(3.0)
    assert [type(event) for event in scene.events] == [HolderGone]
    scene.keep_alive(6.1)
    assert scene.agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=True)
    scene.fly(6.2)
    assert len(scene.agent.received()) == 1


def test_a_rehearsed_loss_of_the_tower_sends_nothing_to_the_agent(scene: Scene) -> None:
    scene.agent.received()
    scene.hub.rehearse_tower_loss(ONE, for_s=4.0)
    scene.keep_alive(2.0)
    scene.fly(3.0)
    scene.hub.order_hold(ONE, "gusts")
    assert scene.agent.sent_to == []
    scene.rehearsal_is_over(5.0)
    scene.keep_alive(5.1)
    assert scene.agent.sent_to != []


def test_a_newer_rehearsal_of_a_loss_counts(scene: Scene) -> None:
    scene.hub.rehearse_tower_loss(ONE, for_s=4.0)
    scene.hub.rehearse_tower_loss(ONE, for_s=4.0)
    scene.agent.received()
    scene.agent.alarms.pop(-2)[1](4.0)
    scene.keep_alive(4.1)
    assert scene.agent.sent_to == []
    scene.rehearsal_is_over(5.0)
    scene.keep_alive(5.1)
    assert scene.agent.sent_to != []


def test_after_a_rehearsal_an_order_to_hold_goes_out_at_once_again(scene: Scene) -> None:
    scene.hub.rehearse_tower_loss(ONE, for_s=4.0)
    scene.rehearsal_is_over(4.0)
    scene.agent.received()
    scene.hub.order_hold(ONE, "gusts")
    assert len(scene.agent.sent_to) == COPIES_AT_ONCE


def test_a_link_that_was_renewed_while_flying_by_hand_holds(scene: Scene) -> None:
    scene.fly(1.0)
    again = FakeAgent(scene.hub, 1, link_id=777, now=4.0)
    (order,) = [message for message in again.posted if isinstance(message, HoldOrder)]
    assert "renewed" in order.reason
    later = FakeAgent(scene.hub, 1, link_id=778, now=60.0)
    assert not any(isinstance(message, HoldOrder) for message in later.posted)


def test_steps_of_a_hold_come_with_the_reason_of_the_order(scene: Scene) -> None:
    scene.hub.order_hold(ONE, "gusts")
    progress = HoldProgress(order_id=FIRST_ORDER, epoch=1, step=HoldStep.CONFIRMED, detail="ALT_HOLD", elapsed_ms=7.0)
    scene.hub.report(scene.agent.link, progress)
    assert scene.events == [HoldStepReported(ONE, progress, "gusts")]


def test_an_order_to_hold_goes_over_both_channels_and_a_step_told_twice_counts_once(scene: Scene) -> None:
    scene.agent.received()
    scene.hub.order_hold(ONE, "gusts")
    (order,) = [message for message in scene.agent.posted if isinstance(message, HoldOrder)]
    scene.hub.tick(0.1)
    scene.hub.tick(0.2)
    scene.hub.tick(0.3)
    sent, scene.agent.sent_to = scene.agent.sent_to, []
    heard = [scene.agent.sealed.receive(datagram, 0.3).urgent for datagram, _ in sent]
    told = [decode_to_agent(text) for text in heard if text]
    assert [message for message in told if isinstance(message, HoldOrder)] == [order] * 4
    progress = HoldProgress(order_id=FIRST_ORDER, epoch=1, step=HoldStep.CONFIRMED, detail="ALT_HOLD", elapsed_ms=7.0)
    scene.hub.report(scene.agent.link, progress)
    for _ in range(2):
        scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(progress).encode()))
    assert scene.events == [HoldStepReported(ONE, progress, "gusts")]


def test_two_holds_of_one_epoch_that_go_alike_are_both_told(scene: Scene) -> None:
    def told(step: HoldStep, number: int) -> None:
        progress = HoldProgress(
            order_id=0, epoch=1, step=step, detail="", elapsed_ms=0.0, cause=HoldCause.STICKS_STALE, number=number
        )
        for _ in range(2):
            scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(progress).encode()))

    for number in (1, 3):
        told(HoldStep.ORDERED, number)
        told(HoldStep.CONFIRMED, number + 1)
    steps = [event.step for event in scene.alice.events() if isinstance(event, live.Hold)]
    assert steps == ["ordered", "confirmed", "ordered", "confirmed"]


def test_a_step_that_a_later_one_overtook_is_not_told_but_an_end_is(scene: Scene) -> None:
    for step, number in ((HoldStep.CONFIRMED, 5), (HoldStep.MODE_ACKNOWLEDGED, 4), (HoldStep.UNCONFIRMED, 3)):
        progress = HoldProgress(order_id=0, epoch=1, step=step, detail="", elapsed_ms=9.0, number=number)
        scene.hub.report(scene.agent.link, progress)
    steps = [event.step for event in scene.alice.events() if isinstance(event, live.Hold)]
    assert steps == ["confirmed", "unconfirmed"]


def test_an_urgent_message_that_is_none_is_dropped(scene: Scene) -> None:
    with pytest.raises(Dropped, match="bad_content"):
        scene.agent.deliver(scene.agent.sealed.seal_urgent(b"{"))


def test_loss_parameters_are_kept_and_reported(scene: Scene) -> None:
    parameters = LossParameters(autopilot="ardupilot", values={"FS_GCS_ENABLE": 0.0}, complete=True)
    scene.hub.report(scene.agent.link, parameters)
    assert scene.events == [LossParametersReported(ONE, parameters)]
