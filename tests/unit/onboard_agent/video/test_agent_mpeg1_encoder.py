"""MPEG-1: each picture fed returns its unit, decodable without the next one, at the requested bit rate."""

import io
from collections.abc import Iterator

import av
import pytest
from worlds.moving_pictures import flight, off_by, pictures

from onboard_agent.video.encoders.encoder import EncodedPicture
from onboard_agent.video.encoders.mpeg1 import MAX_PICTURE_S, Mpeg1Encoder
from onboard_agent.video.sources.source import Picture
from wire.video import LIMITS, Quality, QualityLimits

RATE_HZ = 24.0
LOW, MEDIUM, HIGH = (LIMITS[quality] for quality in Quality)
CLEARLY_OTHER = 8.0
"""Minimum difference, of 255, between neighbouring pictures of the flight; a coded one is nearer to its own."""


@pytest.fixture(scope="module")
def frames() -> list[av.VideoFrame]:
    return flight(320, 240, 96)


def elementary(units: list[bytes]) -> list[bytes]:
    """Returns what a demuxer extracts from each unit alone, by the length in the PES header, without look-ahead."""
    pictures_found = []
    for unit in units:
        pes = b""
        for at in range(0, len(unit), 188):
            packet = unit[at : at + 188]
            assert packet[0] == 0x47
            if (packet[1] & 0x1F) << 8 | packet[2] == 0x100:
                pes += packet[5 + packet[4] :] if packet[3] & 0x20 else packet[4:]
        assert pes[:4] == b"\x00\x00\x01\xe0"
        assert int.from_bytes(pes[4:6]) == len(pes) - 6  # complete: nothing is missing, nothing is extra
        pictures_found.append(pes[9 + pes[8] :])
    return pictures_found


def decoded(units: list[bytes]) -> Iterator[list[av.VideoFrame]]:
    """Returns what a player that does not wait shows after each unit."""
    decoder = av.VideoCodecContext.create("mpeg1video", "r")
    decoder.options = {"flags": "+low_delay"}
    for picture in elementary(units):
        yield decoder.decode(av.Packet(picture))


def encode_all(encoder: Mpeg1Encoder, given: list[Picture]) -> list[EncodedPicture]:
    return [coded for picture in given for coded in encoder.encode(picture)]


def test_each_picture_is_whole_and_shown_when_it_has_been_fed(frames: list[av.VideoFrame]) -> None:
    given = pictures(frames, RATE_HZ)
    encoder = Mpeg1Encoder(MEDIUM)
    coded = [encoder.encode(picture) for picture in given]
    assert [[unit.capture_us for unit in units] for units in coded] == [[picture.capture_us] for picture in given]
    for number, shown in enumerate(decoded([units[0].payload for units in coded])):
        (frame,) = shown
        assert off_by(frame, frames[number]) < CLEARLY_OTHER
        if number:
            assert off_by(frame, frames[number]) < off_by(frame, frames[number - 1])


def test_what_is_coded_is_what_the_encoder_codes_that_holds_one_back(
    frames: list[av.VideoFrame], monkeypatch: pytest.MonkeyPatch
) -> None:
    given = pictures(frames[:20], RATE_HZ)  # no second key picture: the plain one would be flushed there
    ours = elementary([unit.payload for unit in encode_all(Mpeg1Encoder(MEDIUM), given)])
    context = Mpeg1Encoder(MEDIUM)._open  # the same codec with the same options, but for the hold
    monkeypatch.setattr("onboard_agent.video.encoders.mpeg1._NO_HOLD", {})
    plain = context((320, 240), Mpeg1Encoder(MEDIUM)._aim)  # type: ignore[arg-type]
    packets = []
    for number, picture in enumerate(given):
        frame = av.VideoFrame.from_ndarray(picture.frame.to_ndarray(), format="yuv420p")
        frame.pts, frame.time_base = number, plain.time_base
        packets.append(plain.encode(frame))
    assert [len(found) for found in packets] == [0, *[1] * 19]
    assert [bytes(found[0]) for found in [*packets[1:], plain.encode(None)]] == ours


