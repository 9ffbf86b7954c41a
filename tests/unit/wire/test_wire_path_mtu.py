"""The search for the largest datagram that passes, against paths of every size."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.ids import DroneId, LinkId
from wire.path_mtu import (
    BELIEVED_FOR_S,
    CLOSE_ENOUGH_BYTES,
    SAFE_DATAGRAM_BYTES,
    SEARCH_AGAIN_S,
    SILENT_UPLINK_S,
    VERIFY_S,
    PathMtu,
    PathMtus,
)
from wire.sealed_link import SealedLink
from wire.sealing import MAX_DATAGRAM_BYTES


def run(search: PathMtu, passes: int, *, since: float, for_s: float) -> list[int]:
    """Ticks every 0.1 s over a path with 50 ms round trip. Returns the sizes that were tried."""
    tried = []
    for tenths in range(int(for_s * 10)):
        now = since + tenths / 10
        size = search.probe_due(now)
        if size is not None:
            tried.append(size)
            if size <= passes:
                search.answered(size, now + 0.05)
    return tried


def test_an_ordinary_path_is_known_after_one_probe() -> None:
    search = PathMtu(0.0)
    assert search.datagram_bytes == SAFE_DATAGRAM_BYTES
    assert run(search, 1500, since=0.0, for_s=VERIFY_S - 1) == [MAX_DATAGRAM_BYTES]
    assert search.datagram_bytes == MAX_DATAGRAM_BYTES


@given(st.integers(SAFE_DATAGRAM_BYTES, MAX_DATAGRAM_BYTES))
def test_what_is_found_passes_and_is_close_to_the_best(passes: int) -> None:
    search = PathMtu(0.0)
    tried = run(search, passes, since=0.0, for_s=29.0)
    assert passes - CLOSE_ENOUGH_BYTES <= search.datagram_bytes <= passes
    assert len(tried) <= 24


def test_a_path_that_shrinks_is_noticed_and_searched_anew() -> None:
    search = PathMtu(0.0)
    run(search, 1500, since=0.0, for_s=10.0)
    run(search, 1300, since=10.0, for_s=2 * VERIFY_S)
    assert 1300 - CLOSE_ENOUGH_BYTES <= search.datagram_bytes <= 1300


def test_a_path_that_grows_is_noticed_in_the_end() -> None:
    search = PathMtu(0.0)
    run(search, 1280, since=0.0, for_s=60.0)
    assert search.datagram_bytes <= 1280
    run(search, 1500, since=60.0, for_s=SEARCH_AGAIN_S + 60.0)
    assert search.datagram_bytes == MAX_DATAGRAM_BYTES


def test_a_lost_probe_is_not_a_size_that_is_too_large() -> None:
    search = PathMtu(0.0)
    assert search.probe_due(0.0) == search.probe_due(1.0) == MAX_DATAGRAM_BYTES
    search.answered(MAX_DATAGRAM_BYTES, 1.2)
    assert search.datagram_bytes == MAX_DATAGRAM_BYTES


def test_an_answer_to_a_smaller_probe_says_nothing_of_the_larger() -> None:
    search = PathMtu(0.0)
    search.probe_due(0.0)
    search.answered(61, 0.1)
    assert search.datagram_bytes == SAFE_DATAGRAM_BYTES


def test_the_other_side_fills_its_datagrams_as_far_as_it_saw_probes_arrive() -> None:
    agent, tower = two_sides()
    assert tower.datagram_bytes == SAFE_DATAGRAM_BYTES
    tower.receive(agent.seal_probe(5.0), 5.0)
    assert tower.datagram_bytes == SAFE_DATAGRAM_BYTES
    tower.receive(agent.seal_probe(5.0, datagram_bytes=1300), 5.0)
    assert tower.datagram_bytes == 1300
    tower.datagrams_to_send(5.0 + BELIEVED_FOR_S)
    assert tower.datagram_bytes == 1300
    tower.datagrams_to_send(5.1 + BELIEVED_FOR_S)
    assert tower.datagram_bytes == SAFE_DATAGRAM_BYTES
    assert agent.datagram_bytes == SAFE_DATAGRAM_BYTES


def run_several(search: PathMtus, passes: dict[int, int], *, since: float, for_s: float) -> set[int]:
    """As `run`, over several uplinks: the number of each working one and its largest datagram. Returns which were
    probed."""
    probed = set()
    for tenths in range(int(for_s * 10)):
        now = since + tenths / 10
        for number, size in search.probes_due(passes, now):
            probed.add(number)
            if size <= passes[number]:
                search.answered(number, size, now + 0.05)
    return probed


def test_of_several_uplinks_the_least_counts_that_works() -> None:
    search = PathMtus(2, 0.0)
    assert run_several(search, {0: 1500, 1: 1300}, since=0.0, for_s=29.0) == {0, 1}
    assert 1300 - CLOSE_ENOUGH_BYTES <= search.datagram_bytes <= 1300
    narrow = search.datagram_bytes
    assert run_several(search, {0: 1500}, since=29.0, for_s=VERIFY_S) == {0}, "what carries nothing is not probed"
    assert search.datagram_bytes == MAX_DATAGRAM_BYTES
    assert run_several(search, {}, since=60.0, for_s=10.0) == set()
    assert search.datagram_bytes == MAX_DATAGRAM_BYTES, "nothing has been learnt"
    run_several(search, {0: 1500, 1: 1300}, since=70.0, for_s=0.1)
    assert search.datagram_bytes == narrow, "it is back, and what it carried is known"


def test_an_uplink_by_which_no_probe_was_answered_yet_keeps_the_size_safe() -> None:
    search = PathMtus(2, 0.0)
    for number, size in search.probes_due([0, 1], 0.0):
        if number == 0:
            search.answered(number, size, 0.05)
    search.probes_due([0, 1], 0.1)
    assert search.datagram_bytes == SAFE_DATAGRAM_BYTES


def test_the_other_side_goes_by_the_least_of_the_uplinks_too() -> None:
    agent, tower = two_sides()

    def say(now: float, *, uplink: int, datagram_bytes: int = 0) -> None:
        tower.receive(agent.seal_probe(now, uplink=uplink, datagram_bytes=datagram_bytes), now)

    say(5.0, uplink=0, datagram_bytes=1452)
    assert tower.datagram_bytes == 1452
    say(5.1, uplink=1)
    assert tower.datagram_bytes == SAFE_DATAGRAM_BYTES, "nothing is known of that one"
    say(5.2, uplink=1, datagram_bytes=1300)
    assert tower.datagram_bytes == 1300
    for tenths in range(1, 22):
        say(5.2 + tenths / 10, uplink=0)
        assert tower.datagram_bytes == (1300 if tenths / 10 <= SILENT_UPLINK_S else 1452)
    say(7.4, uplink=1)
    assert tower.datagram_bytes == 1300, "it is back"
    tower.datagrams_to_send(7.4 + SILENT_UPLINK_S)
    assert tower.datagram_bytes == 1300
    say(5.1 + BELIEVED_FOR_S, uplink=0)
    assert tower.datagram_bytes == SAFE_DATAGRAM_BYTES, "no probe of its size for long"


def two_sides() -> tuple[SealedLink, SealedLink]:
    """(agent, tower)"""
    agent, tower = (
        SealedLink(link_id=LinkId(3), drone_id=DroneId(1), send_key=send, receive_key=receive, now=0.0)
        for send, receive in ((b"a" * 32, b"b" * 32), (b"b" * 32, b"a" * 32))
    )
    return agent, tower


@pytest.mark.parametrize("datagram_bytes", [SAFE_DATAGRAM_BYTES, 1300, MAX_DATAGRAM_BYTES])
def test_batches_keep_to_the_size(datagram_bytes: int) -> None:
    link = SealedLink(link_id=LinkId(3), drone_id=DroneId(1), send_key=b"a" * 32, receive_key=b"b" * 32, now=0.0)
    link.fill_datagrams(datagram_bytes)
    frame = bytes((0xFD, 20, 0, 0, 0, 1, 1, 30, 0, 0)) + bytes(22)
    sizes = [len(one) for one in link.batch_frames(1, [frame] * 200, 1.0)]  # type: ignore[arg-type]
    assert datagram_bytes - len(frame) < max(sizes) <= datagram_bytes
