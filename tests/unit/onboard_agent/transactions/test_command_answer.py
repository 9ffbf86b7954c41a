"""A command is repeated until acknowledged, unless a repetition would execute it twice; a deadline ends it."""

import pytest

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, command_long
from onboard_agent.transactions.command_answer import ANSWER_WITHIN_S, NOT_NOW_AGAIN_S, ONCE, TRIES, CommandAnswer
from wire.autopilots.command_messages import as_the_other
from wire.dialect import decode, mavlink
from wire.transactions import MAX_EXTENDED_S, PROGRESS_EXTENDS_S, Outcome

MODE = mavlink.MAV_CMD_DO_SET_MODE


def command(number: int = MODE, deadline: float = 20.0, *, other: bool = False) -> CommandAnswer:
    maker = FrameMaker()

    def make(confirmation: int) -> bytes:
        return maker.make(command_long(1, number, 1.0, confirmation=confirmation), agent_sender(1))

    def make_other(confirmation: int) -> bytes:
        return maker.make(as_the_other(command_long(1, number, 1.0), 3, confirmation), agent_sender(1))

    return CommandAnswer(number, make, deadline=deadline, make_other=make_other if other else None)


def names(frames: list[bytes]) -> list[str]:
    return [decode(frame).get_type() for frame in frames]


def ack(result: int, number: int = MODE, progress: int = 0) -> object:
    return mavlink.MAVLink_command_ack_message(number, result, progress, 0, 1, 191)


def sent_until(answer: CommandAnswer, until: float) -> list[tuple[float, int]]:
    """Returns (when, confirmation) of all commands sent, polled every 0.1 s."""
    times = [step / 10 for step in range(round(until * 10))]
    return [(now, decode(frame).confirmation) for now in times for frame in answer.due(now)]


def test_it_is_repeated_with_the_next_confirmation_and_then_times_out() -> None:
    answer = command(deadline=10.0)
    sent = sent_until(answer, 10.1)
    assert sent == [(pytest.approx(i * ANSWER_WITHIN_S), i) for i in range(TRIES)]
    assert answer.end is not None and answer.end.outcome is Outcome.TIMED_OUT
    assert "not known" in answer.end.words
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), 10.2)
    assert answer.end.outcome is Outcome.TIMED_OUT


@pytest.mark.parametrize("number", sorted(ONCE))
def test_what_would_be_done_twice_is_sent_once(number: int) -> None:
    assert sent_until(command(number), 19.0) == [(0.0, 0)]


@pytest.mark.parametrize(
    ("result", "outcome", "code"),
    [
        (mavlink.MAV_RESULT_ACCEPTED, Outcome.DONE, "MAV_RESULT_ACCEPTED"),
        (mavlink.MAV_RESULT_DENIED, Outcome.FAILED, "MAV_RESULT_DENIED"),
        (mavlink.MAV_RESULT_UNSUPPORTED, Outcome.FAILED, "MAV_RESULT_UNSUPPORTED"),
        (250, Outcome.FAILED, "MAV_RESULT 250"),
    ],
)
def test_the_answer_ends_it_in_words(result: int, outcome: Outcome, code: str) -> None:
    answer = command()
    assert len(answer.due(0.0)) == 1
    answer.acknowledged(ack(result), 0.1)
    assert answer.end is not None
    assert (answer.end.outcome, answer.end.code) == (outcome, code)
    assert answer.end.words.endswith(".")
    assert answer.due(5.0) == []


def test_in_progress_ends_the_repetitions_and_gives_it_until_the_deadline() -> None:
    answer = command(deadline=20.0)
    assert len(answer.due(0.0)) == 1
    answer.acknowledged(ack(mavlink.MAV_RESULT_IN_PROGRESS, progress=40), 1.0)
    assert answer.percent == 40
    assert answer.due(2.0) == answer.due(19.9) == []
    assert answer.end is None
    answer.acknowledged(ack(mavlink.MAV_RESULT_FAILED), 19.95)
    assert answer.end is not None and answer.end.outcome is Outcome.FAILED


def test_each_in_progress_extends_the_deadline() -> None:
    answer = command(deadline=8.0)
    answer.due(0.0)
    for second in range(1, 60):
        answer.acknowledged(ack(mavlink.MAV_RESULT_IN_PROGRESS, progress=255), float(second))
        assert answer.due(second + 0.5) == [] and answer.end is None
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), 59.5 + PROGRESS_EXTENDS_S - 1.0)
    assert answer.end is not None and answer.end.outcome is Outcome.DONE


def test_in_progress_does_not_extend_for_ever() -> None:
    answer = command(deadline=8.0)
    answer.due(0.0)
    seconds = 0
    while answer.end is None:
        seconds += 1
        answer.acknowledged(ack(mavlink.MAV_RESULT_IN_PROGRESS), float(seconds))
        answer.due(float(seconds))
    assert seconds == 8 + MAX_EXTENDED_S
    assert answer.end.outcome is Outcome.TIMED_OUT and "started" in answer.end.words


