"""When the data channel's socket is read at once, and when reads are batched."""

from server.live.relay.read_pacer import (
    ENOUGH,
    HURRIED_REST_S,
    MAX_REST_S,
    MIN_REST_S,
    PATIENCE,
    SEVERAL,
    ReadPacer,
)


def in_company() -> ReadPacer:
    rhythm = ReadPacer()
    assert rhythm.came(1.0) is None
    assert rhythm.came(1.001) is None
    assert rhythm.came(1.002) is None
    return rhythm


def test_datagrams_far_apart_are_read_at_once() -> None:
    rhythm = ReadPacer()
    assert [rhythm.came(second / 10) for second in range(20)] == [None] * 20


def test_one_agent_that_sends_at_every_deadline_is_never_delayed() -> None:
    rhythm = ReadPacer()
    assert [rhythm.came(number * 0.010) for number in range(100)] == [None] * 100


def test_after_three_close_together_the_next_one_begins_a_rest() -> None:
    assert in_company().came(1.003) == MAX_REST_S


def test_pairs_are_no_company() -> None:
    rhythm = ReadPacer()
    moments = [second / 10 + late for second in range(100) for late in (0.0, 0.001)]
    assert [rhythm.came(moment) for moment in moments] == [None] * 200


def test_rests_that_bring_pairs_at_most_come_to_an_end() -> None:
    rhythm = in_company()
    for number in range(PATIENCE):
        assert rhythm.came(2.0 + number) == MAX_REST_S
        assert rhythm.rested(1 + number % 2) is None
    assert rhythm.came(20.0) is None


def test_one_round_of_three_keeps_the_rests_going() -> None:
    rhythm = in_company()
    for number in range(4 * PATIENCE):
        assert rhythm.came(2.0 + number) == MAX_REST_S
        assert rhythm.rested(2 if (number + 1) % PATIENCE else 3) is None


def test_after_a_round_of_several_the_next_rest_begins_at_once_and_after_a_pair_with_what_comes() -> None:
    rhythm = in_company()
    assert rhythm.rested(SEVERAL) == MAX_REST_S
    assert rhythm.rested(2) is None
    assert rhythm.came(1.1) == MAX_REST_S


def test_while_somebody_waits_rests_are_short_from_the_next_one_on() -> None:
    rhythm = in_company()
    assert rhythm.rested(SEVERAL) == MAX_REST_S
    rhythm.hurries = True
    assert rhythm.rested(SEVERAL) == HURRIED_REST_S
    assert rhythm.rested(2) is None
    assert rhythm.came(1.1) == HURRIED_REST_S
    rhythm.hurries = False
    assert rhythm.rested(SEVERAL) == HURRIED_REST_S * ENOUGH / SEVERAL
    assert rhythm.rested(SEVERAL) == MAX_REST_S


def test_an_empty_round_is_followed_by_watching() -> None:
    rhythm = in_company()
    assert rhythm.rested(SEVERAL) == MAX_REST_S
    assert rhythm.rested(0) is None
    assert rhythm.came(1.1) == MAX_REST_S


def test_without_company_it_stops() -> None:
    rhythm = in_company()
    for number in range(PATIENCE):
        assert rhythm.came(2.0 + number) == MAX_REST_S
        assert rhythm.rested(1) is None
    assert rhythm.came(20.0) is None


def test_many_make_rests_shorter_until_enough_come_together() -> None:
    per_s = 6_000.0
    rhythm = in_company()
    rest_s = rhythm.came(1.002)
    for _ in range(5):
        assert rest_s is not None
        rest_s = rhythm.rested(round(per_s * rest_s))
    assert rest_s is not None and round(per_s * rest_s) == ENOUGH
    assert rhythm.rested(100 * ENOUGH) == MIN_REST_S
    assert rhythm.rested(2) == ENOUGH / 2 * MIN_REST_S
