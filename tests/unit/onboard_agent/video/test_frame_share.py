"""The newest picture in shared memory: what a reader gets, and what it does not."""

import os
from collections.abc import Iterator

import av
import numpy as np
import pytest

from onboard_agent.video.core.frame_memory import HEADER_BYTES, MAX_WIDTH_PX, SIZE_BYTES
from onboard_agent.video.frame_share import FrameReader, FrameWriter
from onboard_agent.video.sources.source import Picture


@pytest.fixture
def path() -> Iterator[str]:
    fd = os.memfd_create("test")
    os.ftruncate(fd, SIZE_BYTES)
    yield f"/proc/{os.getpid()}/fd/{fd}"
    os.close(fd)


def picture(number: int, width: int = 64, height: int = 48, *, is_break: bool = False) -> Picture:
    pixels = np.full((height, width, 3), number, np.uint8)
    return Picture(av.VideoFrame.from_ndarray(pixels, format="bgr24"), 1_000_000 * number, number, is_break)


def test_a_reader_gets_the_newest_picture_once(path: str) -> None:
    writer, reader = FrameWriter(path), FrameReader(path)
    assert not reader.has_news()
    assert reader.newest() is None
    for number in (1, 2, 3):
        writer.write(picture(number, is_break=number == 3))
    assert reader.has_news()
    got = reader.newest()
    assert got is not None
    assert (got.number, got.capture_us, got.is_break) == (3, 3_000_000, True)
    pixels = got.frame.to_ndarray(format="bgr24")
    assert pixels.shape == (48, 64, 3)
    assert (pixels == 3).all()
    assert not reader.has_news()
    assert reader.newest() is None


def test_what_was_there_before_the_reader_is_old(path: str) -> None:
    writer = FrameWriter(path)
    writer.write(picture(1))
    reader = FrameReader(path)
    assert reader.newest() is None
    writer.write(picture(2))
    got = reader.newest()
    assert got is not None
    assert got.number == 2


def test_each_of_two_readers_gets_it(path: str) -> None:
    writer, one, other = FrameWriter(path), FrameReader(path), FrameReader(path)
    writer.write(picture(1))
    assert one.newest() is not None
    assert other.newest() is not None


def test_a_half_written_picture_is_not_read(path: str) -> None:
    writer, reader = FrameWriter(path), FrameReader(path)
    writer.write(picture(1))
    fd = os.open(path, os.O_RDWR)
    os.pwrite(fd, (3).to_bytes(8, "little"), 0)  # a writer that was killed in the middle of it
    assert reader.newest() is None
    os.close(fd)
    again = FrameWriter(path)
    again.write(picture(2))
    got = reader.newest()
    assert got is not None
    assert got.number == 2


def test_a_picture_that_is_too_large_is_made_smaller(path: str) -> None:
    writer, reader = FrameWriter(path), FrameReader(path)
    writer.write(picture(1, 2 * MAX_WIDTH_PX, 1000))
    got = reader.newest()
    assert got is not None
    assert (got.frame.width, got.frame.height) == (MAX_WIDTH_PX, 500)


def test_a_size_that_cannot_be_is_not_read(path: str) -> None:
    writer, reader = FrameWriter(path), FrameReader(path)
    writer.write(picture(1))
    fd = os.open(path, os.O_RDWR)
    os.pwrite(fd, b"\xff" * 8, 8 + 16)
    os.close(fd)
    assert reader.newest() is None


def test_memory_that_is_none(tmp_path: str) -> None:
    with pytest.raises(OSError, match="No such file"):
        FrameReader(f"{tmp_path}/none")
    short = f"{tmp_path}/short"
    with open(short, "wb") as file:  # noqa: PTH123
        file.write(bytes(HEADER_BYTES))
    with pytest.raises(ValueError, match="mmap"):
        FrameReader(short)
