"""V4L2 with a fake OpenCV: pixels of each kind, the driver's stamps, and a camera that is unplugged."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.source import CameraLost, PictureRequest, now_us
from onboard_agent.video.sources.v4l2 import V4l2Source

WIDTH, HEIGHT = 64, 48
GREY = 100
YUYV = np.dstack([np.full((HEIGHT, WIDTH), GREY, np.uint8), np.full((HEIGHT, WIDTH), 128, np.uint8)])
PLANAR = np.vstack([np.full((HEIGHT, WIDTH), GREY, np.uint8), np.full((HEIGHT // 2, WIDTH), 128, np.uint8)])


class FakeCapture:
    """A cv2.VideoCapture of a camera that returns `pixels`, whatever the request."""

    def __init__(self, pixels: Any, fourcc: str, opened: bool = True) -> None:
        self.pixels, self.opened, self.plugged = pixels, opened, True
        self.properties: dict[int, float] = {}
        self.fourcc = fourcc
        self.stamp_us: int | None = None
        self.released = False
        self.size = (0, 0)

    def isOpened(self) -> bool:
        return self.opened

    def set(self, what: int, value: float) -> bool:
        self.properties[what] = value
        return True

    def get(self, what: int) -> float:
        if what == cv2.CAP_PROP_FOURCC:
            return float(int.from_bytes(self.fourcc.encode(), "little"))
        if what == cv2.CAP_PROP_POS_MSEC:
            return (now_us() if self.stamp_us is None else self.stamp_us) / 1000
        if what in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT):
            return float(self.size[what == cv2.CAP_PROP_FRAME_HEIGHT])
        return 0.0

    def grab(self) -> bool:
        return self.plugged

    def retrieve(self) -> tuple[bool, Any]:
        return self.pixels is not None, self.pixels

    def release(self) -> None:
        self.released = True


ANY_MODE = Mode()


def opened(tmp_path: Path, capture: FakeCapture, mode: Mode = ANY_MODE) -> V4l2Source:
    device = tmp_path / "video0"
    device.touch()
    source = V4l2Source("v4l2:video0", str(device), mode, lambda _: capture)
    source.open(PictureRequest(640, 480, 30.0))
    return source


def jpeg() -> np.ndarray:
    return cv2.imencode(".jpg", np.full((HEIGHT, WIDTH, 3), GREY, np.uint8))[1].reshape(1, -1)


@pytest.mark.parametrize(
    ("fourcc", "pixels"),
    [
        ("MJPG", jpeg()),
        ("YUYV", YUYV),
        ("UYVY", YUYV[:, :, ::-1]),
        ("YU12", PLANAR),
        ("NV12", PLANAR),
        ("GREY", PLANAR[:HEIGHT]),
        ("RGB3", np.full((HEIGHT, WIDTH, 3), GREY, np.uint8)),
    ],
    ids=["MJPG", "YUYV", "UYVY", "YU12", "NV12", "GREY", "converted by OpenCV"],
)
def test_pixels_of_each_kind(tmp_path: Path, fourcc: str, pixels: np.ndarray) -> None:
    taken = opened(tmp_path, FakeCapture(np.ascontiguousarray(pixels), fourcc)).read()
    assert taken is not None
    assert (taken.frame.width, taken.frame.height) == (WIDTH, HEIGHT)
    grey = taken.frame.to_ndarray(format="rgb24")
    assert abs(grey.astype(int) - GREY).max() <= 22  # limited or full range, but neither another plane nor a colour
    assert grey.std() < 3


def test_it_asks_for_compressed_pictures_of_the_size_and_keeps_none_waiting(tmp_path: Path) -> None:
    capture = FakeCapture(YUYV, "YUYV")
    opened(tmp_path, capture)
    assert capture.properties[cv2.CAP_PROP_BUFFERSIZE] == 1
    assert capture.properties[cv2.CAP_PROP_FOURCC] == cv2.VideoWriter.fourcc(*"MJPG")
    assert (capture.properties[cv2.CAP_PROP_FRAME_WIDTH], capture.properties[cv2.CAP_PROP_FPS]) == (640, 30)
    reported = FakeCapture(YUYV, "YUYV")
    opened(tmp_path, reported, Mode(1280, 720, 60))
    assert (reported.properties[cv2.CAP_PROP_FRAME_HEIGHT], reported.properties[cv2.CAP_PROP_FPS]) == (720, 60)


def test_the_drivers_stamp_counts_when_it_is_of_our_clock(tmp_path: Path) -> None:
    capture = FakeCapture(YUYV, "YUYV")
    source = opened(tmp_path, capture)
    capture.stamp_us = now_us() - 20_000
    taken = source.read()
    assert taken is not None
    assert taken.capture_us == capture.stamp_us
    for other_clock in (0, now_us() + 5_000_000, now_us() - 10_000_000):
        capture.stamp_us = other_clock
        before = now_us()
        taken = source.read()
        assert taken is not None
        assert before <= taken.capture_us <= now_us()


def test_pulled_out(tmp_path: Path) -> None:
    capture = FakeCapture(YUYV, "YUYV")
    source = opened(tmp_path, capture)
    capture.plugged = False
    with pytest.raises(CameraLost, match="gives no pictures any more"):
        source.read()
    source.close()
    assert capture.released


def test_a_damaged_picture_is_left_out(tmp_path: Path) -> None:
    assert opened(tmp_path, FakeCapture(np.zeros((1, 500), np.uint8), "MJPG")).read() is None
    assert opened(tmp_path, FakeCapture(None, "MJPG")).read() is None


def test_why_it_cannot_be_used_is_said(tmp_path: Path) -> None:
    with pytest.raises(CameraLost, match="there is no /dev/video77"):
        V4l2Source("v4l2:/dev/video77", "/dev/video77", Mode()).open(PictureRequest())
    with pytest.raises(CameraLost, match="is no camera, or another program has it"):
        opened(tmp_path, FakeCapture(None, "", opened=False))
    with pytest.raises(CameraLost, match="gives H264, which we cannot read"):
        opened(tmp_path, FakeCapture(PLANAR, "H264")).read()


def test_pictures_that_are_too_large_are_refused_before_the_first_is_fetched(tmp_path: Path) -> None:
    capture = FakeCapture(None, "MJPG")
    capture.size = (8000, 8000)
    with pytest.raises(
        CameraLost, match=r"v4l2:video0: pictures of 8000 x 8000 pixels are too large, the most is 9\.4"
    ):
        opened(tmp_path, capture)
    large = cv2.imencode(".jpg", np.zeros((4096, 4096, 3), np.uint8))[1].reshape(1, -1)
    with pytest.raises(CameraLost, match="4096 x 4096"):  # the driver did not announce it
        opened(tmp_path, FakeCapture(large, "MJPG")).read()


def test_opencv_itself_on_what_is_no_camera(tmp_path: Path) -> None:
    device = tmp_path / "video0"
    device.write_bytes(b"no camera")
    with pytest.raises(CameraLost, match="is no camera"):
        V4l2Source("v4l2:video0", str(device), Mode()).open(PictureRequest())
