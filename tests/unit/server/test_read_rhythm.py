"""When the data channel's socket is read at once, and when reads are batched."""

from server.link.core.read_pacer import (
    BATCH_GOAL,
    MAX_REST_S,
    MAX_SMALL_ROUNDS,
    MIN_REST_S,
    MIN_STEADY,
    URGENT_REST_S,
    ReadPacer,
)


def in_company() -> ReadPacer:
    pacer = ReadPacer()
    assert pacer.arrived(1.0) is None
    assert pacer.arrived(1.001) is None
    assert pacer.arrived(1.002) is None
    return pacer


def test_datagrams_far_apart_are_read_at_once() -> None:
    pacer = ReadPacer()
    assert [pacer.arrived(second / 10) for second in range(20)] == [None] * 20


def test_one_agent_that_sends_at_every_deadline_is_never_delayed() -> None:
    pacer = ReadPacer()
    assert [pacer.arrived(number * 0.010) for number in range(100)] == [None] * 100


def test_after_three_close_together_the_next_one_begins_a_rest() -> None:
    assert in_company().arrived(1.003) == MAX_REST_S


def test_pairs_are_no_company() -> None:
    pacer = ReadPacer()
    moments = [second / 10 + late for second in range(100) for late in (0.0, 0.001)]
    assert [pacer.arrived(moment) for moment in moments] == [None] * 200


def test_rests_that_bring_pairs_at_most_come_to_an_end() -> None:
    pacer = in_company()
    for number in range(MAX_SMALL_ROUNDS):
        assert pacer.arrived(2.0 + number) == MAX_REST_S
        assert pacer.read_after_rest(1 + number % 2) is None
    assert pacer.arrived(20.0) is None


def test_one_round_of_three_keeps_the_rests_going() -> None:
    pacer = in_company()
    for number in range(4 * MAX_SMALL_ROUNDS):
        assert pacer.arrived(2.0 + number) == MAX_REST_S
        assert pacer.read_after_rest(2 if (number + 1) % MAX_SMALL_ROUNDS else 3) is None


def test_after_a_round_of_several_the_next_rest_begins_at_once_and_after_a_pair_with_what_comes() -> None:
    pacer = in_company()
    assert pacer.read_after_rest(MIN_STEADY) == MAX_REST_S
    assert pacer.read_after_rest(2) is None
    assert pacer.arrived(1.1) == MAX_REST_S


def test_while_somebody_waits_rests_are_short_from_the_next_one_on() -> None:
    pacer = in_company()
    assert pacer.read_after_rest(MIN_STEADY) == MAX_REST_S
    pacer.urgent = True
    assert pacer.read_after_rest(MIN_STEADY) == URGENT_REST_S
    assert pacer.read_after_rest(2) is None
    assert pacer.arrived(1.1) == URGENT_REST_S
    pacer.urgent = False
    assert pacer.read_after_rest(MIN_STEADY) == URGENT_REST_S * BATCH_GOAL / MIN_STEADY
    assert pacer.read_after_rest(MIN_STEADY) == MAX_REST_S


def test_an_empty_round_is_followed_by_watching() -> None:
    pacer = in_company()
    assert pacer.read_after_rest(MIN_STEADY) == MAX_REST_S
    assert pacer.read_after_rest(0) is None
    assert pacer.arrived(1.1) == MAX_REST_S


def test_without_company_it_stops() -> None:
    pacer = in_company()
    for number in range(MAX_SMALL_ROUNDS):
        assert pacer.arrived(2.0 + number) == MAX_REST_S
        assert pacer.read_after_rest(1) is None
    assert pacer.arrived(20.0) is None


def test_many_make_rests_shorter_until_enough_come_together() -> None:
    per_s = 6_000.0
    pacer = in_company()
    rest_s = pacer.arrived(1.002)
    for _ in range(5):
        assert rest_s is not None
        rest_s = pacer.read_after_rest(round(per_s * rest_s))
    assert rest_s is not None and round(per_s * rest_s) == BATCH_GOAL
    assert pacer.read_after_rest(100 * BATCH_GOAL) == MIN_REST_S
    assert pacer.read_after_rest(2) == BATCH_GOAL / 2 * MIN_REST_S
