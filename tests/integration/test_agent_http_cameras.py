"""HTTP cameras as the agent handles them: which picture it takes, refusals, silence, and the return after a loss."""

import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from camera_world import DEADLINE_S, HEIGHT, MULTIPART, WIDTH, HttpWorld, Watched, film_of, next_taken, number_of

from onboard_agent.video.encoders.choice import make_encoder
from onboard_agent.video.encoders.encoder import EncodedPicture
from onboard_agent.video.sources.schemes import make_source
from onboard_agent.video.sources.source import CameraLost, PictureRequest, now_us
from wire.video import CameraState, Codec, Quality


@pytest.fixture(params=[(True, 1), (False, 0)], ids=["length given, HTTP/1.1", "no length given, HTTP/1.0"])
def http_world(request: pytest.FixtureRequest) -> Iterator[HttpWorld]:
    with_length, version = request.param
    world = HttpWorld(MULTIPART % version, with_length)
    yield world
    world.unplug()


def test_an_http_picture_is_there_without_the_next_one(http_world: HttpWorld) -> None:
    source = make_source(f"http://127.0.0.1:{http_world.port}/camera?width=160")
    source.open(PictureRequest())
    http_world.wait()
    assert http_world.asked.startswith(b"GET /camera?width=160 HTTP/1.1\r\n")
    for _ in range(5):
        number, sent_us = http_world.give()
        taken = next_taken(source.read)
        assert number_of(taken.frame) == number
        assert sent_us <= taken.capture_us <= now_us()
    source.close()


def test_of_http_pictures_that_wait_the_newest(http_world: HttpWorld) -> None:
    source = make_source(f"http://127.0.0.1:{http_world.port}/")
    source.open(PictureRequest())
    http_world.wait()
    last = [http_world.give() for _ in range(4)][-1][0]
    numbers = []
    while not numbers or numbers[-1] != last:
        numbers.append(number_of(next_taken(source.read).frame))
    assert len(numbers) < 4  # they arrived together and were not decoded one by one
    source.close()


def test_a_password_is_sent_and_not_shown(http_world: HttpWorld) -> None:
    source = make_source(f"http://pilot:s%40cret@127.0.0.1:{http_world.port}/")
    source.open(PictureRequest())
    http_world.wait()
    assert b"Authorization: Basic cGlsb3Q6c0BjcmV0\r\n" in http_world.asked
    http_world.unplug()
    with pytest.raises(CameraLost) as found:
        next_taken(source.read)
    assert str(found.value) == f"http://...@127.0.0.1:{http_world.port}/: has closed the connection"
    source.close()


def test_an_http_camera_that_is_not_there(http_world: HttpWorld) -> None:
    http_world.unplug()
    with pytest.raises(CameraLost, match="Connection refused"):
        make_source(f"http://127.0.0.1:{http_world.port}/").open(PictureRequest())


@pytest.mark.parametrize("status", ["404 Not Found", "503 Busy"])
def test_an_http_camera_that_refuses(status: str) -> None:
    world = HttpWorld(f"HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n".encode())
    source = make_source(f"http://127.0.0.1:{world.port}/")
    with pytest.raises(CameraLost, match=f"answers {status}"):
        source.open(PictureRequest())
    source.close()
    world.unplug()


def test_what_is_no_row_of_jpegs_is_left_to_ffmpeg(tmp_path: Path) -> None:
    film = film_of(10, tmp_path / "film.ts").read_bytes()
    head = b"HTTP/1.1 200 OK\r\nContent-Type: video/mp2t\r\nContent-Length: %d\r\n\r\n" % len(film)
    world = HttpWorld(head + film)
    source = make_source(f"http://127.0.0.1:{world.port}/film.ts")
    source.open(PictureRequest())
    taken = next_taken(source.read)
    assert (taken.frame.width, taken.frame.height) == (WIDTH, HEIGHT)
    source.close()
    world.unplug()


def test_what_a_camera_answers_is_fit_to_be_shown() -> None:
    world = HttpWorld(b"\x1b[31m\x00\xff" + b"!" * 500 + b"\r\n\r\n")
    watched = Watched(f"http://127.0.0.1:{world.port}/live?user=pilot&pwd=s3cret")
    watched.until(lambda: watched.camera.state is CameraState.LOST and watched.camera.words)
    words = watched.camera.words
    assert words.startswith(f"http://127.0.0.1:{world.port}/live?...: ?[31m?")
    assert words.isprintable()
    assert len(words) <= 160
    watched.camera.stop()
    world.unplug()


def test_unplugged_it_is_said_and_comes_back_with_a_key_picture(http_world: HttpWorld) -> None:
    watched = Watched(f"http://127.0.0.1:{http_world.port}/")
    http_world.wait()
    encoder = make_encoder(Codec.MPEG1, Quality.LOW)

    def unit() -> EncodedPicture:
        http_world.give()
        (coded,) = encoder.encode(watched.picture())
        return coded

    assert [unit()[1:6:4] for _ in range(3)] == [(True, True), (False, False), (False, False)]  # key, break
    http_world.unplug()
    watched.until(lambda: watched.camera.state is CameraState.LOST)
    watched.until(lambda: "Connection refused" in watched.camera.words)
    http_world.listen(http_world.port)
    http_world.wait()
    assert [unit()[1:6:4] for _ in range(2)] == [(True, True), (False, False)]
    assert watched.camera.state is CameraState.LIVE
    assert watched.camera.stop()


@pytest.mark.parametrize("scheme", ["rtsp", "http"])
def test_a_camera_that_is_not_wanted_any_more_while_it_connects_is_let_go_and_hangs_in_nothing(scheme: str) -> None:
    """The camera never responds. If its connection cannot be released, the whole video process ends."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        watched = Watched(f"{scheme}://127.0.0.1:{server.getsockname()[1]}/main")
        server.settimeout(DEADLINE_S)
        line, _ = server.accept()
        assert line.recv(4096)
        began = time.monotonic()
        assert watched.camera.stop()
        assert scheme == "rtsp" or time.monotonic() - began < 2.0, "we make this connection ourselves"
        line.close()


def test_a_camera_that_falls_silent_is_said(http_world: HttpWorld) -> None:
    watched = Watched(f"http://127.0.0.1:{http_world.port}/")
    http_world.wait()
    http_world.give()
    watched.picture()
    watched.until(lambda: watched.camera.state is CameraState.LOST)
    assert watched.camera.stop()
