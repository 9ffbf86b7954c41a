"""H.264: an encoder is used only if its output matches its input; parameter sets at each key picture."""

from types import SimpleNamespace

import av
import numpy as np
import pytest
from av.video.frame import PictureType
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc
from worlds.moving_pictures import flight, off_by, pictures

from onboard_agent.video.core.allotment import SHARE_OF_MPEG1
from onboard_agent.video.encoders import choice, pyav_encoder
from onboard_agent.video.encoders.annex_b import IDR, PICTURE_PARAMETERS, SEQUENCE_PARAMETERS, nal_types
from onboard_agent.video.encoders.annex_b import with_parameter_sets as complete
from onboard_agent.video.encoders.encoder import EncodedPicture, EncoderBroken
from onboard_agent.video.encoders.h264 import BY_HARDWARE, BY_PROCESSOR, H264Encoder, H264Kind
from onboard_agent.video.encoders.picture_shape import Shape, coded_shape
from onboard_agent.video.encoders.pyav_encoder import SMPTE170M_MATRIX
from wire.video import LIMITS, Codec, Quality

RATE_HZ = 24.0
MEDIUM, HIGH = LIMITS[Quality.MEDIUM], LIMITS[Quality.HIGH]
SPS, PPS = b"\x00\x00\x00\x01\x67\x42\xc0\x1e", b"\x00\x00\x01\x68\xce\x3c\x80"
IDR_SLICE = b"\x00\x00\x01\x65\x88\x84"


@pytest.fixture(scope="module")
def frames() -> list[av.VideoFrame]:
    return flight(320, 240, 72)


def encode_all(encoder: H264Encoder, frames: list[av.VideoFrame]) -> list[EncodedPicture]:
    coded = [encoder.encode(picture) for picture in pictures(frames, RATE_HZ)]
    assert [len(units) for units in coded] == [1] * len(frames)
    return [units[0] for units in coded]


def test_each_picture_is_shown_when_it_has_been_fed(frames: list[av.VideoFrame]) -> None:
    decoder = av.VideoCodecContext.create("h264", "r")
    decoder.thread_count = 1
    for number, unit in enumerate(encode_all(H264Encoder(BY_PROCESSOR, MEDIUM), frames)):
        (shown,) = decoder.decode(av.Packet(unit.payload))
        assert off_by(shown, frames[number]) < 8
        if number:
            assert off_by(shown, frames[number]) < off_by(shown, frames[number - 1])


def test_the_colours_are_said_in_each_stream_as_they_are_coded(frames: list[av.VideoFrame]) -> None:
    decoder = av.VideoCodecContext.create("h264", "r")
    decoder.thread_count = 1
    encoder = H264Encoder(BY_PROCESSOR, MEDIUM)
    for picture in pictures(frames[:2], RATE_HZ):
        (coded,) = encoder.encode(picture, force_key=True)
        (shown,) = decoder.decode(av.Packet(coded.payload))
        reported = decoder.color_range, decoder.color_primaries, decoder.color_trc, decoder.colorspace
        assert reported == (ColorRange.MPEG, ColorPrimaries.SMPTE170M, ColorTrc.SMPTE170M, SMPTE170M_MATRIX)
        assert (shown.color_range, shown.colorspace) == (ColorRange.MPEG, SMPTE170M_MATRIX)


@pytest.mark.parametrize(
    ("matrix", "full_range"), [(Colorspace.ITU709, False), (Colorspace.ITU601, True)], ids=["BT.709", "full range"]
)
def test_pictures_of_other_colours_look_the_same(*, matrix: Colorspace, full_range: bool) -> None:
    red = np.zeros((240, 320, 3), np.uint8) + np.array([200, 60, 90], np.uint8)
    given = av.VideoFrame.from_ndarray(red, format="rgb24").reformat(
        format="yuv420p", dst_colorspace=matrix, dst_color_range=ColorRange.JPEG if full_range else ColorRange.MPEG
    )
    assert (given.colorspace == Colorspace.ITU709) is not full_range
    decoder = av.VideoCodecContext.create("h264", "r")
    decoder.thread_count = 1
    (coded,) = H264Encoder(BY_PROCESSOR, HIGH).encode(pictures([given], RATE_HZ)[0])
    (shown,) = decoder.decode(av.Packet(coded.payload))
    assert np.abs(shown.to_ndarray(format="rgb24").astype(int) - red).mean() < 6


def test_decoding_can_begin_at_each_key_picture(frames: list[av.VideoFrame]) -> None:
    coded = encode_all(H264Encoder(BY_PROCESSOR, MEDIUM), frames)
    assert [number for number, unit in enumerate(coded) if unit.key] == [0, 24, 48]
    for unit in coded:
        kinds = set(nal_types(unit.payload))
        assert ({SEQUENCE_PARAMETERS, PICTURE_PARAMETERS, IDR} <= kinds) is unit.key
        assert (IDR in kinds) is unit.key
    decoder = av.VideoCodecContext.create("h264", "r")
    decoder.thread_count = 1
    assert [len(decoder.decode(av.Packet(unit.payload))) for unit in coded[24:]] == [1] * 48
    assert decoder.profile in ("Constrained Baseline", "Baseline")


def test_the_bit_rate_goes_down_at_once_and_up_at_the_next_key_picture(frames: list[av.VideoFrame]) -> None:
    encoder = H264Encoder(BY_PROCESSOR, MEDIUM)
    given = pictures(frames, RATE_HZ)
    sizes = []
    for number, picture in enumerate(given):
        if number == 26:
            encoder.retune(bits_per_s=80_000, rate_hz=RATE_HZ)
        sizes += [len(unit.payload) for unit in encoder.encode(picture)]
    before, at_once, after = sum(sizes[2:24]) / 22, sum(sizes[28:48]) / 20, sum(sizes[50:]) / 22
    assert at_once < before / 2
    assert after < before / 2
    assert 8 * sum(sizes[48:]) / 24 * RATE_HZ < 80_000 * 1.15


