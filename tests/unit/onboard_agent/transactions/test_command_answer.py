"""A command is repeated until acknowledged, unless a repetition would execute it twice; a deadline ends it."""

import pytest

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, command_long
from onboard_agent.transactions.command_answer import ANSWER_WITHIN_S, NOT_NOW_AGAIN_S, ONCE, TRIES, CommandAnswer
from wire.dialect import decode, mavlink
from wire.transactions import Outcome

MODE = mavlink.MAV_CMD_DO_SET_MODE


def command(number: int = MODE, deadline: float = 20.0) -> CommandAnswer:
    maker = FrameMaker()

    def make(confirmation: int) -> bytes:
        return maker.make(command_long(1, number, 1.0, confirmation=confirmation), agent_sender(1))

    return CommandAnswer(number, make, deadline=deadline)


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