def test_ten_thousand_pictures_and_still_the_one_that_was_fed() -> None:
    small = QualityLimits(64, 48, RATE_HZ, 120_000, 30_000)
    frames = flight(64, 48, 250)
    encoder = Mpeg1Encoder(small)
    count, sizes, last = 10_000, [], []
    for number in range(count):
        at_us = 1_000_000 + number * 41_667
        (unit,) = encoder.encode(Picture(frames[number % 250], at_us, number + 1, number == 0))
        assert unit.capture_us == at_us
        sizes.append(len(unit.payload))
        last = [*last, unit][-30:]
    begin = next(number for number, unit in enumerate(last) if unit.key)
    for number, shown in enumerate(decoded([unit.payload for unit in last[begin:]]), count - len(last) + begin):
        (frame,) = shown
        assert off_by(frame, frames[number % 250]) < CLEARLY_OTHER
    early, late = sum(sizes[250:2500]), sum(sizes[-2250:])
    assert late == pytest.approx(early, rel=0.03)


def test_the_bit_rate_is_that_of_the_units(frames: list[av.VideoFrame]) -> None:
    for limits, bits_per_s, rate_hz in ((MEDIUM, 450_000, 24.0), (MEDIUM, 250_000, 24.0), (LOW, 200_000, 12.0)):
        encoder = Mpeg1Encoder(limits)
        encoder.retune(bits_per_s=bits_per_s, rate_hz=rate_hz)
        coded = encode_all(encoder, pictures(frames, rate_hz))
        assert 8 * sum(len(unit.payload) for unit in coded) * rate_hz / len(coded) == pytest.approx(bits_per_s, rel=0.1)


def test_no_picture_holds_up_the_others(frames: list[av.VideoFrame]) -> None:
    coded = encode_all(Mpeg1Encoder(MEDIUM), pictures(frames, RATE_HZ))
    packets_and_tables = 1.1
    assert max(len(unit.payload) for unit in coded) < MEDIUM.bits_per_s / 8 * MAX_PICTURE_S * packets_and_tables


def test_a_key_picture_comes_each_second_of_the_camera_however_many_were_skipped(frames: list[av.VideoFrame]) -> None:
    given = pictures(frames, RATE_HZ)
    coded = encode_all(Mpeg1Encoder(MEDIUM), given)
    assert [number for number, unit in enumerate(coded) if unit.key] == [0, 24, 48, 72]
    sparse = encode_all(Mpeg1Encoder(MEDIUM), given[::8])
    assert [number for number, unit in enumerate(sparse) if unit.key] == [0, 3, 6, 9]


def test_a_key_picture_comes_when_it_is_wanted_and_after_a_break(frames: list[av.VideoFrame]) -> None:
    given = pictures(frames[:12], RATE_HZ)
    given[8] = given[8]._replace(is_break=True)
    encoder = Mpeg1Encoder(MEDIUM)
    coded = [encoder.encode(picture, force_key=number == 5)[0] for number, picture in enumerate(given)]
    assert [number for number, unit in enumerate(coded) if unit.key] == [0, 5, 8]
    assert [number for number, unit in enumerate(coded) if unit.is_break] == [0, 8]
    for begin in (5, 8):  # a viewer who joins there sees a picture
        shown = list(decoded([unit.payload for unit in coded[begin:]]))
        assert [len(frames_shown) for frames_shown in shown] == [1] * (12 - begin)