def test_silence_after_in_progress_ends_it() -> None:
    answer = command(deadline=8.0)
    answer.due(0.0)
    answer.acknowledged(ack(mavlink.MAV_RESULT_IN_PROGRESS), 7.0)
    assert answer.due(7.0 + PROGRESS_EXTENDS_S - 0.1) == [] and answer.end is None
    answer.due(7.0 + PROGRESS_EXTENDS_S)
    assert answer.end is not None and answer.end.outcome is Outcome.TIMED_OUT


ONLY = (
    mavlink.MAV_RESULT_UNSUPPORTED,
    mavlink.MAV_RESULT_COMMAND_LONG_ONLY,
    mavlink.MAV_RESULT_COMMAND_INT_ONLY,
)


@pytest.mark.parametrize("number", [MODE, mavlink.MAV_CMD_NAV_TAKEOFF])
@pytest.mark.parametrize("result", ONLY)
def test_a_refused_message_is_followed_by_the_other_one_at_once(result: int, number: int) -> None:
    answer = command(number, other=True)
    assert names(answer.due(0.0)) == ["COMMAND_LONG"]
    answer.acknowledged(ack(result, number), 0.1)
    assert names(answer.due(0.1)) == ["COMMAND_INT"]
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED, number), 0.2)
    assert answer.end is not None and answer.end.outcome is Outcome.DONE


@pytest.mark.parametrize("result", ONLY)
def test_the_other_message_is_tried_once_and_the_first_refusal_counts(result: int) -> None:
    answer = command(other=True)
    answer.due(0.0)
    answer.acknowledged(ack(mavlink.MAV_RESULT_UNSUPPORTED), 0.1)
    answer.due(0.1)
    answer.acknowledged(ack(result), 0.2)
    assert answer.end is not None
    assert (answer.end.outcome, answer.end.code) == (Outcome.FAILED, "MAV_RESULT_UNSUPPORTED")
    assert answer.due(0.3) == []


def test_a_real_refusal_of_the_other_message_counts() -> None:
    answer = command(other=True)
    answer.due(0.0)
    answer.acknowledged(ack(mavlink.MAV_RESULT_COMMAND_INT_ONLY), 0.1)
    answer.due(0.1)
    answer.acknowledged(ack(mavlink.MAV_RESULT_DENIED), 0.2)
    assert answer.end is not None and answer.end.code == "MAV_RESULT_DENIED"


def test_late_answers_to_the_first_message_do_not_end_the_other() -> None:
    answer = command(other=True)
    answer.due(0.0)
    answer.due(ANSWER_WITHIN_S)
    for now in (1.6, 1.7):
        answer.acknowledged(ack(mavlink.MAV_RESULT_UNSUPPORTED), now)
        answer.due(now)
    assert answer.end is None
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), 1.8)
    assert answer.end is not None and answer.end.outcome is Outcome.DONE


def test_the_other_message_is_repeated_too_with_its_own_confirmations() -> None:
    answer = command(other=True)
    answer.due(0.0)
    answer.acknowledged(ack(mavlink.MAV_RESULT_UNSUPPORTED), 0.1)
    times = [now / 10 for now in range(1, 200)]
    assert [name for now in times for name in names(answer.due(now))] == ["COMMAND_INT"] * TRIES


def test_after_a_later_command_the_other_message_is_not_tried() -> None:
    answer = command(other=True)
    answer.due(0.0)
    answer.repeat_no_more()
    answer.acknowledged(ack(mavlink.MAV_RESULT_COMMAND_INT_ONLY), 0.1)
    assert answer.due(0.2) == []
    assert answer.end is not None and answer.end.code == "MAV_RESULT_COMMAND_INT_ONLY"


def test_the_answer_to_another_command_or_to_one_that_was_not_sent_yet_says_nothing() -> None:
    answer = command()
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), 0.0)
    answer.due(0.0)
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED, number=400), 0.1)
    assert answer.end is None


def test_a_refusal_after_an_acceptance_counts_and_an_acceptance_after_a_refusal_does_not() -> None:
    answer = command()
    answer.due(0.0)
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), 0.1)
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), 0.11)
    assert answer.end is not None and answer.end.outcome is Outcome.DONE
    answer.acknowledged(ack(mavlink.MAV_RESULT_DENIED), 0.12)
    answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), 0.13)
    assert (answer.end.outcome, answer.end.code) == (Outcome.FAILED, "MAV_RESULT_DENIED")


def test_not_now_after_an_acceptance_is_tried_again_and_counts_at_last() -> None:
    answer = command()
    times = []
    for step in range(60):
        if answer.due(now := step / 10):
            times.append(now)
            answer.acknowledged(ack(mavlink.MAV_RESULT_ACCEPTED), now)
            answer.acknowledged(ack(mavlink.MAV_RESULT_TEMPORARILY_REJECTED), now)
    assert times == [pytest.approx(number * NOT_NOW_AGAIN_S) for number in range(TRIES)]
    assert answer.end is not None
    assert (answer.end.outcome, answer.end.code) == (Outcome.FAILED, "MAV_RESULT_TEMPORARILY_REJECTED")
