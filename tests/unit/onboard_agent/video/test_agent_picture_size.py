"""The size of a picture from its header alone, and which are too large to decode."""

import cv2
import numpy as np
import pytest

from onboard_agent.video.sources.decoding import JpegDecoder
from onboard_agent.video.sources.picture_size import MAX_PIXELS, TooLarge, check_size, jpeg_size

START = b"\xff\xd8"


def jpeg(width: int, height: int, *options: int) -> bytes:
    return cv2.imencode(".jpg", np.zeros((height, width, 3), np.uint8), options)[1].tobytes()


def frame(marker: int, width: int, height: int) -> bytes:
    return bytes([0xFF, marker, 0, 11, 8]) + height.to_bytes(2) + width.to_bytes(2) + b"\x01\x01\x11\x00"


PROGRESSIVE = (cv2.IMWRITE_JPEG_PROGRESSIVE, 1)


@pytest.mark.parametrize("options", [(), PROGRESSIVE], ids=["baseline", "progressive"])
@pytest.mark.parametrize("size", [(640, 480), (1, 1), (333, 17)])
def test_of_real_pictures(size: tuple[int, int], options: tuple[int, ...]) -> None:
    assert jpeg_size(jpeg(*size, *options)) == size


@pytest.mark.parametrize(
    ("head", "size"),
    [
        (START + frame(0xC0, 8000, 8000), (8000, 8000)),
        (START + b"\xff\xff\xff" + frame(0xC2, 65535, 3), (65535, 3)),
        (START + b"\xff\xe1\x00\x0f" + frame(0xC0, 160, 120) + frame(0xC0, 1, 2), (1, 2)),  # a preview inside
        (START + b"\xff\xc4\x00\x02\xff\x01" + frame(0xCF, 5, 6), (5, 6)),
        (START + frame(0xC0, 0, 480), None),
        (START + frame(0xC0, 640, 0), None),
        (START + frame(0xC0, 640, 480)[:8], None),
        (START + b"\xff\xda\x00\x02" + frame(0xC0, 640, 480), None),
        (START + b"\xff\xd9" + frame(0xC0, 640, 480), None),
        (START + b"junk" + frame(0xC0, 640, 480), None),
        (START + b"\xff\xe0\xff\xff", None),
        (b"\x89PNG\r\n\x1a\n" + bytes(30), None),
        (b"", None),
    ],
)
def test_by_the_head(head: bytes, size: tuple[int, int] | None) -> None:
    assert jpeg_size(head) == size


def test_each_part_of_a_picture_is_read_without_harm() -> None:
    whole = jpeg(64, 48)
    assert {jpeg_size(whole[:length]) for length in range(len(whole))} == {None, (64, 48)}


def test_cameras_of_4k_are_taken_and_larger_ones_refused_with_both_sizes() -> None:
    for size in ((3840, 2160), (4096, 2160), (4096, 2304), (2304, 4096)):
        check_size(*size)
    with pytest.raises(
        TooLarge, match=r"8000 x 8000 pixels are too large, the most is 9\.4 million pixels \(4096 x 2304\)"
    ):
        check_size(8000, 8000)
    with pytest.raises(TooLarge):
        check_size(MAX_PIXELS + 1, 1)


def test_a_picture_that_is_too_large_is_not_decoded() -> None:
    decoder = JpegDecoder()
    large = jpeg(4096, 2305)
    with pytest.raises(TooLarge):
        decoder.decode(large)
    assert decoder.decode(START + b"junk" + large[2:]) is None, "the decoder has the same bound"
    whole = decoder.decode(START + b"junk" + jpeg(64, 48)[2:])
    assert whole is None or (whole.width, whole.height) == (64, 48)
    small = decoder.decode(jpeg(64, 48))
    assert small is not None
    assert (small.width, small.height) == (64, 48)
