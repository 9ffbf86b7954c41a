"""An agent's reports on its open hold: who receives them, what is stored, and when the hold is ordered again."""

from datetime import datetime, timedelta

import pytest
from hub_world import FIRST_ORDER, NOW, FakeAgent, HubWorld, record, sticks

from server.control.core.hold_orders import OFFLINE
from server.control.core.open_hold import NO_ORDER, OpenHold
from server.fleet.core.views import HoldView
from server.kernel.people import UserRef
from server.link.core.link_changes import ORDERED_AGAIN
from server.live import live_messages as live
from server.live.hub_events import HoldToKeep, HubEvent
from server.live.live_drone import LeaseView, LiveDrone
from wire.control_messages import (
    HoldOrder,
    HoldProgress,
    HoldStep,
    SafetySettings,
    decode_to_agent,
    encode_message,
)
from wire.ids import DroneId, Epoch, UserId
from wire.open_holds import OPEN_HOLDS, AfterSticks, HoldStage, HoldState, Lost, LostAction, LostPhase, Stay
from wire.tagged import tag

ONE = DroneId(1)
ALICE = UserRef(UserId(1), "alice")


def reported(number: int = 1, *, open: bool = True, **more: object) -> HoldState:
    usual = {"stage": HoldStage.STAY, "mode": "BRAKE", "sticks": False, "after_sticks": AfterSticks.STAYS}
    return HoldState(number=number, open=open, **(usual | more))  # type: ignore[arg-type]


def counting(number: int = 1, due_in_s: float = 20.0, lost: Lost = Lost.PERSON) -> HoldState:
    return reported(number, lost=lost, phase=LostPhase.COUNTING, action=LostAction.RETURN, due_in_s=due_in_s)


def at(seconds: float) -> datetime:
    return NOW + timedelta(seconds=seconds)


def view_of(hold: OpenHold) -> HoldView:
    view = hold.view(online=True)
    assert view is not None
    return view


# -- alone ---------------------------------------------------------------------------------------------------


def test_where_nothing_is_open_and_nobody_lost_there_is_nothing_to_see() -> None:
    hold = OpenHold()
    assert hold.view(online=True) is None
    assert not hold.take(reported(1, open=False), NOW)
    assert hold.view(online=True) is None
    assert hold.take(reported(2), NOW)
    assert view_of(hold).stage is HoldStage.STAY
    assert hold.take(reported(3, open=False, phase=LostPhase.DONE, action=LostAction.RETURN), NOW), "just done"
    assert view_of(hold).phase is LostPhase.DONE
    assert hold.take(reported(4, open=False), NOW)
    assert hold.view(online=True) is None


def test_only_a_newer_number_counts_and_a_new_link_begins_anew() -> None:
    hold = OpenHold()
    hold.take(reported(5), NOW)
    assert not hold.take(reported(5, mode="GUIDED"), at(1))
    assert not hold.take(reported(4, mode="GUIDED"), at(1))
    assert view_of(hold).mode == "BRAKE"
    hold.linked(reports=True)
    assert hold.take(reported(1, mode="GUIDED"), at(2))
    assert view_of(hold).mode == "GUIDED"


def test_the_countdown_does_not_jitter_and_a_repetition_is_no_news() -> None:
    hold = OpenHold()
    assert hold.take(counting(1, 20.0), at(0))
    assert not hold.take(counting(2, 15.2), at(5.0))
    assert not hold.take(counting(3, 9.3), at(10.0))
    assert (view_of(hold).due_at, view_of(hold).as_of) == (at(20.0), at(10.0))
    assert hold.take(counting(4, 30.0), at(10.0)), "it began again"
    assert view_of(hold).due_at == at(40.0)
    assert hold.take(counting(5, 29.5, Lost.TOWER), at(10.0)), "another count"
    assert view_of(hold).due_at == at(39.5)
    assert hold.take(reported(6, lost=Lost.PERSON, phase=LostPhase.STAYED), at(11.0))
    assert view_of(hold).due_at is None


@pytest.mark.parametrize("due_in_s", [-5.0, 1e300, float("inf")])
def test_a_count_that_makes_no_sense_has_an_end_all_the_same(due_in_s: float) -> None:
    hold = OpenHold()
    hold.take(counting(1, due_in_s), NOW)
    assert NOW <= (view_of(hold).due_at or NOW) <= at(86_400.0)


