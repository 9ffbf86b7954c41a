"""A camera's silence, its stamps converted to our clock, and pictures in a multipart stream."""

import random

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.video.sources.arrival_clock import ArrivalClock
from onboard_agent.video.sources.camera_watch import SILENT_S, CameraWatch
from onboard_agent.video.sources.multipart import MAX_PICTURE_BYTES, Malformed, MultipartPictures, Part
from wire.video import CameraState

LIVE, LOST, OPENING, IDLE = CameraState.LIVE, CameraState.LOST, CameraState.OPENING, CameraState.IDLE


def watched(*at: float) -> CameraWatch:
    watch = CameraWatch("pi:0")
    watch.opening()
    for now in at:
        watch.picture(now)
    return watch


def test_a_camera_that_falls_silent_is_lost_well_within_a_second() -> None:
    watch = watched(*(number / 30 for number in range(60)))
    watch.tick(2.0 + SILENT_S - 0.1)
    assert watch.state is LIVE
    watch.tick(2.0 + SILENT_S)
    assert (watch.state, watch.words) == (LOST, "pi:0: gives no pictures any more")
    watch.picture(4.0)
    assert (watch.state, watch.words) == (LIVE, "")


def test_a_slow_camera_may_be_silent_for_longer() -> None:
    watch = watched(*(number * 0.4 for number in range(40)))
    last = 39 * 0.4
    watch.tick(last + 1.2)
    assert watch.state is LIVE
    watch.tick(last + 1.8)
    assert watch.state is LOST


def test_what_is_lost_stays_lost_until_there_is_a_picture() -> None:
    watch = watched()
    assert watch.state is OPENING
    watch.tick(100.0)
    assert watch.state is OPENING
    watch.lost("pi:0: not there")
    watch.opening()
    assert (watch.state, watch.words) == (LOST, "pi:0: not there")
    watch.picture(101.0)
    assert watch.state is LIVE
    watch.closed()
    watch.tick(200.0)
    assert watch.state is IDLE


def test_stamps_take_away_what_the_network_added() -> None:
    clock, jitter = ArrivalClock(), random.Random(1)
    ahead_us = 777_000_000_000
    for number in range(2000):
        taken_us = number * 33_333
        late_us = 5_000 + (jitter.randrange(40_000) if number else 0)
        found_us = clock.taken_us(taken_us + ahead_us, taken_us + late_us)
        assert found_us <= taken_us + late_us
        if number > 60:
            assert 0 <= found_us - taken_us <= 8_000  # the shortest delay remains unknown


def test_stamps_of_a_clock_that_goes_wrong_by_a_hundred_parts_in_a_million() -> None:
    clock = ArrivalClock()
    found = [clock.taken_us(round(number * 33_333 * 1.0001), number * 33_333) for number in range(20_000)]
    assert all(abs(one - number * 33_333) <= 1_100 for number, one in enumerate(found))


def test_stamps_that_begin_anew() -> None:
    clock = ArrivalClock()
    assert clock.taken_us(5_000_000, 100_000_000) == 100_000_000
    assert clock.taken_us(5_040_000, 100_060_000) == 100_040_000
    assert clock.taken_us(0, 101_000_000) == 101_000_000
    assert clock.taken_us(40_000, 101_060_000) == 101_040_000


def jpeg(seed: int, **options: int) -> bytes:
    pixels = np.random.default_rng(seed).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    flags = [value for name, number in options.items() for value in (getattr(cv2, name), number)]
    return cv2.imencode(".jpg", pixels, flags)[1].tobytes()


def with_thumbnail(picture: bytes) -> bytes:
    inner = jpeg(99)
    return picture[:2] + b"\xff\xe1" + (len(inner) + 2).to_bytes(2) + inner + picture[2:]


JPEGS = [
    jpeg(1),
    jpeg(2, IMWRITE_JPEG_PROGRESSIVE=1),
    jpeg(3, IMWRITE_JPEG_RST_INTERVAL=2),
    with_thumbnail(jpeg(4)),
    jpeg(5)[:2] + b"\xff\xff\xff" + jpeg(5)[3:],
]
"""Plain; in several scans; with restart markers; with another picture in its head; with fillers."""


BOUNDARY = b"--frame\r\n"


def parts_of(length: bool, end: bytes = b"\r\n") -> bytes:
    row = b""
    for number, picture in enumerate(JPEGS):
        head = BOUNDARY + b"Content-Type: image/jpeg\r\nX-Number: %d\r\n" % number
        row += head + (b"content-length: %d\r\n" % len(picture) if length else b"") + b"\r\n" + picture + end
    return row


@pytest.mark.parametrize("length", [True, False], ids=["length given", "no length given"])
@given(cuts=st.lists(st.integers(1, 4000), max_size=60))
def test_pictures_come_whole_however_they_are_cut(length: bool, cuts: list[int]) -> None:
    row, reader, found = parts_of(length), MultipartPictures(), list[Part]()
    for size in [*cuts, len(row)]:
        piece, row = row[:size], row[size:]
        found += reader.feed(piece, 1)
    assert [part.picture for part in found] == JPEGS
    assert [part.headers["x-number"] for part in found] == ["0", "1", "2", "3", "4"]


@pytest.mark.parametrize("length", [True, False], ids=["length given", "no length given"])
def test_a_picture_is_there_with_its_last_byte_and_timed_by_its_first(length: bool) -> None:
    row, reader = parts_of(length, end=b""), MultipartPictures()
    begun_at, found = len(BOUNDARY), []
    for at in range(len(row)):
        parts = reader.feed(row[at : at + 1], at)
        if parts:
            (part,) = parts
            assert row[: at + 1].endswith(part.picture)  # not a byte later
            assert part.began_us == begun_at
            begun_at = at + 1 + len(BOUNDARY)
            found.append(part)
    assert len(found) == len(JPEGS)


def test_a_boundary_that_comes_with_the_picture_before_says_nothing_of_the_time() -> None:
    reader = MultipartPictures()
    assert reader.feed(BOUNDARY, 1) == []
    for number, picture in enumerate(JPEGS):
        pieces = b"Content-Type: image/jpeg\r\n\r\n" + picture, b"\r\n" + BOUNDARY
        (part,) = reader.feed(pieces[0], 1000 * number)
        assert part.began_us == 1000 * number
        assert reader.feed(pieces[1], 1000 * number + 1) == []


@given(st.lists(st.binary(max_size=200), max_size=20))
def test_anything_else_is_refused_or_waited_for(pieces: list[bytes]) -> None:
    reader = MultipartPictures()
    try:
        for piece in [b"--x\r\n\r\n", *pieces]:
            reader.feed(piece, 0)
    except Malformed:
        pass


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (b"--x\r\nContent-Length: 99999999\r\n\r\n", "99999999 bytes"),
        (b"--x\r\nContent-Type: image/png\r\n\r\n\x89PNG", "no JPEG"),
        (b"x" * 10_000, "no picture begins"),
    ],
    ids=["too large", "no JPEG", "no part"],
)
def test_what_is_no_row_of_pictures(row: bytes, words: str) -> None:
    with pytest.raises(Malformed, match=words):
        MultipartPictures().feed(row, 0)


def test_a_picture_without_end_is_not_kept_for_ever() -> None:
    reader = MultipartPictures()
    head = JPEGS[0][:-2]
    with pytest.raises(Malformed, match="of more than"):
        for _ in range(20):
            reader.feed(b"--x\r\n\r\n" + head + bytes(MAX_PICTURE_BYTES // 10), 0)
