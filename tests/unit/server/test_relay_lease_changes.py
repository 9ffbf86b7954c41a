"""Reports to people of a lease that a database snapshot has changed, and their timing."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest
from hub_world import FakeBrowser, HubWorld, heartbeat, record, sticks

from server.control.core.holder_watch import GRACE_S
from server.control.core.lease_changes import CONTROL_ACTS_WITHIN_S, ELSEWHERE
from server.kernel.people import UserRef
from server.live import live_messages as live
from server.live.hub_events import HolderExpired
from server.live.live_drone import LeaseView
from wire.ids import DroneId, Epoch, UserId
from wire.open_holds import AfterSticks, HoldStage, HoldState, Lost, LostAction, LostPhase
from wire.tagged import tag

ONE = DroneId(1)
ALICE, ADMIN = UserRef(UserId(1), "alice"), UserRef(UserId(9), "admin")
NO_OWNER = "no longer an owner of this drone"


class Scene:
    """alice and the admin watch drone 1; the test sets the lease in the snapshots."""

    def __init__(self, lease: dict[str, Any] | None = None) -> None:
        self.world = HubWorld()
        self.epoch = 0
        self.snapshot(**({"holder": ALICE} if lease is None else lease))
        self.alice, self.admin = self.world.browser(1), self.world.browser(9)
        self.wait(0.0)
        self.reported(self.alice)
        self.reported(self.admin)

    def snapshot(self, *, owners: tuple[int, ...] = (1,), **lease: Any) -> None:
        self.epoch += 1
        self.world.apply(replace(record(1, owners, epoch=self.epoch), **lease), record(2, (2,)))

    def service(self, lease: LeaseView, event: str, now: float) -> None:
        self.world.hub.apply_lease(ONE, lease, event=event, by=ADMIN, reason="gusts", now=now)

    def wait(self, since: float) -> None:
        """Waits until the service has nothing more to report."""
        self.world.hub.tick(since)
        self.world.hub.tick(since + CONTROL_ACTS_WITHIN_S)

    @staticmethod
    def reported(browser: FakeBrowser) -> list[tuple[str, int, str | None, str]]:
        """(event, epoch, by, reason)"""
        events = [event for event in browser.events() if isinstance(event, live.Control)]
        return [(one.event, one.epoch, one.by.name if one.by else None, one.reason) for one in events]


@pytest.mark.parametrize(
    ("before", "after", "event"),
    [
        ({}, {"holder": ALICE}, "acquired"),
        ({"holder": ALICE}, {}, "released"),
        ({"holder": ALICE}, {"holder": ADMIN, "taken_from": ALICE}, "taken"),
        ({"holder": ADMIN, "taken_from": ALICE}, {"holder": ADMIN, "taken_from": ALICE, "offered": True}, "given"),
        ({"holder": ADMIN, "taken_from": ALICE, "offered": True}, {"holder": ADMIN, "taken_from": ALICE}, "taken"),
        ({"holder": ADMIN, "taken_from": ALICE, "offered": True}, {"holder": ALICE}, "accepted"),
        ({"holder": ADMIN, "taken_from": ALICE}, {"holder": ADMIN}, "revoked"),
        ({"holder": ALICE}, {"holder": ALICE, "assistant": ADMIN}, "assisting"),
        ({"holder": ALICE, "assistant": ADMIN}, {"holder": ALICE}, "assist_ended"),
    ],
)
def test_what_another_process_did_is_told_after_a_while(
    before: dict[str, Any], after: dict[str, Any], event: str
) -> None:
    scene = Scene(before)
    scene.snapshot(**after)
    scene.world.hub.tick(5.0)
    scene.world.hub.tick(4.9 + CONTROL_ACTS_WITHIN_S)
    assert scene.reported(scene.alice) == []
    scene.world.hub.tick(5.0 + CONTROL_ACTS_WITHIN_S)
    assert scene.reported(scene.alice) == scene.reported(scene.admin) == [(event, 2, None, ELSEWHERE)]
    scene.wait(9.0)
    assert scene.reported(scene.alice) == [], "once"


def test_an_epoch_that_grew_alone_is_no_news() -> None:
    scene = Scene()
    scene.snapshot(holder=ALICE)
    scene.wait(5.0)
    assert scene.reported(scene.alice) == []


def test_a_former_holder_whose_ownership_went_with_the_controls_hears_of_both() -> None:
    scene = Scene()
    scene.snapshot(owners=())
    scene.wait(5.0)
    events = scene.alice.events()
    assert events[0] == live.DroneRemoved(1)
    assert events[1:] == [live.Control(1, "revoked", 2, None, None, NO_OWNER)]
    scene.snapshot(owners=(), holder=ADMIN)
    scene.wait(7.0)
    assert scene.alice.events() == [], "what happens to it now is not theirs to know"


def test_what_the_service_says_counts_and_comes_once_though_a_snapshot_was_first() -> None:
    scene = Scene()
    scene.snapshot(owners=())
    scene.world.hub.tick(5.0)
    scene.service(LeaseView(None, None, Epoch(2)), "revoked", 5.1)
    assert scene.reported(scene.alice) == scene.reported(scene.admin) == [("revoked", 2, "admin", "gusts")]
    scene.wait(6.0)
    scene.wait(8.0)
    assert scene.reported(scene.alice) == scene.reported(scene.admin) == []


def test_a_change_of_the_service_that_comes_meanwhile_is_told_after_that_of_the_snapshot() -> None:
    scene = Scene()
    scene.snapshot()
    scene.world.hub.tick(5.0)
    scene.service(LeaseView(ADMIN, None, Epoch(3)), "acquired", 5.1)
    reported = scene.reported(scene.alice)
    assert [(event, by) for event, _, by, _ in reported] == [("released", None), ("acquired", "admin")]
    assert [epoch for _, epoch, _, _ in reported] == [2, 3]
    scene.wait(6.0)
    assert scene.reported(scene.alice) == []


def test_of_several_changes_that_snapshots_told_the_sum_is_told() -> None:
    scene = Scene()
    scene.snapshot()
    scene.world.hub.tick(5.0)
    scene.snapshot(holder=ADMIN)
    scene.wait(5.9)
    assert scene.reported(scene.alice) == scene.reported(scene.admin) == [("acquired", 3, None, ELSEWHERE)]


def test_a_drone_that_was_removed_meanwhile_has_no_news() -> None:
    scene = Scene()
    scene.snapshot()
    scene.world.apply(record(2, (2,)))
    scene.wait(5.0)
    assert scene.reported(scene.admin) == []


def test_an_expiry_that_a_snapshot_told_is_told_as_one() -> None:
    scene = Scene()
    scene.world.hub.detach_browser(scene.alice.browser, 10.0)
    scene.world.hub.tick(10.0 + GRACE_S)
    scene.snapshot()
    scene.wait(50.0)
    assert scene.reported(scene.admin) == [("expired", 2, None, ELSEWHERE)]
    scene.snapshot(holder=ADMIN)
    scene.snapshot()
    scene.wait(60.0)
    assert scene.reported(scene.admin) == [], "and nothing of it is left for the next one: the sum is nothing"


def test_hands_that_a_snapshot_told_of_inherit_neither_sticks_nor_absence() -> None:
    scene = Scene()
    hub = scene.world.hub
    drone = hub.state.drones.get(ONE)
    assert drone is not None
    scene.world.agent(1).send(heartbeat(), now=9.8)
    scene.alice.send(tag(ONE, sticks()), 9.9)
    assert drone.flown_by_hand(10.0)
    hub.detach_browser(scene.alice.browser, 10.0)
    hub.tick(10.0 + GRACE_S - 1.0)
    bob = UserRef(UserId(2), "bob")
    scene.snapshot(owners=(1, 2), holder=bob)
    assert not drone.flown_by_hand(10.0)
    noticed: list[object] = []
    hub.state.on_event = noticed.append
    for second in range(int(GRACE_S) - 1):
        hub.tick(40.0 + second)
    assert HolderExpired(ONE, bob.id) not in noticed, "bob is away for less than the grace time"
    hub.tick(40.0 + GRACE_S)
    assert HolderExpired(ONE, bob.id) in noticed


@pytest.mark.parametrize(
    ("event", "words"),
    [
        ("released", "alice released the controls"),
        ("expired", "alice was away for too long"),
        ("revoked", "alice may not fly it any more: gusts"),
    ],
)
def test_it_is_known_how_it_came_that_nobody_has_the_controls(event: str, words: str) -> None:
    scene = Scene()
    drone = scene.world.hub.state.drones[ONE]
    assert drone.unheld_why == ""
    scene.service(LeaseView(holder=None, taken_from=None, epoch=Epoch(2)), event, 3.0)
    assert drone.unheld_why == words
    scene.service(LeaseView(holder=ALICE, taken_from=None, epoch=Epoch(3)), "acquired", 4.0)
    assert drone.unheld_why == ""


def test_it_is_known_of_a_right_that_ended_in_another_process() -> None:
    scene = Scene()
    scene.snapshot(owners=())
    scene.wait(5.0)
    drone = scene.world.hub.state.drones[ONE]
    assert drone.unheld_why == f"alice may not fly it any more: {NO_OWNER}"


def test_who_has_the_controls_and_does_not_fly_is_named() -> None:
    scene = Scene()
    drone = scene.world.hub.state.drones[ONE]
    counting = HoldState(
        number=1,
        open=False,
        stage=HoldStage.NONE,
        mode="GUIDED",
        sticks=False,
        after_sticks=AfterSticks.STAYS,
        lost=Lost.PERSON,
        phase=LostPhase.COUNTING,
        action=LostAction.RETURN,
        due_in_s=20.0,
    )
    drone.open_hold.linked(reports=True)
    drone.open_hold.take(counting, datetime(2026, 1, 1, tzinfo=UTC))

    def because() -> str:
        view = drone.hold_view()
        assert view is not None
        return view.nobody_because

    drone.holder_watch.present()
    assert because() == "alice has the controls and does not fly it"
    drone.holder_watch.missing(by_hand=False, now=0.0)
    assert because() == "alice has the controls and is away"
