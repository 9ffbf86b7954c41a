"""Whole packets for each picture, with its length and its time; the tables before each key picture."""

import io
import shutil
import subprocess
from pathlib import Path

import av
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds.moving_pictures import flight, pictures

from onboard_agent.video.encoders.mpeg1 import Mpeg1Encoder
from onboard_agent.video.encoders.transport_stream import PACKET_BYTES, TABLE_BYTES, TransportStream, room_for_picture
from wire.video import LIMITS, Quality

KEY = b"\x00\x00\x01\xb3"


def packets_of(stream: bytes) -> list[bytes]:
    assert len(stream) % PACKET_BYTES == 0
    packets = [stream[at : at + PACKET_BYTES] for at in range(0, len(stream), PACKET_BYTES)]
    assert {packet[0] for packet in packets} == {0x47}
    return packets


def pid(packet: bytes) -> int:
    return (packet[1] & 0x1F) << 8 | packet[2]


def carried(packet: bytes) -> bytes:
    return packet[5 + packet[4] :] if packet[3] & 0x20 else packet[4:]


def pes_of(stream: bytes) -> list[bytes]:
    found: list[bytes] = []
    for packet in packets_of(stream):
        if pid(packet) == 0x100:
            if packet[1] & 0x40:
                found.append(b"")
            found[-1] += carried(packet)
    return found


@given(st.binary(min_size=1, max_size=700), st.booleans(), st.integers(0, 2**62))
def test_what_goes_in_comes_out_with_its_length_and_time(picture: bytes, key: bool, at_us: int) -> None:
    unit = TransportStream().pack(picture, key=key, at_us=at_us)
    (pes,) = pes_of(unit)
    assert int.from_bytes(pes[4:6]) == len(pes) - 6
    assert pes[14:] == picture
    clock = (pes[9] >> 1 & 7) << 30 | (int.from_bytes(pes[10:12]) >> 1) << 15 | int.from_bytes(pes[12:14]) >> 1
    assert clock == at_us * 9 // 100 % 2**33
    assert [pid(packet) for packet in packets_of(unit)[:2]] == ([0, 0x1000] if key else [0x100] * len(unit[:376:188]))


def test_every_size_fills_its_packets() -> None:
    stream = TransportStream()
    for size in range(1, 600):
        assert pes_of(stream.pack(bytes(size), key=False, at_us=size))[0][14:] == bytes(size)


def test_the_counters_run_on() -> None:
    stream = TransportStream()
    packets = packets_of(b"".join(stream.pack(bytes(1000), key=number % 3 == 0, at_us=number) for number in range(20)))
    for which in (0, 0x1000, 0x100):
        counters = [packet[3] & 0xF for packet in packets if pid(packet) == which]
        assert counters == [number % 16 for number in range(len(counters))]
        assert len(counters) > 4


def test_a_picture_too_large_for_one_length_is_in_two() -> None:
    picture = bytes(range(256)) * 300
    first, second = pes_of(TransportStream().pack(picture, key=True, at_us=5))
    assert first[14:] + second[14:] == picture
    assert [int.from_bytes(pes[4:6]) for pes in (first, second)] == [len(first) - 6, len(second) - 6]
    assert (first[7], second[7]) == (0x80, 0)


def test_room_is_what_is_left_on_average() -> None:
    sizes = range(800, 3000, 7)
    stream = TransportStream()
    units = [len(stream.pack(bytes(size), key=False, at_us=1)) for size in sizes]
    assert room_for_picture(sum(units) / len(units)) == pytest.approx(sum(sizes) / len(sizes), abs=8)
    assert len(stream.pack(b"x", key=True, at_us=1)) == TABLE_BYTES + PACKET_BYTES


def flown(begin: int) -> bytes:
    """Returns units from a key picture on, as a late viewer receives them."""
    encoder = Mpeg1Encoder(LIMITS[Quality.MEDIUM])
    given_pictures = pictures(flight(320, 240, 60), 24.0)
    coded = [unit for picture in given_pictures for unit in encoder.encode(picture)]
    assert coded[begin].key
    return b"".join(unit.payload for unit in coded[begin:])


@pytest.mark.parametrize("begin", [0, 24])
def test_pyav_reads_it_from_any_key_picture(begin: int) -> None:
    with av.open(io.BytesIO(flown(begin)), format="mpegts") as file:
        packets = [packet for packet in file.demux(video=0) if packet.size]
    assert not any(packet.is_corrupt for packet in packets)
    assert len(packets) == 60 - begin


@pytest.mark.skipif(shutil.which("ffprobe") is None, reason="there is no ffprobe")
@pytest.mark.parametrize("begin", [0, 24])
def test_ffprobe_finds_nothing_wrong(tmp_path: Path, begin: int) -> None:
    path = tmp_path / "units.ts"
    path.write_bytes(flown(begin))
    asked = ["ffprobe", "-v", "warning", "-count_frames", "-show_entries", "stream=codec_name,width,nb_read_frames"]
    reported = subprocess.run([*asked, "-of", "csv=p=0", path], capture_output=True, text=True, check=True, timeout=30)
    assert reported.stderr == ""
    assert reported.stdout.split() == [f"mpeg1video,320,{60 - begin}"] * 2  # the programme's, and the file's
