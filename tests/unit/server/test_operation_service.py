"""Operations: steps, epochs, cancels, lost links and restarts."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from hub_world import record
from operation_scene import ALICE, COMMAND, DOWNLOAD, ITEMS, Scene

from server.control.core.assist_turn import BACK_AFTER_S
from server.operations.core.kept_operations import ENDED_KEPT_S, MAX_ENDED
from server.operations.core.operation import Lane, Operation, Order, State, Step
from server.operations.core.refusals import AgentTooOld, DroneBusy, DroneOffline
from server.operations.core.service import ASK_AFTER_S, GRACE_S, LINK_LOST
from wire.ids import DroneId, UserId
from wire.lateness import stamp_ms
from wire.plans import PlanKind
from wire.transactions import (
    MAX_EXTENDED_S,
    TRANSACTIONS,
    CancelTransaction,
    CommandWork,
    Outcome,
    ParametersReadWork,
    ParametersWriteWork,
    PlanUploadWork,
    PlanVerifyWork,
    Transaction,
    TransactionProgress,
    TransactionResult,
)


def test_an_operation_goes_to_the_agent_under_the_epoch_and_back_to_those_who_watch() -> None:
    scene = Scene()
    scene.apply(record(1, (1,), holder=1, epoch=5))
    operation = scene.begin()
    (sent,) = scene.sent()
    assert sent == Transaction(
        id=operation.transaction_id,
        epoch=5,
        sent_ms=stamp_ms(scene.now),
        deadline_s=60.0,
        work=PlanUploadWork(PlanKind.MISSION, ITEMS),
    )
    scene.announce(TransactionProgress(id=sent.id, phase="writing", done=1, total=2))
    assert [event.operation.done for event in scene.reported()] == [1]  # the newest report in the queue
    ended: list[Operation] = []
    operation.on_end.append(ended.append)
    scene.end(operation, words="It is on board.", item=None, code="MAV_MISSION_ACCEPTED")
    assert ended == [operation]
    (last,) = scene.reported()
    assert last.operation.state is State.DONE
    assert last.operation.words == "It is on board."
    assert last.operation.by.name == "alice"
    assert scene.service.find(operation.id) is operation


def test_what_ended_stays_ended() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.end(operation, Outcome.FAILED, "The old plan was put back.")
    scene.reported()
    scene.end(operation)
    scene.announce(TransactionProgress(id=operation.transaction_id, phase="writing", done=1, total=2))
    assert operation.state is State.FAILED
    assert scene.reported() == []


def test_an_agent_says_nothing_about_the_operations_of_another_drone() -> None:
    scene = Scene()
    bobs = scene.agent(2)
    bobs.link.takes = frozenset({TRANSACTIONS})
    operation = scene.begin()
    scene.announce(TransactionResult(id=operation.transaction_id, outcome=Outcome.DONE, words="Mine."), bobs)
    scene.announce(TransactionProgress(id=operation.transaction_id, phase="mine", done=1, total=1), bobs)
    assert operation.running
    assert operation.phase == ""


def test_steps_follow_each_other_and_the_first_refusal_is_the_last() -> None:
    scene = Scene()
    done = scene.begin(COMMAND)
    scene.end(done)
    assert done.running
    scene.end(done, words="It climbs.")
    assert (done.state, done.words) == (State.DONE, "It climbs.")
    assert [one.work.command for one in scene.sent()] == [400, 22]
    refused = scene.begin(COMMAND)
    scene.end(refused, Outcome.FAILED, "Not now.", code="MAV_RESULT_TEMPORARILY_REJECTED")
    assert (refused.state, refused.code) == (State.FAILED, "MAV_RESULT_TEMPORARILY_REJECTED")
    assert [one.work.command for one in scene.sent()] == [400]


def test_a_step_that_has_become_needless_is_left_out() -> None:
    scene = Scene()
    steps = [Step(CommandWork(400), 5.0, skip=lambda: True), Step(CommandWork(22), 5.0)]
    operation = scene.begin(Order("command", Lane.COMMANDS, steps, True))
    assert [one.work.command for one in scene.sent()] == [22]
    scene.end(operation)
    assert operation.state is State.DONE


def move_the_controls(scene: Scene) -> None:
    scene.apply(record(1, (1,), holder=1, epoch=9))


def fence(scene: Scene) -> None:
    scene.hub.changes.fence(DroneId(1))


@pytest.mark.parametrize("move", [move_the_controls, fence], ids=["moved", "about to move"])
def test_no_step_is_sent_once_the_controls_have_moved(move: Callable[[Scene], None]) -> None:
    scene = Scene()
    operation = scene.begin(COMMAND)
    move(scene)
    scene.end(operation)
    assert operation.state is State.CANCELLED
    assert "controls" in operation.words
    assert len(scene.sent()) == 1


def test_a_cancel_goes_to_the_agent_and_the_end_still_comes_from_there() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.service.cancel(operation)
    assert scene.sent()[-1] == CancelTransaction(id=operation.transaction_id)
    assert operation.running
    scene.end(operation, Outcome.CANCELLED, "The old plan is untouched.")
    assert operation.state is State.CANCELLED
    scene.service.cancel(operation)
    assert scene.sent() == []


def test_one_of_a_kind_at_a_time_and_a_writer_does_not_wait_for_a_reader() -> None:
    scene = Scene()
    reading = scene.begin(DOWNLOAD)
    with pytest.raises(DroneBusy):
        scene.begin(DOWNLOAD)
    writing = scene.begin()
    assert reading.state is State.CANCELLED
    assert [type(one).__name__ for one in scene.sent()] == ["Transaction", "CancelTransaction", "Transaction"]
    with pytest.raises(DroneBusy, match="alice"):
        scene.begin()
    scene.end(writing)
    scene.begin()


def test_whoever_compares_a_plan_or_reads_parameters_is_in_nobodys_way() -> None:
    scene = Scene()
    verify = Step(PlanVerifyWork(PlanKind.MISSION, ITEMS), 60.0)
    comparing = scene.begin(Order("plan_verify", Lane.PLANS, [verify], False, PlanKind.MISSION))
    scene.begin()
    assert comparing.state is State.CANCELLED
    read = Order("parameters_read", Lane.PARAMETERS, [Step(ParametersReadWork(again=True), 60.0)], False)
    write = Order("parameters_write", Lane.PARAMETERS, [Step(ParametersWriteWork((("A", 1.0),)), 60.0)], True)
    reading = scene.begin(read)
    scene.begin(write)
    assert reading.running
    for order in (read, write):
        with pytest.raises(DroneBusy):
            scene.begin(order)


def test_nothing_is_begun_without_an_agent_that_takes_it() -> None:
    with pytest.raises(AgentTooOld):
        Scene(takes=()).begin()
    scene = Scene()
    scene.agent_.link.has_channel = False
    with pytest.raises(DroneOffline):
        scene.begin()
    scene.hub.detach_link(scene.agent_.link)
    with pytest.raises(DroneOffline):
        scene.begin()


def test_a_lost_link_ends_nothing_and_the_same_agent_tells_when_it_is_back() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.hub.detach_link(scene.agent_.link)
    scene.pass_time(1.0)
    assert (operation.state, operation.phase) == (State.RUNNING, LINK_LOST)
    back = scene.come(process=7, link_id=55)
    scene.pass_time(1.0)
    assert operation.phase == ""
    scene.announce(TransactionResult(id=operation.transaction_id, outcome=Outcome.DONE, words="All there."), back)
    assert operation.state is State.DONE


def test_a_cancel_while_the_link_is_lost_is_told_when_it_is_back() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.hub.detach_link(scene.agent_.link)
    scene.pass_time(1.0)
    scene.service.cancel(operation)
    scene.agent_ = scene.come(process=7, link_id=55)
    scene.pass_time(1.0)
    assert scene.sent() == [CancelTransaction(id=operation.transaction_id)]


@pytest.mark.parametrize("resumed", [False, True], ids=["new-link", "resumed-link"])
@pytest.mark.parametrize("speaks", [False, True])
def test_an_agent_that_is_back_and_says_nothing_of_a_plan_is_asked_once(resumed: bool, speaks: bool) -> None:
    scene = Scene()
    operation, command = scene.begin(), scene.begin(COMMAND)
    scene.sent()
    scene.pass_time(0.1)
    if resumed:
        scene.hub.resumed(scene.agent_.link)
    else:
        scene.hub.detach_link(scene.agent_.link)
        scene.pass_time(1.0)
        scene.agent_ = scene.come(process=7, link_id=55)
    scene.pass_time(0.1)
    if speaks:
        scene.announce(TransactionProgress(id=operation.transaction_id, phase="writing", done=1, total=2))
    scene.pass_time(ASK_AFTER_S - 0.2)
    assert scene.sent() == []
    scene.pass_time(0.2)
    scene.pass_time(0.2)
    asked = [one for one in scene.sent() if one.id != command.transaction_id]
    assert asked == ([] if speaks else [CancelTransaction(id=operation.transaction_id)])
    if not speaks:
        scene.end(operation, Outcome.REFUSED, "It never came.")
        assert operation.state is State.REFUSED


def test_what_ran_in_an_agent_that_was_started_again_has_failed() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.come(process=8, link_id=55)
    scene.pass_time(1.0)
    assert operation.state is State.FAILED
    assert "Drone 1" in operation.words
    assert "check what is on board" in operation.words


def test_an_end_that_nobody_heard_is_told_as_such_and_put_right_when_the_agent_is_back() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.hub.detach_link(scene.agent_.link)
    scene.pass_time(60.0 + GRACE_S)
    assert operation.running
    scene.pass_time(0.1)
    assert operation.state is State.TIMED_OUT
    back = scene.come(process=7, link_id=55)
    scene.announce(TransactionResult(id=operation.transaction_id, outcome=Outcome.DONE, words="All there."), back)
    assert (operation.state, operation.words) == (State.DONE, "All there.")


def take_off_in_progress(scene: Scene, seconds: int) -> Operation:
    """An agent that reports progress each second."""
    step = Step(CommandWork(command=22), 8.0, "taking off")
    operation = scene.begin(Order("command", Lane.COMMANDS, [step], writes=True))
    for _ in range(seconds):
        scene.announce(TransactionProgress(id=operation.transaction_id, phase="carrying out", done=0, total=0))
        scene.pass_time(1.0)
    return operation


def test_a_command_in_progress_has_longer_than_its_deadline() -> None:
    scene = Scene()
    operation = take_off_in_progress(scene, seconds=60)
    assert operation.running
    scene.end(operation)
    assert operation.state is State.DONE


def test_a_command_in_progress_has_no_end_of_time() -> None:
    scene = Scene()
    operation = take_off_in_progress(scene, seconds=round(8 + MAX_EXTENDED_S + GRACE_S))
    assert operation.running
    scene.pass_time(1.0)
    assert operation.state is State.TIMED_OUT


def test_a_refused_step_tells_the_item_whose_effect_it_was_to_set_again() -> None:
    scene = Scene()
    steps = [
        Step(CommandWork(command=206), 8.0, "a photograph every 12 m", item=2),
        Step(CommandWork(command=300), 8.0),
    ]
    operation = scene.begin(Order("command", Lane.COMMANDS, steps, writes=True))
    scene.end(operation, Outcome.FAILED, "It does not know this command.")
    assert (operation.state, operation.item) == (State.FAILED, 2)
    done = scene.begin(Order("command", Lane.COMMANDS, steps, writes=True))
    scene.end(done)
    scene.end(done, Outcome.FAILED, "Not now.")
    assert (done.state, done.item) == (State.FAILED, None)


def test_the_turn_stays_with_the_assistant_for_as_long_as_their_work_goes_on() -> None:
    scene = Scene()
    turn, bob = scene.drone.turn, UserId(2)
    scene.drone.lease = replace(scene.drone.lease, assistant=ALICE)
    assert not scene.service.has_turn(scene.drone, ALICE.id, 0.0)
    turn.changed(0.0)
    assert scene.service.has_turn(scene.drone, ALICE.id, 0.0)
    assert not scene.service.has_turn(scene.drone, bob, 0.0)
    operation = scene.begin()
    for _ in range(30):
        scene.pass_time(0.1)
        assert not turn.over(scene.now)
    scene.end(operation)
    scene.pass_time(BACK_AFTER_S)
    assert turn.over(scene.now)
    turn.changed(scene.now)
    assert scene.service.has_turn(scene.drone, bob, scene.now)


def test_a_step_that_was_done_unheard_does_not_stand_for_those_that_were_to_follow() -> None:
    scene = Scene()
    operation = scene.begin(COMMAND)
    scene.hub.detach_link(scene.agent_.link)
    scene.pass_time(5.0 + GRACE_S + 0.1)
    assert operation.state is State.TIMED_OUT
    back = scene.come(process=7, link_id=55)
    scene.announce(TransactionResult(id=operation.transaction_id, outcome=Outcome.DONE, words="Accepted."), back)
    assert operation.state is State.FAILED
    assert "the rest was not sent" in operation.words
    assert [one for one in back.posted if isinstance(one, Transaction)] == []


def test_what_is_over_keeps_no_plan() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.end(operation)
    assert operation.order.steps == ()
    assert operation.order.work == "plan_upload"


def test_an_operation_of_a_drone_that_is_removed_ends() -> None:
    scene = Scene()
    operation = scene.begin()
    scene.apply(record(2, (2,)))
    scene.pass_time(0.1)
    assert operation.state is State.FAILED


def test_what_is_over_is_forgotten_after_an_hour_or_a_thousand_others() -> None:
    scene = Scene()
    first = scene.begin()
    scene.end(first)
    scene.pass_time(ENDED_KEPT_S - 1.0)
    assert scene.service.find(first.id) is first
    scene.pass_time(2.0)
    assert scene.service.find(first.id) is None
    many = []
    for _ in range(MAX_ENDED + 1):
        many.append(scene.begin())
        scene.end(many[-1])
        scene.sent()
    scene.pass_time(1.0)
    assert scene.service.find(many[0].id) is None
    assert scene.service.find(many[1].id) is many[1]


def test_ids_grow_over_a_restart() -> None:
    """NOW of the world is 2026: ids from an agent that still works for the previous tower must not match new ones."""
    assert Scene().begin().id > 1_700_000_000
