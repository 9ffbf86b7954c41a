"""RealSense sources on a recording that the library plays: pixels, distances, times, unplugged and back."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyrealsense2")  # it has no wheel for ARM

from worlds.realsense_recording import FRAMES, HEIGHT_PX, WIDTH_PX, colour_pixels, depth_counts, infrared_pixels, record

from onboard_agent.autonomy.camera_settings import parse_cameras
from onboard_agent.autonomy.cameras import ControllerCameras, Frame
from onboard_agent.video.sources import realsense
from onboard_agent.video.sources.camera import Camera
from onboard_agent.video.sources.depth import metres
from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.realsense_device import RealsenseDevice
from onboard_agent.video.sources.realsense_pipeline import RealsensePipeline
from onboard_agent.video.sources.realsense_streams import Stream, Where
from onboard_agent.video.sources.source import PictureRequest
from wire.video import CameraState

DEADLINE_S = 60.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("realsense") / "made.db3"
    record(path)
    return path


def frames_of_all(cameras: ControllerCameras) -> dict[str, Frame]:
    found: dict[str, Frame] = {}
    deadline = time.monotonic() + DEADLINE_S
    while len(found) < len(cameras.settings):
        assert time.monotonic() < deadline, (found.keys(), cameras.problems())
        found |= cameras.get_frames(0.2)
    return found


def test_colour_infrared_and_depth_of_one_device(recording: Path) -> None:
    """What a controller gets; all four cameras share one pipeline."""
    kinds = {"colour": "colour", "infrared": "infrared", "depth": "depth", "aligned": "depth"}
    cameras = ControllerCameras(
        parse_cameras([f"{name},kind={kind} realsense:{name}:{recording}" for name, kind in kinds.items()])
    )
    before_s = time.monotonic()
    found = frames_of_all(cameras)
    after_s = time.monotonic()
    for source in cameras._sources.values():  # type: ignore[union-attr]
        assert source.stop()
    assert cameras.problems() == {}

    number = next(one for one in range(FRAMES) if infrared_pixels(one)[0, 0] == found["infrared"].pixels[0, 0])
    assert (found["infrared"].pixels == infrared_pixels(number)).all()
    assert found["colour"].pixels.shape == (HEIGHT_PX, WIDTH_PX, 3)
    colours = [colour_pixels(one)[0, 0, ::-1] for one in range(FRAMES)]
    assert any((found["colour"].pixels == one).all() for one in colours)

    distance_m = metres(found["depth"].pixels)
    expected_m = depth_counts(0)[1:-1] * 0.0005
    assert np.isnan(distance_m[0]).all()
    assert np.abs(distance_m[1:-1] - expected_m).max() <= 0.00051  # rounded to a millimetre
    assert any(found["depth"].pixels[-1, 0] == one + 1 for one in range(FRAMES))

    # 2 m away the colour lens sees it 64 px * 0.02 m / 2 m = 0.6 px further left.
    aligned_m = metres(found["aligned"].pixels)
    assert aligned_m.shape == (HEIGHT_PX, WIDTH_PX)
    middle = aligned_m[10:40, 10:50]
    assert np.nanmax(np.abs(middle - np.tile(expected_m[0, 10:50], (30, 1)))) <= 0.06
    assert np.nanmean(middle - expected_m[0, 10:50]) > 0.005  # moved, and not a copy

    for frame in found.values():  # a device's clock is compared with ours by what came with the least delay
        assert before_s - 1.0 <= frame.taken_s <= after_s


class Unpluggable(RealsensePipeline):
    """Of a device whose cable a test can pull."""

    pulled = threading.Event()

    def __init__(self, where: Where, modes: Mapping[Stream, Mode]) -> None:
        if self.pulled.is_set():
            raise RuntimeError("No device connected")
        super().__init__(where, modes)

    def frames(self, timeout_ms: int, *, is_aligned: bool) -> Mapping[Stream, object] | None:
        if self.pulled.is_set():
            raise RuntimeError("Device disconnected")
        return super().frames(timeout_ms, is_aligned=is_aligned)


def test_unplugged_it_is_lost_with_words_and_comes_back(recording: Path) -> None:
    where = Where(recording=str(recording))
    device = RealsenseDevice(lambda modes: Unpluggable(where, modes))
    changed = threading.Event()
    cameras = [
        Camera(
            realsense.RealsenseSource(f"realsense:{stream}", stream, where, Mode(), device),
            PictureRequest(),
            changed.set,
        )
        for stream in (Stream.DEPTH, Stream.INFRARED)
    ]

    def until(state: CameraState, words: str) -> None:
        deadline = time.monotonic() + DEADLINE_S
        while not all(one.state is state and one.words.endswith(words) for one in cameras):
            changed.clear()
            assert time.monotonic() < deadline, [(one.state, one.words) for one in cameras]
            changed.wait(0.1)

    for one in cameras:
        one.start()
    try:
        until(CameraState.LIVE, "")
        assert all(one.newest() is not None for one in cameras)
        Unpluggable.pulled.set()
        until(CameraState.LOST, "No device connected")
        assert cameras[0].words == "realsense:depth: No device connected"
        for one in cameras:
            one.newest()
        Unpluggable.pulled.clear()
        until(CameraState.LIVE, "")
        for one in cameras:
            picture = one.newest()
            assert picture is not None and picture.is_break
    finally:
        Unpluggable.pulled.clear()
        stopped = [one.stop() for one in cameras]
        assert all(stopped)
    assert device._thread is None


def test_what_is_not_there_is_said(recording: Path) -> None:
    for spec, words in (
        (f"realsense:depth:{recording}.missing.db3", "there is no file"),
        (f"realsense:infrared2:{recording}", "Couldn't resolve requests"),
    ):
        cameras = ControllerCameras(parse_cameras([f"eye {spec}"]))
        deadline = time.monotonic() + DEADLINE_S
        while words not in cameras.problems().get("eye", ""):
            assert time.monotonic() < deadline, cameras.problems()
            assert cameras.get_frames(0.1) == {}
        assert cameras._sources is not None
        assert cameras._sources["eye"].stop()