def test_retuned_at_the_next_key_picture(frames: list[av.VideoFrame]) -> None:
    given = pictures(frames, RATE_HZ)
    encoder = Mpeg1Encoder(MEDIUM)
    coded = []
    for number, picture in enumerate(given):
        if number == 30:
            encoder.retune(bits_per_s=150_000, rate_hz=RATE_HZ, scale=0.5)
        coded += encoder.encode(picture, force_key=number == 36)
    assert {(unit.width, unit.height) for unit in coded[:36]} == {(320, 240)}
    assert {(unit.width, unit.height) for unit in coded[36:]} == {(160, 120)}
    assert coded[36].key
    after = coded[37:]
    assert 8 * sum(len(unit.payload) for unit in after) * RATE_HZ / len(after) == pytest.approx(150_000, rel=0.15)
    shown = [frame for found in decoded([unit.payload for unit in coded]) for frame in found]
    assert [(frame.width, frame.height) for frame in shown[35:37]] == [(320, 240), (160, 120)]


@pytest.mark.parametrize(
    ("aim", "wrong"),
    [("rate", {"rate_hz": 0.0}), ("bits", {"bits_per_s": 0}), ("size", {"scale": 1.5}), ("nothing", {"scale": 0.0})],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_aim_out_of_range_is_refused(aim: str, wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="cannot aim"):
        Mpeg1Encoder(MEDIUM).retune(**{"bits_per_s": 1000, "rate_hz": 24.0, "scale": 1.0, **wrong})  # type: ignore[arg-type]


def test_a_camera_of_another_shape_fits_inside_and_may_change(frames: list[av.VideoFrame]) -> None:
    wide = [frame.reformat(width=1280, height=720) for frame in frames[:3]]
    tall = [frame.reformat(width=480, height=640) for frame in frames[:3]]
    coded = encode_all(Mpeg1Encoder(HIGH), pictures([*wide, *tall], RATE_HZ))
    assert [(unit.width, unit.height) for unit in coded] == [(640, 360)] * 3 + [(360, 480)] * 3
    assert [unit.key for unit in coded] == [True, False, False] * 2
    shown = [found for units in decoded([unit.payload for unit in coded]) for found in units]
    assert [(frame.width, frame.height) for frame in shown] == [(640, 360)] * 3 + [(360, 480)] * 3


@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 12.0, 15.0, 24.0, 25.0, 29.97, 30.0, 50.0, 60.0, 120.0])
def test_any_rate(frames: list[av.VideoFrame], rate_hz: float) -> None:
    encoder = Mpeg1Encoder(MEDIUM)
    encoder.retune(bits_per_s=100_000, rate_hz=rate_hz)
    assert len(encode_all(encoder, pictures(frames[:5], rate_hz))) == 5


def test_the_cameras_picture_is_left_as_it_is(frames: list[av.VideoFrame]) -> None:
    frame = frames[0].reformat(format="yuv420p", dst_colorspace=5, dst_color_range=1)  # needs no conversion
    frame.pts = 77
    before = frame.to_ndarray().tobytes()
    Mpeg1Encoder(MEDIUM).encode(Picture(frame, 1, 1, True))
    assert frame.pts == 77
    assert frame.to_ndarray().tobytes() == before


def test_black_and_white_of_a_jpeg_come_out_as_video_has_them() -> None:
    full_range = av.VideoFrame(320, 240, "yuvj420p")
    for plane, value in zip(full_range.planes, (255, 128, 128), strict=True):
        plane.update(bytes([value]) * plane.buffer_size)
    full_range.color_range = 2
    (unit,) = Mpeg1Encoder(MEDIUM).encode(Picture(full_range, 1, 1, True))
    ((frame,),) = decoded([unit.payload])
    assert frame.to_ndarray()[:240].mean() == pytest.approx(235, abs=1.5)


def test_the_units_one_after_another_are_a_file(frames: list[av.VideoFrame]) -> None:
    coded = encode_all(Mpeg1Encoder(MEDIUM), pictures(frames, RATE_HZ, begin_us=3_000_000))
    with av.open(io.BytesIO(b"".join(unit.payload for unit in coded)), format="mpegts") as file:
        stream = file.streams.video[0]
        assert stream.codec_context.name == "mpeg1video"
        times = [frame.time for frame in file.decode(stream)]
    assert times == pytest.approx([3 + number / RATE_HZ for number in range(len(frames))], abs=1e-4)
