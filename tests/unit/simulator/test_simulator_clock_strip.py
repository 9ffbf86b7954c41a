"""The clock strip is read back as drawn, through any codec and scaler; or not at all."""

from __future__ import annotations

from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from worlds.clock_strip import age_ms, read_clock

from simulator.camera.clock_strip import cells_of, draw_strip, strip_height
from simulator.camera.request import read_wanted
from simulator.camera.stream import encode

TIMES_MS = [0, 1, 2, 3, 32767, 32768, 43690, 21845, 65534, 65535, 1_764_000_000_123]
SIZES = [(640, 480), (320, 240), (352, 288), (800, 600), (1280, 720), (160, 120)]


def noisy(width: int, height: int, seed: int = 1) -> np.ndarray:
    """Returns a picture that is hard on codecs: sharp noise moves under the strip."""
    random = np.random.default_rng(seed)
    rough = random.integers(0, 256, (height // 4, width // 4, 3), dtype=np.uint8)
    return np.asarray(cv2.resize(rough, (width, height), interpolation=cv2.INTER_LINEAR))


def drawn(unix_ms: int, width: int = 640, height: int = 480, seed: int = 1) -> np.ndarray:
    picture = noisy(width, height, seed)
    draw_strip(picture, unix_ms)
    return picture


def luma(picture: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("unix_ms", TIMES_MS)
def test_it_is_read_back_in_every_size(unix_ms: int, width: int, height: int) -> None:
    assert read_clock(luma(drawn(unix_ms, width, height))) == unix_ms % 65536


def test_every_time_has_cells_of_its_own_and_neighbours_differ_in_one_bit() -> None:
    rows = [cells_of(time) for time in range(65536)]
    assert len({tuple(row) for row in rows}) == 65536
    for row, following in zip(rows, [*rows[1:], rows[0]], strict=True):
        assert row[:2] == [False, True]
        assert sum(a != b for a, b in zip(row[2:18], following[2:18], strict=True)) == 1
        assert sum(row[2:19]) % 2 == 0
        assert row[19] is not row[18]


def test_the_strip_is_as_high_as_was_agreed() -> None:
    assert [strip_height(height) for height in (480, 240, 720, 288, 120)] == [24, 16, 40, 16, 8]
    picture = np.full((240, 320, 3), 128, np.uint8)
    draw_strip(picture, 0)
    assert (picture[16:] == 128).all()
    assert set(np.unique(picture[:16])) == {16, 235}
    assert (picture[:16, :16] == 16).all()
    assert (picture[:16, 16:32] == 235).all()


@pytest.mark.parametrize("quality", [30, 60, 85])
def test_through_jpeg(quality: int) -> None:
    for number, unix_ms in enumerate(TIMES_MS):
        _, data = cv2.imencode(".jpg", drawn(unix_ms, seed=number), [cv2.IMWRITE_JPEG_QUALITY, quality])
        read = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
        assert read is not None
        assert read_clock(read) == unix_ms % 65536


@pytest.mark.parametrize(
    "how", [cv2.INTER_NEAREST, cv2.INTER_LINEAR, cv2.INTER_AREA], ids=["nearest", "linear", "area"]
)
def test_through_scaling_down(how: int) -> None:
    for unix_ms in TIMES_MS:
        small = cv2.resize(luma(drawn(unix_ms)), (320, 240), interpolation=how)
        assert read_clock(small) == unix_ms % 65536


def test_through_mpeg_1_at_320_by_240_and_300_kbit_a_second() -> None:
    """Each picture goes through the steps of a camera: 640 x 480, JPEG, scaled down, encoded, decoded."""
    encoder = av.CodecContext.create("mpeg1video", "w")
    encoder.width, encoder.height, encoder.pix_fmt = 320, 240, "yuv420p"
    encoder.bit_rate, encoder.gop_size = 300_000, 12
    encoder.options = {"maxrate": "300000", "bufsize": "75000"}
    encoder.framerate, encoder.time_base = Fraction(24), Fraction(1, 24)
    decoder = av.CodecContext.create("mpeg1video", "r")
    times = [1_764_000_000_000 + round(number * 1000 / 24) * 7 for number in range(48)]
    background = cv2.GaussianBlur(noisy(1280, 480), (0, 0), 3)
    packets: list[av.Packet] = []
    for number, unix_ms in enumerate(times):
        picture = np.ascontiguousarray(background[:, number * 8 : number * 8 + 640])
        draw_strip(picture, unix_ms)
        _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])
        arrived = cv2.imdecode(data, cv2.IMREAD_COLOR)
        assert arrived is not None
        frame = av.VideoFrame.from_ndarray(arrived, format="bgr24").reformat(width=320, height=240, format="yuv420p")
        frame.pts = number
        packets += encoder.encode(frame)
    packets += encoder.encode(None)
    pictures = [picture for packet in [*packets, None] for picture in decoder.decode(packet)]
    read = [read_clock(picture.reformat(format="gray").to_ndarray()) for picture in pictures]
    assert read == [unix_ms % 65536 for unix_ms in times]
    assert sum(packet.size for packet in packets) * 8 / 2.0 < 400_000, (
        "the encoder was not held to the bit rate that this is about"
    )


@pytest.mark.parametrize("cell", range(2, 20))
def test_one_wrong_cell_is_found(cell: int) -> None:
    picture = luma(drawn(43_210))
    width = picture.shape[1] // 20
    part = picture[:24, cell * width : (cell + 1) * width]
    part[:] = np.where(part > 128, 16, 235)
    assert read_clock(picture) is None


@pytest.mark.parametrize("cell", range(2, 20))
def test_a_grey_cell_is_not_guessed(cell: int) -> None:
    picture = luma(drawn(43_210))
    picture[:24, cell * 32 : (cell + 1) * 32] = 126
    assert read_clock(picture) is None


def test_a_picture_without_a_strip_has_no_time() -> None:
    assert read_clock(luma(noisy(640, 480))) is None
    assert read_clock(np.zeros((240, 320), np.uint8)) is None
    assert read_clock(np.full((240, 320), 235, np.uint8)) is None


def test_an_age_knows_that_the_clock_wraps() -> None:
    assert age_ms(65_530, 65536 * 5 + 20) == 26
    assert age_ms(100, 65536 * 5 + 90) == -10


def test_the_strip_is_drawn_last_and_says_when() -> None:
    wanted = read_wanted("/camera?width=320&height=240", "vehicle 1")
    unix_us, jpeg = encode(np.full((240, 320, 3), 90, np.uint8), wanted)
    read = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert read is not None
    assert read_clock(read) == unix_us // 1000 % 65536
    assert (read[220:238, 4:60] > 180).any(), "no name"
    assert (read[220:238, 220:316] > 180).any(), "no clock"
