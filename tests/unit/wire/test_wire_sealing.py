"""Sealed datagrams: what opens, what is refused, and with which reason."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from wire.content import (
    MAX_URGENT_BYTES,
    Frames,
    Pong,
    Urgent,
    decode_content,
    encode_frames,
    encode_keepalive,
    encode_urgent,
)
from wire.dialect import build, mavlink
from wire.drops import Dropped, DropReason
from wire.ids import DroneId, Epoch, LinkId
from wire.replay import WINDOW, ReplayWindow
from wire.sealed_link import SealedLink
from wire.sealing import (
    MAX_CONTENT_BYTES,
    MAX_DATAGRAM_BYTES,
    MIN_DATAGRAM_BYTES,
    OVERHEAD_BYTES,
    Opener,
    Sealer,
)

KEY = b"k" * 32
LINK = LinkId(9)
FRAME = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=1, component_id=1, sequence=7)
LONG_FRAME = build(
    mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, [255] * 251), system_id=1, component_id=1, sequence=0
)


def reason_of(opener: Opener, datagram: bytes) -> DropReason:
    with pytest.raises(Dropped) as caught:
        opener.open(datagram)
    return caught.value.reason


GOOD = Sealer(KEY, LINK).seal(b"content")
REFUSALS = {
    "empty": (b"", DropReason.TOO_SHORT),
    "truncated": (GOOD[: MIN_DATAGRAM_BYTES - 1], DropReason.TOO_SHORT),
    "too long": (GOOD + bytes(MAX_DATAGRAM_BYTES), DropReason.TOO_LONG),
    "another version": (b"\x02" + GOOD[1:], DropReason.BAD_VERSION),
    "a key phase that is far away": (GOOD[:1] + b"\x02" + GOOD[2:], DropReason.BAD_KEY_PHASE),
    "a key phase that was": (GOOD[:1] + b"\xff" + GOOD[2:], DropReason.BAD_KEY_PHASE),
    "the next key phase, without its key": (GOOD[:1] + b"\x01" + GOOD[2:], DropReason.NOT_AUTHENTIC),
    "another link": (Sealer(KEY, LinkId(10)).seal(b"content"), DropReason.UNKNOWN_LINK),
    "a link id that was changed": (GOOD[:2] + b"\x0a" + GOOD[3:], DropReason.UNKNOWN_LINK),
    "a wrong key": (Sealer(b"w" * 32, LINK).seal(b"content"), DropReason.NOT_AUTHENTIC),
    "a counter that was changed": (GOOD[:6] + b"\x05" + GOOD[7:], DropReason.NOT_AUTHENTIC),
    "a content that was changed": (GOOD[:14] + bytes([GOOD[14] ^ 1]) + GOOD[15:], DropReason.NOT_AUTHENTIC),
    "a byte missing": (GOOD[:-1], DropReason.NOT_AUTHENTIC),
    "a byte too many": (GOOD + b"\0", DropReason.NOT_AUTHENTIC),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_each_refusal_has_its_reason_and_spoils_nothing(case: str) -> None:
    datagram, expected = REFUSALS[case]
    opener = Opener(KEY, LINK)
    assert reason_of(opener, datagram) is expected
    assert opener.open(GOOD) == b"content"


def test_a_repeat_is_refused() -> None:
    opener = Opener(KEY, LINK)
    opener.open(GOOD)
    assert reason_of(opener, GOOD) is DropReason.REPLAYED


def test_newest_is_said_of_the_newest_only() -> None:
    sealer, opener = Sealer(KEY, LINK), Opener(KEY, LINK)
    first, second, third = (sealer.seal(bytes([n])) for n in range(3))
    newest = []
    for datagram in (first, third, second):
        opener.open(datagram)
        newest.append(opener.newest)
    assert newest == [True, True, False]


@pytest.mark.parametrize("size", [0, MAX_CONTENT_BYTES + 1])
def test_a_content_that_does_not_fit_is_our_own_mistake(size: int) -> None:
    with pytest.raises(ValueError, match="does not fit"):
        Sealer(KEY, LINK).seal(bytes(size))


def test_the_largest_content_makes_the_largest_datagram() -> None:
    datagram = Sealer(KEY, LINK).seal(bytes(MAX_CONTENT_BYTES))
    assert len(datagram) == MAX_DATAGRAM_BYTES
    assert Opener(KEY, LINK).open(datagram) == bytes(MAX_CONTENT_BYTES)


def test_no_counter_is_used_twice() -> None:
    sealer = Sealer(KEY, LINK)
    counters = [int.from_bytes(sealer.seal(b"x")[6:14], "little") for _ in range(50)]
    assert counters == list(range(50))
    sealer._counter = 1 << 60
    with pytest.raises(RuntimeError):
        sealer.seal(b"x")


@given(st.binary(max_size=200))
def test_opener_raises_nothing_but_dropped(data: bytes) -> None:
    with pytest.raises(Dropped):
        Opener(KEY, LINK).open(data)


@given(st.binary(max_size=200))
def test_content_raises_nothing_but_dropped(data: bytes) -> None:
    frames = b"\x01" + bytes(12) + FRAME
    for content in (data, frames, frames + data, *(bytes((kind,)) + data for kind in range(11))):
        try:
            decoded = decode_content(content)
        except Dropped as dropped:
            assert dropped.reason in (DropReason.BAD_CONTENT, DropReason.BAD_FRAME)
            continue
        if isinstance(decoded, Frames):
            along = b"" if decoded.ping is None else encode_keepalive(decoded.ping)
            assert content[len(along) + 13 :] == b"".join(decoded.frames)
            assert content[1 : len(along)] == along[1:]
        elif isinstance(decoded, Urgent):
            assert encode_urgent(decoded.text) == content
        else:
            assert encode_keepalive(decoded) == content  # every byte of a ping and a pong has a meaning


CONTENTS = {
    "nothing": (b"", DropReason.BAD_CONTENT),
    "an unknown kind": (b"\x0a" + bytes(30), DropReason.BAD_CONTENT),
    "the ping of a draft": (b"\x02" + bytes(12), DropReason.BAD_CONTENT),
    "the ping of a later draft": (b"\x05" + bytes(30), DropReason.BAD_CONTENT),
    "frames without frames": (b"\x01" + bytes(8), DropReason.BAD_CONTENT),
    "a short ping": (b"\x07" + bytes(26), DropReason.BAD_CONTENT),
    "a ping with something in its padding": (b"\x07" + bytes(27) + b"x", DropReason.BAD_CONTENT),
    "a ping of a purpose that nobody knows": (b"\x07" + bytes(20) + b"\x03" + bytes(6), DropReason.BAD_CONTENT),
    "a long pong": (b"\x08" + bytes(21), DropReason.BAD_CONTENT),
    "a ping with nothing along": (b"\x09" + bytes(27), DropReason.BAD_CONTENT),
    "a ping with another ping along": (b"\x09" + bytes(27) + b"\x07" + bytes(27), DropReason.BAD_CONTENT),
    "a probe with frames along": (
        b"\x09" + bytes(20) + b"\x01" + bytes(6) + b"\x01" + bytes(12) + FRAME,
        DropReason.BAD_CONTENT,
    ),
    "a ping with a cut frame along": (b"\x09" + bytes(27) + b"\x01" + bytes(12) + FRAME[:-1], DropReason.BAD_FRAME),
    "a cut frame": (b"\x01" + bytes(8) + FRAME[:-1], DropReason.BAD_FRAME),
    "bytes behind the last frame": (b"\x01" + bytes(8) + FRAME + b"\0", DropReason.BAD_FRAME),
}


@pytest.mark.parametrize("case", CONTENTS)
def test_bad_contents(case: str) -> None:
    content, expected = CONTENTS[case]
    with pytest.raises(Dropped) as caught:
        decode_content(content)
    assert caught.value.reason is expected


@given(st.lists(st.sampled_from([FRAME, LONG_FRAME]), max_size=30))
def test_frames_are_packed_whole_in_order_and_within_the_limit(frames: list[bytes]) -> None:
    contents = encode_frames(DroneId(4), Epoch(2), 99, frames)
    decoded = [decode_content(content) for content in contents]
    assert [frame for part in decoded for frame in part.frames] == frames  # type: ignore[union-attr]
    assert all(0 < len(content) <= MAX_CONTENT_BYTES for content in contents)
    assert all(
        len(content) + len(decode_content(following).frames[0]) > MAX_CONTENT_BYTES  # type: ignore[union-attr]
        for content, following in pairwise(contents)
    ), "no datagram is left less full than it must be"


REPLAYS = [
    ("in order", [0, 1, 2], [True, True, True]),
    ("a repeat", [0, 0], [True, False]),
    ("a gap, filled later", [0, 5, 3, 3, 5], [True, True, True, False, False]),
    ("the edge of the window", [WINDOW, 1, 0], [True, True, False]),
    ("a jump past the window", [3, 3 + 5 * WINDOW, 3, 4 + 4 * WINDOW], [True, True, False, True]),
    ("exactly one window ahead", [0, WINDOW, 0, 1], [True, True, False, True]),
]


@pytest.mark.parametrize(("counters", "expected"), [case[1:] for case in REPLAYS], ids=[case[0] for case in REPLAYS])
def test_the_replay_window(counters: list[int], expected: list[bool]) -> None:
    window = ReplayWindow()
    assert [window.accept(counter) for counter in counters] == expected


@settings(max_examples=examples(66, long=400))
@given(st.lists(st.one_of(st.integers(0, 40), st.integers(0, 4 * WINDOW), st.integers(0, 1 << 60)), max_size=60))
def test_the_replay_window_against_a_set(counters: list[int]) -> None:
    window = ReplayWindow()
    seen: set[int] = set()
    for counter in counters:
        newest = max(seen, default=-1)
        expected = counter not in seen and counter > newest - WINDOW
        assert window.accept(counter) is expected
        seen.add(counter) if expected else None
        assert window.newest == max(seen, default=-1)


def links() -> tuple[SealedLink, SealedLink]:
    agent = SealedLink(link_id=LINK, drone_id=DroneId(1), send_key=b"a" * 32, receive_key=b"b" * 32, now=0.0)
    tower = SealedLink(
        link_id=LINK, drone_id=DroneId(1), send_key=b"b" * 32, receive_key=b"a" * 32, now=0.0, leads=False
    )
    return agent, tower


def test_a_link_carries_frames_and_measures_itself() -> None:
    agent, tower = links()
    for datagram in agent.seal_frames(Epoch(5), [FRAME], 1.5):
        assert tower.receive(datagram, 0.1).frames == Frames(DroneId(1), Epoch(5), 1500, [FRAME])
    (ping,) = agent.datagrams_to_send(1.0)
    assert tower.receive(ping, 1.02).frames is None
    pong = tower.datagrams_to_send(1.02)[0]
    agent.receive(pong, 1.04)
    assert agent.keepalive.rtt_s == pytest.approx(0.04)
    assert agent.keepalive.silent_for(1.54) == pytest.approx(0.5)


def test_the_side_that_does_not_lead_is_told_what_the_other_measured_and_pings_only_while_it_watches() -> None:
    agent, tower = links()

    def turn(now: float) -> None:
        """The agent sends a ping and receives the response, 10 ms each way."""
        for datagram in agent.datagrams_to_send(now):
            tower.receive(datagram, now + 0.01)
        for datagram in tower.datagrams_to_send(now + 0.01):
            agent.receive(datagram, now + 0.02)

    turn(0.0)
    assert tower.keepalive.rtt_s is None, "nothing was measured before the first ping"
    turn(0.5)
    assert tower.keepalive.rtt_s == pytest.approx(0.02)
    assert tower.quality.over(1.0, 0.6).rtt_s == pytest.approx(0.02)
    agent.datagrams_to_send(1.0)  # lost
    turn(1.5)
    turn(4.0)
    assert tower.keepalive.loss == pytest.approx(0.25, abs=0.01), "of the four that are decided"
    assert not tower.has_to_send(100.0)
    tower.keepalive.watch_closely(True, 5.0)
    assert len(tower.datagrams_to_send(5.0)) == 1
    assert tower.keepalive.rtt_now_s(5.9) == pytest.approx(0.9), "an answer is missing, and it sees that by itself"
    tower.keepalive.watch_closely(False, 6.0)
    assert not tower.has_to_send(100.0)
    assert tower.keepalive.rtt_now_s(100.0) == pytest.approx(0.02)


def test_a_ping_goes_along_with_frames_where_there_is_room_and_the_way_is_proven() -> None:
    agent, tower = links()
    agent.datagrams_to_send(0.0)
    (early,) = agent.seal_frames(Epoch(0), [FRAME], 0.2)
    (along,) = agent.seal_frames(Epoch(0), [FRAME], 0.4)  # the next ones would come at 0.6
    assert not agent.has_to_send(0.89), "it was the ping that was due"
    received = tower.receive(along, 0.41).frames
    assert received is not None
    assert received.frames == [FRAME]
    (pong,) = tower.datagrams_to_send(0.41)
    assert agent.receive(pong, 0.42).proof
    assert agent.keepalive.rtt_s == pytest.approx(0.02)
    full = [FRAME] * ((agent.datagram_bytes - OVERHEAD_BYTES - 13) // len(FRAME))
    (alone,) = agent.seal_frames(Epoch(0), full, 0.9)  # which is when one is due
    assert len(alone) <= agent.datagram_bytes
    assert agent.has_to_send(0.9), "there was no room for it"
    agent.datagrams_to_send(0.9)
    (alone,) = agent.seal_frames(Epoch(0), [FRAME], 1.5)
    assert len(alone) == len(early), "nothing shows that the way still works: the ping must go by itself"


def test_a_link_does_not_hear_itself() -> None:
    agent, _ = links()
    (datagram,) = agent.seal_frames(Epoch(0), [FRAME], 0.0)
    with pytest.raises(Dropped) as caught:
        agent.receive(datagram, 0.0)
    assert caught.value.reason is DropReason.NOT_AUTHENTIC


def test_pongs_are_not_answered() -> None:
    agent, tower = links()
    agent.datagrams_to_send(0.0)
    tower.datagrams_to_send(0.0)
    pong = Sealer(b"b" * 32, LINK)
    pong.seal(b"x")
    agent.receive(pong.seal(encode_keepalive(Pong(1))), 0.1)
    assert agent.datagrams_to_send(0.1) == []


@pytest.mark.parametrize("uplink", [None, 2])
@pytest.mark.parametrize("datagram_bytes", [0, 700, MAX_DATAGRAM_BYTES])
def test_a_probe_is_answered_where_it_came_from_and_its_address_is_not_followed(
    uplink: int | None, datagram_bytes: int
) -> None:
    agent, tower = links()
    probe = agent.seal_probe(1.0, uplink=uplink, datagram_bytes=datagram_bytes)
    assert len(probe) == max(datagram_bytes, len(agent.seal_probe(1.0)))
    received = tower.receive(probe, 1.1)
    assert (received.frames, received.newest, received.uplink) == (None, False, uplink)
    assert received.answer is not None
    assert len(received.answer) <= len(probe), "no answer is larger than what came"
    assert all(tower.keepalive.ping_due(0.0) is None for _ in tower.datagrams_to_send(1.1)), "and only there"
    probed = agent.receive(received.answer, 1.3).probed
    assert probed == (uplink, len(probe), pytest.approx(0.3))
    assert agent.keepalive.rtt_s is None


def test_an_answer_to_a_ping_is_not_larger_than_the_ping() -> None:
    agent, tower = links()
    (ping,) = agent.datagrams_to_send(0.0)
    tower.datagrams_to_send(0.0)
    tower.receive(ping, 0.1)
    (pong,) = tower.datagrams_to_send(0.1)
    assert len(pong) <= len(ping)


def test_an_urgent_message_travels_sealed() -> None:
    agent, tower = links()
    received = agent.receive(tower.seal_urgent(b'{"type":"x"}'), 0.0)
    assert (received.frames, received.urgent) == (None, b'{"type":"x"}')
    with pytest.raises(ValueError, match="does not fit"):
        tower.seal_urgent(bytes(MAX_URGENT_BYTES + 1))
    assert len(tower.seal_urgent(bytes(MAX_URGENT_BYTES))) == MAX_DATAGRAM_BYTES