def test_what_is_owed_ends_with_a_step_of_the_newest_order_only() -> None:
    hold = OpenHold()
    seen = [hold.must_be_ordered]
    for order_id, ended in ((NO_ORDER, NO_ORDER), (7, 6), (7, 7)):
        hold.ordered(order_id)
        hold.ended(ended)
        seen.append(hold.must_be_ordered)
    assert seen == [False, True, True, False], "nobody was told of the first, and the second ended another"


# -- in the hub ----------------------------------------------------------------------------------------------


class Scene:
    """alice watches drone 1; its agent supports open holds."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.events: list[HubEvent] = []
        self.hub.state.on_event = self.events.append
        self.alice = self.world.browser(1)
        self.agent = self.link(101)

    def link(self, link_id: int, *, knows: bool = True) -> FakeAgent:
        agent = self.world.agent(1, link_id=link_id, takes=(OPEN_HOLDS,) if knows else ())
        self.alice.events()
        return agent

    @property
    def drone(self) -> LiveDrone:
        drone = self.hub.state.drones.get(ONE)
        assert drone is not None
        return drone

    def announce(self, state: HoldState, seconds: float = 0.0) -> None:
        self.hub.reports.receive(self.agent.link, state, at=at(seconds))

    def drone_events(self) -> list[HoldView | None]:
        return [event.drone.hold for event in self.alice.events() if isinstance(event, live.DroneChanged)]

    def kept(self) -> int:
        return sum(isinstance(event, HoldToKeep) for event in self.events)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def orders(agent: FakeAgent) -> list[HoldOrder]:
    return [message for message in agent.posted if isinstance(message, HoldOrder)]


def test_watchers_hear_of_each_change_and_of_nothing_else(scene: Scene) -> None:
    scene.announce(counting(1, 20.0))
    (hold,) = scene.drone_events()
    assert hold is not None
    assert (hold.open, hold.lost, hold.due_at, hold.stale) == (True, Lost.PERSON, at(20.0), False)
    scene.announce(counting(2, 15.0), 5.0)
    assert scene.drone_events() == []
    assert scene.drone.view().hold == hold.model_copy(update={"as_of": at(5.0)})


def test_it_comes_over_udp_as_well(scene: Scene) -> None:
    scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(reported(1)).encode()))
    assert [hold is not None for hold in scene.drone_events()] == [True]


def test_when_the_link_ends_the_last_that_was_told_stays_and_is_stale(scene: Scene) -> None:
    scene.announce(counting(3))
    scene.hub.detach_link(scene.agent.link)
    sent_events = scene.drone_events()
    assert sent_events[-1] is not None
    assert (sent_events[-1].stale, sent_events[-1].mode, sent_events[-1].due_at) == (True, "BRAKE", at(20.0))
    scene.agent = scene.link(102)
    assert scene.drone.open_hold.reported is None
    scene.announce(reported(1, open=False))
    assert scene.drone_events() == [None]


def test_an_agent_that_says_it_but_does_not_know_it_has_no_hold(scene: Scene) -> None:
    scene.announce(reported(1))
    scene.agent = scene.link(102, knows=False)
    scene.announce(reported(2))
    assert scene.drone.view().hold is None


def test_an_open_hold_is_ordered_again_on_a_new_link_and_lets_a_return_go_on(scene: Scene) -> None:
    scene.announce(reported(1))
    again = scene.link(102)
    assert orders(again) == [HoldOrder(order_id=FIRST_ORDER, epoch=0, reason=ORDERED_AGAIN, interrupts=False)]
    assert orders(scene.link(103)), "the end of that order was never told"


def test_a_hold_that_is_over_is_not_ordered_again(scene: Scene) -> None:
    scene.hub.holds.order(ONE, "gusts")
    done = HoldProgress(order_id=FIRST_ORDER, epoch=0, step=HoldStep.CONFIRMED, detail="BRAKE", elapsed_ms=9.0)
    scene.hub.reports.receive(scene.agent.link, done)
    scene.announce(reported(1))
    scene.announce(reported(2, open=False))
    assert orders(scene.link(102)) == []


def test_a_hold_of_an_offline_drone_is_ordered_when_it_is_back(scene: Scene) -> None:
    scene.announce(counting(1))
    scene.hub.detach_link(scene.agent.link)
    scene.alice.events()
    assert not scene.hub.holds.order(ONE, "taken")
    (said,) = [event for event in scene.alice.events() if isinstance(event, live.Hold)]
    assert said.step == "unconfirmed"
    assert said.detail.startswith(OFFLINE)
    assert "held in BRAKE (stage: stay), and counts down to its lost action: return" in said.detail
    (order,) = orders(scene.link(102))
    assert not order.interrupts


def test_an_older_agent_is_not_told_again_for_it_would_interrupt_a_return(scene: Scene) -> None:
    scene.hub.detach_link(scene.agent.link)
    scene.hub.holds.order(ONE, "taken")
    assert orders(scene.link(102, knows=False)) == []
    assert orders(scene.link(103)) == []


def test_another_control_channel_of_the_link_orders_nothing_anew(scene: Scene) -> None:
    scene.announce(reported(1))
    scene.hub.resumed(scene.agent.link)
    assert orders(scene.agent) == []


def test_a_hand_on_the_sticks_and_an_open_hold_make_one_order(scene: Scene) -> None:
    scene.world.apply(record(1, (1,), holder=1, epoch=1), record(2, (2,)))
    scene.alice.send(tag(ONE, sticks()))
    scene.announce(reported(1))
    (order,) = orders(scene.link(102))
    assert order.reason == ORDERED_AGAIN


def test_what_must_be_ordered_again_is_noted_when_it_changes(scene: Scene) -> None:
    scene.hub.holds.order(ONE, "gusts")
    scene.hub.holds.order(ONE, "gusts")
    assert (scene.kept(), scene.drone.hold_noted) == (1, True)
    done = HoldProgress(order_id=FIRST_ORDER + 1, epoch=0, step=HoldStep.NOT_NEEDED, detail="", elapsed_ms=9.0)
    scene.hub.reports.receive(scene.agent.link, done)
    assert (scene.kept(), scene.drone.hold_noted) == (2, False)
    scene.announce(reported(1))
    assert (scene.kept(), scene.drone.hold_noted) == (3, True)


def test_a_hold_of_the_tower_before_is_ordered_on_the_first_link() -> None:
    world = HubWorld()
    world.hub.holds.keep(ONE)
    (order,) = orders(world.agent(1, takes=(OPEN_HOLDS,)))
    assert order.reason == ORDERED_AGAIN


def test_an_order_after_an_emergency_does_not_take_back_that_it_interrupts(scene: Scene) -> None:
    scene.hub.holds.order(ONE, "emergency", interrupts=True)
    scene.hub.holds.order(ONE, "the round trip takes 900 ms")
    assert [order.interrupts for order in orders(scene.agent)] == [True, True]
    answered = HoldProgress(order_id=FIRST_ORDER + 1, epoch=0, step=HoldStep.ORDERED, detail="", elapsed_ms=1.0)
    scene.hub.reports.receive(scene.agent.link, answered)
    scene.hub.holds.order(ONE, "gusts")
    assert not orders(scene.agent)[-1].interrupts


def test_stay_goes_by_both_ways_with_a_number_of_its_own(scene: Scene) -> None:
    scene.agent.received()
    assert scene.hub.holds.stay(ONE, "a" * 100)
    expected = Stay(order_id=FIRST_ORDER, by="a" * 80)
    assert scene.agent.posted[-1] == expected
    sent = [scene.agent.sealed.receive(datagram, 0.0).urgent for datagram, _ in scene.agent.sent_to]
    assert decode_to_agent(next(text for text in sent if text)) == expected
    scene.hub.detach_link(scene.agent.link)
    assert not scene.hub.holds.stay(ONE, "alice")


@pytest.mark.parametrize("knows", [True, False])
def test_an_older_agent_gets_a_lost_action_that_it_knows(scene: Scene, knows: bool) -> None:
    agent = scene.link(102, knows=knows)
    stays = SafetySettings(lost_action=LostAction.STAY)
    scene.hub.changes.apply_safety(ONE, stays)
    scene.hub.resumed(agent.link)
    again = scene.link(103, knows=knows)
    sent_events = [m for a in (agent, again) for m in a.posted if isinstance(m, SafetySettings)]
    expected = LostAction.STAY if knows else LostAction.CONTINUE
    assert [one.lost_action for one in sent_events] == [LostAction.RETURN, expected, expected, expected]
    assert scene.drone.view().lost_action is LostAction.STAY


def test_a_take_is_held_under_the_new_epoch(scene: Scene) -> None:
    scene.hub.detach_link(scene.agent.link)
    taken = LeaseView(UserRef(UserId(9), "admin"), ALICE, Epoch(4))
    scene.hub.apply_lease(ONE, taken, event="taken", by=None, reason="", now=0.0)
    scene.hub.holds.order(ONE, "taken")
    (order,) = orders(scene.link(102))
    assert order.epoch == 4
