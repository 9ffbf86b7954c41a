"""A film in a file as a camera: its frame rate, sizes and refusals."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from camera_world import MULTIPART, HttpWorld, Watched, film_of, next_taken, number_of

from onboard_agent.video.sources.schemes import make_source
from onboard_agent.video.sources.source import CameraLost, PictureRequest
from wire.video import CameraState


@pytest.fixture(params=[(True, 1), (False, 0)], ids=["length given, HTTP/1.1", "no length given, HTTP/1.0"])
def http_world(request: pytest.FixtureRequest) -> Iterator[HttpWorld]:
    with_length, version = request.param
    world = HttpWorld(MULTIPART % version, with_length)
    yield world
    world.unplug()


@pytest.mark.parametrize("name", ["film.mp4", "film.avi", "film.ts"])
def test_a_file_over_and_over_at_its_own_pace(tmp_path: Path, name: str) -> None:
    source = make_source(f"file:{film_of(10, tmp_path / name, rate=50)}")
    source.open(PictureRequest())
    taken = [next_taken(source.read) for _ in range(25)]
    source.close()
    assert [number_of(one.frame) for one in taken] == [*range(10), *range(10), *range(5)]
    apart_us = np.diff([one.capture_us for one in taken])
    assert np.median(apart_us) == pytest.approx(20_000, abs=10)
    assert abs(apart_us - 20_000).max() <= 1000 or max(apart_us) > 500_000  # unless this machine stalled


def test_an_http_camera_whose_pictures_are_too_large_is_lost_with_both_sizes_and_stays_so(
    http_world: HttpWorld,
) -> None:
    watched = Watched(f"http://127.0.0.1:{http_world.port}/")
    large = cv2.imencode(".jpg", np.zeros((8000, 8000), np.uint8))[1].tobytes()
    part = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(large) + large
    states = set()
    for _ in range(3):
        http_world.wait()
        with contextlib.suppress(OSError):  # the probe may end before everything is sent
            http_world.sockets[-1].sendall(part)
        watched.until(lambda: "8000 x 8000 pixels are too large, the most is 9.4 million" in watched.camera.words)
        states.add(watched.camera.state)
    assert states == {CameraState.LOST}
    assert watched.camera.newest() is None
    assert watched.camera.stop()


@pytest.mark.parametrize(
    ("name", "codec", "words"),
    [
        ("film.mp4", "libx264", "pictures of 4096 x 2320 pixels are too large, the most is"),
        ("film.avi", "mjpeg", "its pictures cannot be decoded, or are too large: the most is"),  # FFmpeg gives no size
    ],
)
def test_a_film_whose_pictures_are_too_large(tmp_path: Path, name: str, codec: str, words: str) -> None:
    with av.open(str(tmp_path / name), "w") as film:
        stream = film.add_stream(codec, rate=25)
        stream.width, stream.height = 4096, 2320
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        film.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((3480, 4096), np.uint8), format=stream.pix_fmt)))
        film.mux(stream.encode(None))
    source = make_source(f"file:{tmp_path}/{name}")
    with pytest.raises(CameraLost, match=f"{name}: {words} 9.4 million"):
        source.open(PictureRequest())
        source.read()
    source.close()


def test_a_file_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(CameraLost, match="No such file"):
        make_source(f"file:{tmp_path / 'nothing.mp4'}").open(PictureRequest())
    (tmp_path / "text.mp4").write_text("no film")
    with pytest.raises(CameraLost, match="Invalid data"):
        make_source(f"file:{tmp_path / 'text.mp4'}").open(PictureRequest())
