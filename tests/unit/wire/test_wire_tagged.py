"""Tagged frames: the binary messages between browser and tower."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.dialect import build, mavlink
from wire.frames import MalformedFrame
from wire.ids import DroneId
from wire.tagged import join, split_tagged, tag

FRAME = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=1, component_id=1, sequence=7)
ONE = tag(DroneId(5), FRAME)


@given(st.lists(st.integers(0, 2**32 - 1), min_size=1, max_size=10))
def test_what_is_joined_splits(drone_ids: list[int]) -> None:
    message = join(tag(DroneId(drone_id), FRAME) for drone_id in drone_ids)
    assert split_tagged(message) == [(drone_id, FRAME) for drone_id in drone_ids]


@pytest.mark.parametrize(
    "message",
    [b"", b"\x05", ONE[:4], ONE[:5], ONE[:-1], ONE + b"\0", ONE + ONE[:4], ONE + ONE[:-1], ONE[:4] + b"\0" + ONE[4:]],
)
def test_a_message_that_is_not_whole_is_refused_whole(message: bytes) -> None:
    with pytest.raises(MalformedFrame):
        split_tagged(message)


@given(st.one_of(st.binary(max_size=120), st.binary(max_size=60).map(lambda raw: ONE + raw)))
def test_random_bytes_raise_nothing_else(message: bytes) -> None:
    try:
        parts = split_tagged(message)
    except MalformedFrame:
        return
    assert join(tag(drone_id, frame) for drone_id, frame in parts) == message
