"""SBUS and MSP: golden bytes, any portions, random bytes, and what a flight controller makes of them."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.serial_inputs import msp_frames, sbus
from simulator.serial_inputs.msp_frames import MAX_PAYLOAD, Direction, MspDecoder, MspFrame
from simulator.serial_inputs.msp_server import Function, MspServer, Snapshot
from simulator.serial_inputs.radio import MAX_LOST_IN_ROW, SILENT_AFTER_S, SbusRadio
from simulator.serial_inputs.sbus import FRAME_BYTES, SbusDecoder, SbusFrame

CENTRED = SbusFrame((992,) * 16)

sbus_frames = st.builds(
    SbusFrame,
    st.tuples(*[st.integers(0, 2047)] * 16),
    st.booleans(),
    st.booleans(),
    st.booleans(),
    st.booleans(),
)
msp = st.one_of(
    st.builds(MspFrame, st.just(1), st.sampled_from(Direction), st.integers(0, 255), st.binary(max_size=300)),
    st.builds(
        MspFrame,
        st.just(2),
        st.sampled_from(Direction),
        st.integers(0, 65535),
        st.binary(max_size=300),
        st.integers(0, 255),
    ),
)


def portions(data: bytes, sizes: list[int]) -> list[bytes]:
    out, at = [], 0
    for size in sizes:
        out.append(data[at : at + size])
        at += size
    return [*out, data[at:]]


def test_a_golden_sbus_frame() -> None:
    """All channels in the middle (992 = 0b01111100000), flags failsafe and frame lost."""
    golden = bytes.fromhex("0fe0031ff8c0073ef0810f7ce0031ff8c0073ef0810f7c0c00")
    frame = SbusFrame((992,) * 16, frame_lost=True, failsafe=True)
    assert sbus.encode(frame) == golden
    assert SbusDecoder().receive(golden) == [frame]
    assert frame.pwm_us()[0] == 1500
    assert (SbusFrame((172, 1811) * 8).pwm_us()[:2]) == (988, 2012)


@given(st.lists(sbus_frames, max_size=5), st.lists(st.integers(0, 30), max_size=20))
def test_sbus_frames_survive_any_portions(frames: list[SbusFrame], sizes: list[int]) -> None:
    decoder = SbusDecoder()
    data = b"".join(map(sbus.encode, frames))
    assert [frame for part in portions(data, sizes) for frame in decoder.receive(part)] == frames


@given(st.binary(max_size=400))
def test_the_sbus_decoder_takes_random_bytes_and_finds_its_way_back(noise: bytes) -> None:
    decoder = SbusDecoder()
    decoder.receive(noise)
    # A false start swallows less than a frame, and this payload has no header byte within.
    found = decoder.receive(sbus.encode(CENTRED) * 3)
    assert found[-1] == CENTRED
    assert len(decoder._waiting) < FRAME_BYTES


@pytest.mark.parametrize("channels", [(0,) * 15, (2048, *([0] * 15)), (-1, *([0] * 15))])
def test_what_has_no_room_in_an_sbus_frame_is_refused(channels: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="16 channels"):
        sbus.encode(SbusFrame(channels))


def test_a_radio_is_lost_by_failsafe_by_silence_and_by_lost_frames() -> None:
    radio = SbusRadio()
    assert not radio.ok(0.0)
    radio.receive(sbus.encode(CENTRED), 0.0)
    assert radio.ok(SILENT_AFTER_S)
    assert not radio.ok(SILENT_AFTER_S + 0.01)
    radio.receive(sbus.encode(SbusFrame((172,) * 16, failsafe=True)), 1.0)
    assert not radio.ok(1.0)
    radio.receive(sbus.encode(CENTRED), 1.1)
    assert radio.ok(1.1)
    for i in range(MAX_LOST_IN_ROW):
        assert radio.ok(1.1), f"after {i} lost frames"
        radio.receive(sbus.encode(SbusFrame((992,) * 16, frame_lost=True)), 1.1)
    assert not radio.ok(1.1)
    assert radio.sticks_us() == (1500,) * 16


def test_golden_msp_frames() -> None:
    assert msp_frames.encode(MspFrame(1, Direction.REQUEST, 108)) == bytes.fromhex("244d3c006c6c")
    assert msp_frames.encode(MspFrame(2, Direction.REQUEST, 100)) == bytes.fromhex("24583c00640000008f")
    assert msp_frames.crc8_dvb_s2(b"123456789") == 0xBC


@given(st.lists(msp, max_size=4), st.lists(st.integers(0, 60), max_size=20))
def test_msp_frames_survive_any_portions(frames: list[MspFrame], sizes: list[int]) -> None:
    decoder = MspDecoder()
    data = b"".join(map(msp_frames.encode, frames))
    assert [frame for part in portions(data, sizes) for frame in decoder.receive(part)] == frames
    assert decoder.bad_frames == 0


@given(st.lists(st.one_of(st.binary(max_size=60), st.sampled_from([b"$M<", b"$X>", b"$$", b"$M<\xff"])), max_size=12))
def test_the_msp_decoder_takes_random_bytes_and_stays_bounded(noise: list[bytes]) -> None:
    decoder = MspDecoder()
    for part in noise:
        decoder.receive(part)
        assert len(decoder._waiting) <= MAX_PAYLOAD + 9
    # What looks like the start of a frame swallows at most that frame.
    after = decoder.receive(b"\0" * (MAX_PAYLOAD + 9) + msp_frames.encode(MspFrame(1, Direction.REQUEST, 108)))
    assert after[-1] == MspFrame(1, Direction.REQUEST, 108)


@given(msp, st.data())
def test_a_damaged_msp_frame_is_not_believed(frame: MspFrame, data: st.DataObject) -> None:
    good = bytearray(msp_frames.encode(frame))
    at = data.draw(st.integers(3, len(good) - 1))
    good[at] ^= data.draw(st.integers(1, 255))
    assert MspDecoder().receive(bytes(good)) in ([],) or frame.payload.find(b"$") >= 0


@given(st.lists(st.binary(max_size=80), max_size=8))
def test_the_msp_server_answers_random_bytes_with_frames_or_nothing(noise: list[bytes]) -> None:
    server, decoder = MspServer(Snapshot, lambda _sticks: None), MspDecoder()
    for part in noise:
        for frame in decoder.receive(server.receive(b"$M<" + part)):
            assert frame.direction is not Direction.REQUEST
    assert decoder.bad_frames == 0


def ask(server: MspServer, function: int, payload: bytes = b"", version: int = 1) -> MspFrame:
    answers = MspDecoder().receive(
        server.receive(msp_frames.encode(MspFrame(version, Direction.REQUEST, function, payload)))
    )
    assert len(answers) == 1
    assert answers[0].version == version
    assert answers[0].function == function
    return answers[0]


@pytest.mark.parametrize("version", [1, 2])
def test_the_msp_server_tells_the_vehicle(version: int) -> None:
    now = Snapshot(
        armed=True, roll_deg=10.0, pitch_deg=5.0, yaw_deg=-90.0, alt_m=12.34, climb_mps=-0.5, lat_deg=47.3977,
        lon_deg=8.5456, fix=True, satellites=14, voltage_v=15.2, current_a=14.0, used_mah=900.0,
        motors=(0.5, 0.6, 0.7, 0.8), sticks_us=(1500, 1500, 1000, 1500),
    )  # fmt: skip
    server = MspServer(lambda: now, lambda _sticks: None)
    assert struct.unpack("<3h", ask(server, Function.ATTITUDE, version=version).payload) == (100, -50, 270)
    assert struct.unpack("<ih", ask(server, Function.ALTITUDE, version=version).payload) == (1234, -50)
    assert struct.unpack("<BHHhH", ask(server, Function.ANALOG, version=version).payload) == (152, 900, 0, 1400, 1520)
    assert struct.unpack("<BBii", ask(server, Function.RAW_GPS, version=version).payload[:10]) == (
        2, 14, 473977000, 85456000,
    )  # fmt: skip
    assert struct.unpack("<4H", ask(server, Function.RC, version=version).payload) == (1500, 1500, 1000, 1500)
    assert struct.unpack("<4H", ask(server, Function.MOTOR, version=version).payload[:8]) == (1500, 1600, 1700, 1800)
    assert struct.unpack("<HHHIB", ask(server, Function.STATUS, version=version).payload)[3] == 1
    assert struct.unpack("<3h", ask(server, Function.RAW_IMU, version=version).payload[:6]) == (0, 0, 512)
    assert ask(server, Function.FC_VARIANT, version=version).payload == b"CTWR"


def test_the_msp_server_takes_sticks_and_refuses_what_it_does_not_know() -> None:
    taken: list[tuple[int, ...]] = []
    server = MspServer(Snapshot, taken.append)
    assert ask(server, Function.SET_RAW_RC, struct.pack("<4H", 1500, 1400, 1000, 1600)).direction is Direction.ANSWER
    assert taken == [(1500, 1400, 1000, 1600)]
    for payload in (b"", b"\0", b"\0" * 38):
        assert ask(server, Function.SET_RAW_RC, payload).direction is Direction.ERROR
    assert len(taken) == 1
    assert ask(server, 250).direction is Direction.ERROR
    assert ask(server, 0x4000, version=2).direction is Direction.ERROR
    assert server.receive(msp_frames.encode(MspFrame(1, Direction.ANSWER, 108))) == b""
