"""The queue for a stream: in order, bounded in bytes and in time, evicts the oldest."""

from hypothesis import given
from hypothesis import strategies as st

from wire.datagram_lane import LANE_AGE_S, LANE_BYTES, DatagramLane


def test_first_in_first_out() -> None:
    lane = DatagramLane()
    lane.put(b"1", 0.0)
    lane.put(b"2", 0.1)
    assert [lane.pop(0.2), lane.pop(0.2), lane.pop(0.2)] == [b"1", b"2", None]
    assert lane.lost == 0


def test_the_oldest_goes_where_there_is_no_room() -> None:
    lane = DatagramLane()
    datagrams = [bytes([n]) * 1200 for n in range(20)]
    for datagram in datagrams:
        lane.put(datagram, 0.0)
    kept = []
    while (one := lane.pop(0.0)) is not None:
        kept.append(one)
    assert kept == datagrams[-(LANE_BYTES // 1200) :]
    assert lane.lost == 20 - len(kept)


def test_what_is_too_old_is_never_sent() -> None:
    lane = DatagramLane()
    lane.put(b"old", 0.0)
    lane.put(b"young", LANE_AGE_S)
    assert lane.pop(LANE_AGE_S + 0.01) == b"young"
    assert lane.lost == 1


def test_a_change_of_transport_forgets_it_all() -> None:
    lane = DatagramLane()
    lane.put(b"1", 0.0)
    lane.clear()
    assert lane.pop(0.0) is None


@given(st.lists(st.tuples(st.integers(1, 1452), st.floats(0, 0.3), st.booleans())))
def test_it_never_holds_more_than_it_may(steps: list[tuple[int, float, bool]]) -> None:
    lane = DatagramLane()
    now, put, got = 0.0, 0, 0
    for size, pause, takes in steps:
        now += pause
        lane.put(bytes(size), now)
        put += 1
        assert sum(len(datagram) for _, datagram in lane._waiting) == lane._bytes <= LANE_BYTES
        if takes:
            got += lane.pop(now) is not None
    assert put == got + lane.lost + len(lane._waiting)
