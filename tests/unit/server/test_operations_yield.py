"""What cancels the remaining steps of an operation, and which requests are never refused for the limit."""

from collections.abc import Callable

import pytest
from hub_world import command_long, record
from operation_scene import ALICE, COMMAND, Scene

from server.operations.core.operation import MAX_RUNNING, Lane, Order, State, Step
from server.operations.core.refusals import DroneBusy
from wire.control_messages import HoldCause, HoldProgress, HoldStep
from wire.ids import DroneId
from wire.tagged import tag
from wire.transactions import CancelTransaction, CommandWork, Transaction

HOLD = Order("command", Lane.COMMANDS, [Step(CommandWork(176), 5.0)], True, overrules=True)
SPEED = Order("command", Lane.COMMANDS, [Step(CommandWork(178), 5.0)], True)


def ordered(scene: Scene) -> None:
    scene.hub.holds.order(DroneId(1), "the holder has been gone for 2 s")


def noticed_by_the_agent(scene: Scene) -> None:
    reported = {"epoch": 0, "order_id": 0, "detail": "", "elapsed_ms": 0.0, "cause": HoldCause.PILOT_LOST}
    scene.announce(HoldProgress(number=9, step=HoldStep.STICKS_CENTRED, **reported))


def commanded(scene: Scene) -> None:
    scene.begin(HOLD)


def sent_as_a_frame(scene: Scene) -> None:
    scene.watcher.send(tag(DroneId(1), command_long(176)))


@pytest.mark.parametrize("hold", [ordered, noticed_by_the_agent, commanded, sent_as_a_frame])
def test_after_a_hold_no_further_step_is_sent(hold: Callable[[Scene], None]) -> None:
    scene = Scene()
    scene.apply(record(1, (1,), holder=1, epoch=5))
    climbing = scene.begin(COMMAND)
    hold(scene)
    scene.sent()
    scene.end(climbing)
    assert climbing.state is State.CANCELLED
    assert "not sent" in climbing.words
    assert scene.sent() == []


def test_a_hold_that_was_over_before_does_not_count() -> None:
    scene = Scene()
    ordered(scene)
    climbing = scene.begin(COMMAND)
    scene.end(climbing)
    assert climbing.running
    scene.end(climbing)
    assert climbing.state is State.DONE


def test_a_hold_is_never_one_too_many() -> None:
    scene = Scene()
    others = [scene.begin(SPEED) for _ in range(MAX_RUNNING[Lane.COMMANDS])]
    with pytest.raises(DroneBusy):
        scene.begin(SPEED)
    scene.sent()
    hold = scene.service.begin(scene.drone, HOLD, by=ALICE, now=scene.now)
    assert hold.running
    assert [one.state for one in others] == [State.CANCELLED, *[State.RUNNING] * (len(others) - 1)]
    assert [type(one) for one in scene.sent()] == [CancelTransaction, Transaction]