def test_the_picture_can_be_made_smaller(frames: list[av.VideoFrame]) -> None:
    encoder = H264Encoder(BY_PROCESSOR, MEDIUM)
    given = pictures(frames[:4], RATE_HZ)
    encoder.encode(given[0])
    encoder.retune(bits_per_s=100_000, rate_hz=RATE_HZ, scale=0.5)
    assert [encoder.encode(given[1])[0][1:4], encoder.encode(given[2], force_key=True)[0][1:4]] == [
        (False, 320, 240),
        (True, 160, 120),
    ]


def test_the_processor_can_do_it_here() -> None:
    assert choice.what_is_wrong(BY_PROCESSOR) == ""


def test_an_encoder_that_holds_pictures_back_is_not_used() -> None:
    slow = H264Kind("libx264", options={"preset": "veryfast", "forced-idr": "1", "rc-lookahead": "20"})
    assert choice.what_is_wrong(slow) == "of 6 pictures it holds 6 back"


def test_an_encoder_that_is_deaf_to_wishes_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = PictureType.NONE
    monkeypatch.setattr(pyav_encoder, "PictureType", SimpleNamespace(I=nothing, NONE=nothing))
    assert choice.what_is_wrong(BY_PROCESSOR) == "it gives no key picture when it is asked to"


def test_an_encoder_that_is_not_there_is_not_used() -> None:
    assert choice.what_is_wrong(H264Kind("h264_of_nobody")) != ""
    for kind in BY_HARDWARE:  # whatever this machine has: a result, not an exception
        assert isinstance(choice.what_is_wrong(kind), str)


def test_an_encoder_whose_pictures_look_otherwise_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    given = choice._test_picture()
    # Not `VideoFrame(width, height)`: that shows earlier memory contents, at times the test picture.
    dark = av.VideoFrame.from_ndarray(np.full((given.height, given.width), 16, np.uint8), format="gray")
    asked = []

    def another(*_: object) -> av.VideoFrame:
        asked.append(True)
        return given if len(asked) > 6 else dark.reformat(format="yuv420p")

    monkeypatch.setattr(choice, "_test_picture", another)
    assert "looks otherwise" in choice.what_is_wrong(BY_PROCESSOR)


def test_the_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    assert choice.make_encoder(Codec.MPEG1, Quality.LOW).name == "mpeg1video"
    monkeypatch.setattr(choice, "best_h264", lambda: None)
    assert choice.usable_codecs() == (Codec.MPEG1,)
    with pytest.raises(EncoderBroken, match=r"no H\.264"):
        choice.make_encoder(Codec.H264, Quality.LOW)
    monkeypatch.setattr(choice, "best_h264", lambda: BY_PROCESSOR)
    assert choice.usable_codecs() == (Codec.MPEG1, Codec.H264)
    encoder = choice.make_encoder(Codec.H264, Quality.HIGH)
    assert (encoder.name, encoder.codec) == ("libx264", Codec.H264)


def test_it_starts_at_its_share_of_the_bit_rate(frames: list[av.VideoFrame]) -> None:
    coded = encode_all(H264Encoder(BY_PROCESSOR, MEDIUM), frames)
    assert 8 * sum(len(unit.payload) for unit in coded) / 3 < MEDIUM.bits_per_s * SHARE_OF_MPEG1[Codec.H264] * 1.1


@pytest.mark.parametrize(
    ("unit", "sets", "whole"),
    [
        (SPS + PPS + IDR_SLICE, b"", SPS + PPS + IDR_SLICE),
        (IDR_SLICE, SPS + PPS, SPS + PPS + IDR_SLICE),
        (SPS + IDR_SLICE, SPS + PPS, SPS + PPS + SPS + IDR_SLICE),
    ],
    ids=["has its own", "has none", "has one"],
)
def test_parameter_sets(unit: bytes, sets: bytes, whole: bytes) -> None:
    assert complete(unit, sets) == whole


@pytest.mark.parametrize(
    ("unit", "sets", "wrong"),
    [(IDR_SLICE, b"", "parameter sets"), (IDR_SLICE, b"\x01\x42\xc0\x1e", "parameter sets"), (b"abc", SPS, "start")],
    ids=["none", "of another kind", "no annex B"],
)
def test_no_parameter_sets_to_be_had(unit: bytes, sets: bytes, wrong: str) -> None:
    with pytest.raises(ValueError, match=wrong):
        complete(unit, sets)


@pytest.mark.parametrize(
    ("source", "scale", "coded"),
    [
        ((640, 480), 1.0, (640, 480)),
        ((1920, 1080), 1.0, (640, 360)),
        ((1080, 1920), 1.0, (270, 480)),
        ((320, 240), 1.0, (320, 240)),
        ((321, 239), 1.0, (320, 240)),
        ((640, 480), 0.5, (320, 240)),
        ((64, 64), 0.1, (48, 48)),
        ((4000, 100), 1.0, (640, 48)),
    ],
    ids=lambda value: f"{value[0]}x{value[1]}" if isinstance(value, tuple) else str(value),
)
def test_shapes(source: tuple[int, int], scale: float, coded: tuple[int, int]) -> None:
    assert coded_shape(Shape(*source), HIGH, scale) == coded
