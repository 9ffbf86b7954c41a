"""Frames that share a datagram: which leave at once, which wait and how long, without loss or reordering."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.batching import CLOSE_WAIT_S, MAX_WAIT_S, Batch, Batcher
from wire.content import Frames, decode_content
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch, LinkId
from wire.sealed_link import SealedLink
from wire.sealing import MAX_DATAGRAM_BYTES
from wire.urgency import URGENT, is_urgent


def attitude(sequence: int = 0) -> bytes:
    message = mavlink.MAVLink_attitude_message(1000, 0.5, -0.25, 1.0, 0, 0, 0.5)
    return build(message, system_id=1, component_id=1, sequence=sequence)


def sticks(sequence: int = 0) -> bytes:
    message = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0)
    return build(message, system_id=255, component_id=190, sequence=sequence)


NOTHING: list[Batch] = []


def test_what_is_not_urgent_waits_for_others_and_leaves_at_the_deadline() -> None:
    batcher = Batcher(1000)
    assert batcher.due_at is None
    assert batcher.add(Epoch(1), [attitude(1)], 5.0) == NOTHING
    assert batcher.add(Epoch(1), [attitude(2)], 5.004) == NOTHING
    assert batcher.due_at == 5.0 + MAX_WAIT_S
    assert batcher.due(5.009) == NOTHING
    assert batcher.due(5.010) == [(1, [attitude(1), attitude(2)])]
    assert batcher.due_at is None
    assert batcher.due(6.0) == NOTHING


def test_an_urgent_frame_takes_along_what_waited_in_order() -> None:
    batcher = Batcher(1000)
    batcher.add(Epoch(1), [attitude(1)], 5.0)
    assert batcher.add(Epoch(1), [attitude(2), sticks(3), attitude(4)], 5.001) == [
        (1, [attitude(1), attitude(2), sticks(3), attitude(4)])
    ]
    assert batcher.due_at is None


def test_an_epoch_never_shares_a_datagram_with_another() -> None:
    batcher = Batcher(1000)
    batcher.add(Epoch(1), [attitude(1)], 5.0)
    assert batcher.add(Epoch(2), [attitude(2)], 5.002) == [(1, [attitude(1)])]
    assert batcher.due_at == 5.002 + MAX_WAIT_S
    assert batcher.due(6.0) == [(2, [attitude(2)])]


def test_a_full_datagram_leaves_and_the_rest_waits_anew() -> None:
    size = len(attitude())
    batcher = Batcher(3 * size + 5)
    assert batcher.add(Epoch(1), [attitude(n) for n in range(4)], 5.0) == [(1, [attitude(n) for n in range(3)])]
    batcher.room_bytes = size
    assert batcher.add(Epoch(1), [attitude(4)], 5.1) == [(1, [attitude(3)]), (1, [attitude(4)])]


def test_a_frame_that_is_larger_than_the_room_leaves_alone() -> None:
    batcher = Batcher(10)
    assert batcher.add(Epoch(1), [attitude(1), attitude(2)], 5.0) == [(1, [attitude(1)]), (1, [attitude(2)])]


@given(
    st.lists(
        st.tuples(st.booleans(), st.integers(0, 2), st.floats(0, 0.02), st.integers(0, 3)),
        max_size=40,
    )
)
def test_nothing_is_lost_repeated_reordered_or_kept_too_long(steps: list[tuple[bool, int, float, int]]) -> None:
    batcher = Batcher(130)
    now, said, left = 0.0, [], []
    waiting_since: dict[bytes, float] = {}

    def leave(batches: list[Batch]) -> None:
        for epoch, frames in batches:
            assert sum(map(len, frames)) <= 130
            left.extend((epoch, frame) for frame in frames)
            for frame in frames:
                assert now - waiting_since.pop(frame) <= MAX_WAIT_S + 1e-9

    for number, (urgent, epoch, pause, count) in enumerate(steps):
        if batcher.due_at is not None and batcher.due_at <= now + pause:
            now, pause = batcher.due_at, now + pause - batcher.due_at
            leave(batcher.due(now))
        now += pause
        frames = [(sticks if urgent else attitude)(4 * number + n) for n in range(count)]
        waiting_since |= dict.fromkeys(frames, now)
        said += [(epoch, frame) for frame in frames]
        leave(batcher.add(Epoch(epoch), frames, now))
        assert not (urgent and frames and waiting_since), "an urgent frame waits for nothing"
        assert (batcher.due_at is None) == (not waiting_since)
    if batcher.due_at is not None:
        now = batcher.due_at
        leave(batcher.due(now))
    assert left == said


def test_the_table_of_urgent_messages() -> None:
    names = {mavlink.mavlink_map[number].msgname for number in URGENT}
    assert {"MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "COMMAND_LONG", "COMMAND_INT", "COMMAND_ACK"} <= names
    assert {"HEARTBEAT", "SET_MODE", "MISSION_ACK", "SET_POSITION_TARGET_GLOBAL_INT"} <= names
    assert not names & {"ATTITUDE", "GLOBAL_POSITION_INT", "PARAM_VALUE", "STATUSTEXT"}
    assert max(URGENT) < 256


@pytest.mark.parametrize("frame", [attitude(), sticks()])
def test_urgency_is_read_off_either_version_of_a_frame(frame: bytes) -> None:
    # A version 1 header: FE len seq sysid compid msgid.
    version_1 = bytes((0xFE, frame[1], frame[4], frame[5], frame[6], frame[7])) + frame[10:]
    assert is_urgent(version_1) is is_urgent(frame) is (frame == sticks())


def test_a_message_above_255_is_not_taken_for_the_urgent_one_with_its_low_byte() -> None:
    odd = bytearray(sticks())
    odd[8] = 1
    assert not is_urgent(bytes(odd))


def test_a_link_seals_batches_with_the_epoch_and_the_time_at_which_they_leave() -> None:
    agent, tower = (
        SealedLink(link_id=LinkId(3), drone_id=DroneId(1), send_key=send, receive_key=receive, now=0.0)
        for send, receive in ((b"a" * 32, b"b" * 32), (b"b" * 32, b"a" * 32))
    )
    assert agent.batch_frames(Epoch(4), [attitude(1)], 2.0) == []
    assert agent.batch_due_at == pytest.approx(2.010)
    (datagram,) = agent.batch_due(2.012)
    assert tower.receive(datagram, 2.1).frames == Frames(DroneId(1), Epoch(4), 2012, [attitude(1)])
    many = agent.batch_frames(Epoch(4), [attitude(n) for n in range(60)] + [sticks()], 3.0)
    assert all(len(one) <= MAX_DATAGRAM_BYTES for one in many)
    assert decode_content(b"\x01" + bytes(12) + sticks())  # a batch is an ordinary content
    assert sum(len(tower.receive(one, 3.0).frames.frames) for one in many) == 61  # type: ignore[union-attr]


def test_frames_of_a_drone_that_somebody_holds_hardly_wait() -> None:
    batcher = Batcher(1000)
    batcher.wait_s = CLOSE_WAIT_S
    assert batcher.add(Epoch(1), [attitude()], now=5.0) == NOTHING
    assert batcher.due_at == 5.0 + CLOSE_WAIT_S
    assert batcher.due(5.0 + CLOSE_WAIT_S) == [Batch(Epoch(1), [attitude()])]
