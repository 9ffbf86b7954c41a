"""Units of video become arrays: both codecs, from a key picture on, and again after a gap."""

import pytest
from av.video.frame import VideoFrame
from worlds.camera_units import number_in, units

from control_tower.pictures import Picture, UnitDecoder
from wire.video import Codec, Unit, decode_unit

CODECS = pytest.mark.parametrize("codec", list(Codec), ids=lambda one: one.name)


def made(codec: Codec, count: int = 8, group: int = 4) -> list[Unit]:
    times = [1_000_000 + 40_000 * number for number in range(count)]
    return [decode_unit(message) for message in units(codec, times, group=group)]


def number(picture: Picture | None) -> int:
    assert picture is not None
    return number_in(VideoFrame.from_ndarray(picture.image, format="rgb24"))


@CODECS
def test_each_unit_is_its_picture(codec: Codec) -> None:
    decoder = UnitDecoder("rgb24")
    pictures = [decoder.decode(unit) for unit in made(codec)]
    assert [number(picture) for picture in pictures] == list(range(8))
    assert pictures[1] is not None
    assert (pictures[1].image.shape, pictures[1].image.dtype.name) == ((240, 320, 3), "uint8")
    assert (pictures[1].sequence, pictures[1].captured_us) == (1, 1_040_000)


@CODECS
def test_it_waits_for_a_key_at_first_and_after_a_gap(codec: Codec) -> None:
    decoder = UnitDecoder("gray")
    came = made(codec)
    assert [unit.sequence for unit in came if unit.key] == [0, 4]
    seen = [decoder.decode(unit) for unit in (*came[1:3], came[0], came[2], came[3], *came[4:])]
    assert [picture.sequence if picture else None for picture in seen] == [None, None, 0, None, None, 4, 5, 6, 7]
    assert seen[2] is not None
    assert seen[2].image.shape == (240, 320)


@CODECS
def test_what_is_damaged_is_left_out_until_the_next_key(codec: Codec) -> None:
    decoder = UnitDecoder("rgb24")
    came = made(codec)
    broken = came[1]._replace(payload=b"\x47" * 100)
    seen = [decoder.decode(unit) for unit in (came[0], broken, came[2], *came[4:6])]
    assert [picture.sequence if picture else None for picture in seen] in ([0, None, None, 4, 5], [0, None, 2, 4, 5])
    assert number(seen[3]) == 4


def test_a_break_and_another_codec_begin_anew() -> None:
    decoder = UnitDecoder("rgb24")
    mpeg1, h264 = made(Codec.MPEG1), made(Codec.H264)
    assert decoder.decode(mpeg1[0]) is not None
    assert decoder.decode(mpeg1[1]._replace(is_break=True)) is None
    assert decoder.decode(h264[1]) is None
    assert number(decoder.decode(h264[4])) == 4
    unknown = decoder.decode(h264[5]._replace(capture_us=0))
    assert unknown is not None
    assert unknown.captured_us is None
