"""When the data channel's socket is read at once, and when it rests for company."""

from server.relay.read_rhythm import ENOUGH, LONGEST_REST_S, PATIENCE, SHORTEST_REST_S, ReadRhythm


def test_datagrams_far_apart_are_read_at_once() -> None:
    rhythm = ReadRhythm()
    assert [rhythm.came_alone(second / 10) for second in range(20)] == [None] * 20


def test_one_agent_that_sends_at_every_deadline_is_never_delayed() -> None:
    rhythm = ReadRhythm()
    assert [rhythm.came_alone(number * LONGEST_REST_S) for number in range(100)] == [None] * 100


def test_two_close_together_begin_to_be_read_in_rounds() -> None:
    rhythm = ReadRhythm()
    assert rhythm.came_alone(1.0) is None
    assert rhythm.came_alone(1.001) == LONGEST_REST_S
    assert rhythm.rested(3) == LONGEST_REST_S


def test_after_an_empty_round_the_socket_is_watched_and_the_next_one_is_still_followed_by_a_rest() -> None:
    rhythm = ReadRhythm()
    rhythm.came_alone(1.0)
    rhythm.came_alone(1.001)
    assert rhythm.rested(0) is None
    assert rhythm.came_alone(1.02) == LONGEST_REST_S


def test_without_company_it_stops() -> None:
    rhythm = ReadRhythm()
    rhythm.came_alone(1.0)
    rhythm.came_alone(1.001)
    assert [rhythm.rested(1) for _ in range(PATIENCE)] == [LONGEST_REST_S] * (PATIENCE - 1) + [None]
    assert rhythm.came_alone(1.1) is None


def test_many_make_rests_shorter_until_enough_come_together() -> None:
    per_s = 6_000.0
    rhythm = ReadRhythm()
    rhythm.came_alone(1.0)
    rest_s = rhythm.came_alone(1.001)
    for _ in range(5):
        assert rest_s is not None
        rest_s = rhythm.rested(round(per_s * rest_s))
    assert rest_s is not None and round(per_s * rest_s) == ENOUGH
    assert rhythm.rested(100 * ENOUGH) == SHORTEST_REST_S
    assert rhythm.rested(2) == 8 * SHORTEST_REST_S
