"""Losses, rehearsals of losses, and the steps of a hold as the hub reports them."""

from unittest.mock import ANY

import pytest
from hub_world import (
    FIRST_ORDER,
    FakeAgent,
    record,
)
from safety_scene import ONE, Scene

from server.link.core.agent_link import COPIES_AT_ONCE
from server.live import live_messages as live
from server.live.hub_events import (
    ControlsMoved,
    HolderGone,
    HoldStepReported,
    LossParametersReported,
    RightLost,
)
from wire.control_messages import (
    ControlChanged,
    HoldCause,
    HoldOrder,
    HoldProgress,
    HoldStep,
    LossParameters,
    decode_to_agent,
    encode_message,
)
from wire.drops import Dropped


@pytest.fixture
def scene() -> Scene:
    return Scene()


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
    scene.hub.changes.rehearse_operator_loss(ONE, for_s=5.0, now=1.0)
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
    scene.hub.changes.rehearse_tower_loss(ONE, for_s=4.0)
    scene.keep_alive(2.0)
    scene.fly(3.0)
    scene.hub.holds.order(ONE, "gusts")
    assert scene.agent.sent_to == []
    scene.rehearsal_is_over(5.0)
    scene.keep_alive(5.1)
    assert scene.agent.sent_to != []


def test_a_newer_rehearsal_of_a_loss_counts(scene: Scene) -> None:
    scene.hub.changes.rehearse_tower_loss(ONE, for_s=4.0)
    scene.hub.changes.rehearse_tower_loss(ONE, for_s=4.0)
    scene.agent.received()
    scene.agent.alarms.pop(-2)[1](4.0)
    scene.keep_alive(4.1)
    assert scene.agent.sent_to == []
    scene.rehearsal_is_over(5.0)
    scene.keep_alive(5.1)
    assert scene.agent.sent_to != []


def test_after_a_rehearsal_an_order_to_hold_goes_out_at_once_again(scene: Scene) -> None:
    scene.hub.changes.rehearse_tower_loss(ONE, for_s=4.0)
    scene.rehearsal_is_over(4.0)
    scene.agent.received()
    scene.hub.holds.order(ONE, "gusts")
    assert len(scene.agent.sent_to) == COPIES_AT_ONCE


def test_a_link_that_was_renewed_while_flying_by_hand_holds(scene: Scene) -> None:
    scene.fly(1.0)
    again = FakeAgent(scene.hub, 1, link_id=777, now=4.0)
    (order,) = [message for message in again.posted if isinstance(message, HoldOrder)]
    assert "renewed" in order.reason
    later = FakeAgent(scene.hub, 1, link_id=778, now=60.0)
    assert not any(isinstance(message, HoldOrder) for message in later.posted)


def test_steps_of_a_hold_come_with_the_reason_of_the_order(scene: Scene) -> None:
    scene.hub.holds.order(ONE, "gusts")
    progress = HoldProgress(order_id=FIRST_ORDER, epoch=1, step=HoldStep.CONFIRMED, detail="ALT_HOLD", elapsed_ms=7.0)
    scene.hub.reports.receive(scene.agent.link, progress)
    assert scene.events == [HoldStepReported(ONE, progress, "gusts")]


def test_an_order_to_hold_goes_over_both_channels_and_a_step_told_twice_counts_once(scene: Scene) -> None:
    scene.agent.received()
    scene.hub.holds.order(ONE, "gusts")
    (order,) = [message for message in scene.agent.posted if isinstance(message, HoldOrder)]
    scene.hub.tick(0.1)
    scene.hub.tick(0.2)
    scene.hub.tick(0.3)
    sent, scene.agent.sent_to = scene.agent.sent_to, []
    heard = [scene.agent.sealed.receive(datagram, 0.3).urgent for datagram, _ in sent]
    reported = [decode_to_agent(text) for text in heard if text]
    assert [message for message in reported if isinstance(message, HoldOrder)] == [order] * 4
    progress = HoldProgress(order_id=FIRST_ORDER, epoch=1, step=HoldStep.CONFIRMED, detail="ALT_HOLD", elapsed_ms=7.0)
    scene.hub.reports.receive(scene.agent.link, progress)
    for _ in range(2):
        scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(progress).encode()))
    assert scene.events == [HoldStepReported(ONE, progress, "gusts")]


def test_two_holds_of_one_epoch_that_go_alike_are_both_told(scene: Scene) -> None:
    def reported(step: HoldStep, number: int) -> None:
        progress = HoldProgress(
            order_id=0, epoch=1, step=step, detail="", elapsed_ms=0.0, cause=HoldCause.STICKS_STALE, number=number
        )
        for _ in range(2):
            scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(progress).encode()))

    for number in (1, 3):
        reported(HoldStep.ORDERED, number)
        reported(HoldStep.CONFIRMED, number + 1)
    steps = [event.step for event in scene.alice.events() if isinstance(event, live.Hold)]
    assert steps == ["ordered", "confirmed", "ordered", "confirmed"]


def test_a_step_that_a_later_one_overtook_is_not_told_but_an_end_is(scene: Scene) -> None:
    for step, number in ((HoldStep.CONFIRMED, 5), (HoldStep.MODE_ACKNOWLEDGED, 4), (HoldStep.UNCONFIRMED, 3)):
        progress = HoldProgress(order_id=0, epoch=1, step=step, detail="", elapsed_ms=9.0, number=number)
        scene.hub.reports.receive(scene.agent.link, progress)
    steps = [event.step for event in scene.alice.events() if isinstance(event, live.Hold)]
    assert steps == ["confirmed", "unconfirmed"]


def test_an_urgent_message_that_is_none_is_dropped(scene: Scene) -> None:
    with pytest.raises(Dropped, match="bad_content"):
        scene.agent.deliver(scene.agent.sealed.seal_urgent(b"{"))


def test_loss_parameters_are_kept_and_reported(scene: Scene) -> None:
    parameters = LossParameters(autopilot="ardupilot", values={"FS_GCS_ENABLE": 0.0}, complete=True)
    scene.hub.reports.receive(scene.agent.link, parameters)
    assert scene.events == [LossParametersReported(ONE, parameters)]
