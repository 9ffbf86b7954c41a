"""`Cameras`: the simulator's camera over HTTP, one through OpenCV, and one that is not there."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest

from onboard_agent.unusable import Unusable
from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.source import now_us
from onboard_agent.video.sources.v4l2 import V4l2Source
from onboard_agent.vision.cameras.cameras import Cameras, Frame
from simulator.camera.marks import Mark
from simulator.camera.scene import Scene
from simulator.camera.server import Camera, CameraEndpoint, listen
from simulator.camera.view import pose_of
from wire.video import CameraState

DEADLINE_S = 60.0


@pytest.fixture(scope="module")
def simulated() -> Iterator[str]:
    """The address of a camera 6 m above the pad of vehicle 1."""
    listener = listen(CameraEndpoint("127.0.0.1", 0))
    port = listener.getsockname()[1]
    pose = pose_of(0.0, 0.0, 6.0, 0.0, 0.0, 0.0)
    scene = Scene(1, [Mark(0.0, 0.0, "1")])
    scene.prepare()
    camera = Camera(
        CameraEndpoint("127.0.0.1", port), "vehicle 1", scene, sight=lambda: (pose, 0.0), on_unplug=lambda seconds: None
    )
    camera.start(listener)
    yield f"http://127.0.0.1:{port}/camera?tilt=90&width=320&height=240&rate=20"
    camera.close()


class FakeCapture:
    """A cv2.VideoCapture that gives one grey picture after the other."""

    def __init__(self) -> None:
        self.level = 0
        self.released = False

    def isOpened(self) -> bool:
        return True

    def set(self, what: int, value: float) -> bool:
        return True

    def get(self, what: int) -> float:
        if what == cv2.CAP_PROP_FOURCC:
            return float(int.from_bytes(b"BGR3", "little"))
        return now_us() / 1000 if what == cv2.CAP_PROP_POS_MSEC else 0.0

    def grab(self) -> bool:
        return not self.released

    def retrieve(self) -> tuple[bool, np.ndarray]:
        self.level = (self.level + 1) % 200
        return True, np.full((48, 64, 3), self.level, np.uint8)

    def release(self) -> None:
        self.released = True


def wait_for_frame(cameras: Cameras, name: str, changed: threading.Event, after: int = 0) -> Frame:
    while True:
        changed.clear()
        frame = cameras.get_frames().get(name)
        if frame is not None and frame.number > after:
            return frame
        assert changed.wait(DEADLINE_S), cameras.states()


def test_the_simulators_camera_looks_down_on_its_pad(simulated: str) -> None:
    changed = threading.Event()
    with Cameras.open({"down": simulated}, on_change=changed.set) as cameras:
        frame = wait_for_frame(cameras, "down", changed)
    assert frame.pixels.shape == (240, 320, 3)
    assert frame.is_break
    # The pad is grey; the land around it is green.
    blue, green, red = (int(value) for value in frame.pixels[150:160, 140:150].reshape(-1, 3).mean(axis=0))
    assert max(blue, green, red) - min(blue, green, red) < 20


def test_a_camera_through_opencv_gives_its_newest_picture_once(tmp_path: Path) -> None:
    device = tmp_path / "video0"
    device.touch()
    capture = FakeCapture()
    changed = threading.Event()
    source = V4l2Source("v4l2:test", str(device), Mode(), lambda device: capture)
    cameras = Cameras({"front": source}, on_change=changed.set)
    assert cameras.get_frames() == {}
    cameras.start()
    try:
        first = wait_for_frame(cameras, "front", changed)
        assert first.is_break
        assert first.pixels.shape == (48, 64, 3)
        later = wait_for_frame(cameras, "front", changed, first.number)
        assert later.taken_s > first.taken_s
        assert not later.is_break
        assert cameras.states()["front"][0] is CameraState.LIVE
    finally:
        assert cameras.stop()
    assert capture.released


def test_a_camera_that_is_absent_does_not_hold_up_another(simulated: str, tmp_path: Path) -> None:
    with closing(listen(CameraEndpoint("127.0.0.1", 0))) as nobody:
        port = nobody.getsockname()[1]
    specs = {"down": simulated, "gone": f"v4l2:{tmp_path}/none", "refused": f"http://127.0.0.1:{port}/camera"}
    changed = threading.Event()
    with Cameras.open(specs, on_change=changed.set) as cameras:
        first = wait_for_frame(cameras, "down", changed)
        assert wait_for_frame(cameras, "down", changed, first.number).number > first.number
        while not all(cameras.states()[name][1] for name in ("gone", "refused")):
            changed.clear()
            assert changed.wait(DEADLINE_S), cameras.states()
        assert set(cameras.get_frames()) <= {"down"}


def test_what_names_no_camera_is_refused() -> None:
    with pytest.raises(Unusable):
        Cameras.open({"down": "telepathy:0"})
