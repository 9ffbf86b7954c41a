"""MSP frames: round trips, any portions, noise, golden bytes, and agreement with the simulator's own codec."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.autopilot.msp.frames import (
    ANSWER,
    ERROR,
    MAX_PAYLOAD_BYTES,
    REQUEST,
    MspMessage,
    MspReader,
    crc8,
    encode,
)
from simulator.serial_inputs import msp_frames as theirs

directions = st.sampled_from((REQUEST, ANSWER, ERROR))
messages = st.one_of(
    st.builds(MspMessage, st.just(1), directions, st.integers(0, 255), st.binary(max_size=600)),
    st.builds(MspMessage, st.just(2), directions, st.integers(0, 0xFFFF), st.binary(max_size=600)),
)


def test_golden_frames() -> None:
    assert encode(MspMessage(1, REQUEST, 108)) == bytes.fromhex("244d3c006c6c")
    assert encode(MspMessage(2, REQUEST, 100)) == bytes.fromhex("24583c00640000008f")
    assert crc8(b"123456789") == 0xBC
    jumbo = encode(MspMessage(1, ANSWER, 1, bytes(255)))
    assert jumbo[:7] == bytes.fromhex("244d3eff01ff00")


@given(st.lists(messages, max_size=4), st.lists(st.integers(1, 50), max_size=40))
def test_frames_survive_any_portions(sent: list[MspMessage], sizes: list[int]) -> None:
    data = b"".join(map(encode, sent))
    reader, found = MspReader(), list[MspMessage]()
    for size in sizes:
        found += reader.feed(data[:size])
        data = data[size:]
    assert found + reader.feed(data) == sent
    assert reader.damaged == 0


@given(messages)
def test_the_simulator_reads_ours_and_we_read_the_simulators(message: MspMessage) -> None:
    version, direction, function, payload = message
    same = theirs.MspFrame(version, theirs.Direction(direction), function, payload)
    assert theirs.encode(same) == encode(message)
    assert theirs.MspDecoder().receive(encode(message)) == [same]


@given(st.binary(max_size=200).filter(lambda noise: b"$" not in noise), messages, st.integers(0, 7))
def test_noise_and_a_flipped_bit_cost_one_frame(noise: bytes, message: MspMessage, bit: int) -> None:
    reader = MspReader()
    damaged = bytearray(encode(message))
    damaged[-1] ^= 1 << bit
    found = reader.feed(noise + bytes(damaged))
    after = MspMessage(1, ANSWER, 101, b"\1\2\3")
    # At most the longest frame that its bytes may announce is waited for.
    found += reader.feed(bytes(MAX_PAYLOAD_BYTES + 9) + encode(after))
    assert found[-1] == after
    assert message not in found


def test_what_no_frame_can_carry() -> None:
    with pytest.raises(ValueError, match="version 1"):
        encode(MspMessage(1, REQUEST, 300))
    with pytest.raises(ValueError, match="bytes"):
        encode(MspMessage(2, REQUEST, 1, bytes(MAX_PAYLOAD_BYTES + 1)))
