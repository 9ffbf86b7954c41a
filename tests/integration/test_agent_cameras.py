"""Cameras as the agent meets them: over the network, as a child process, in a file. In time, and back after a loss."""

import contextlib
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from worlds.moving_pictures import flight, off_by

from onboard_agent.video.encoders.choice import make_encoder
from onboard_agent.video.encoders.encoder import EncodedPicture
from onboard_agent.video.sources.camera import Camera
from onboard_agent.video.sources.schemes import make_source
from onboard_agent.video.sources.source import CameraLost, Picture, PictureRequest, Taken, now_us
from wire.video import CameraState, Codec, Quality

DEADLINE_S = 20.0
WIDTH, HEIGHT = 160, 128
BITS = 16


def numbered(number: int) -> np.ndarray:
    """A picture that says which one it is: a strip of cells above, noise below."""
    picture = np.random.default_rng(0).integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    for bit in range(BITS):
        picture[:32, bit * 10 : bit * 10 + 10] = 230 if number >> bit & 1 else 20
    return picture


def number_of(frame: av.VideoFrame) -> int:
    grey = frame.to_ndarray(format="gray")
    return sum(int(grey[16, bit * 10 + 5] > 128) << bit for bit in range(BITS))


class HttpWorld:
    """An HTTP camera that gives a picture when the test says so."""

    def __init__(self, head: bytes, with_length: bool = True) -> None:
        self.head, self.with_length = head, with_length
        self.connected = threading.Semaphore(0)
        self.asked = b""
        self.sockets: list[socket.socket] = []
        self.count = 0
        self.listen(0)

    def listen(self, port: int) -> None:
        self.server = socket.create_server(("127.0.0.1", port))
        self.port = self.server.getsockname()[1]
        threading.Thread(target=self._accept, args=(self.server,), daemon=True).start()

    def _accept(self, server: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while True:
                line, _ = server.accept()
                self.sockets.append(line)
                with contextlib.suppress(OSError):  # who only wanted to see what comes may be gone again
                    self.asked = line.recv(4096)
                    line.sendall(self.head)
                self.connected.release()

    def wait(self) -> None:
        assert self.connected.acquire(timeout=DEADLINE_S)

    def give(self, headers: bytes = b"") -> tuple[int, int]:
        """Number and time of the picture that it has sent whole, and of the next one not a byte."""
        self.count += 1
        jpeg = cv2.imencode(".jpg", numbered(self.count))[1].tobytes()
        length = b"Content-Length: %d\r\n" % len(jpeg) if self.with_length else b""
        sent_us = now_us()
        part = b"--frame\r\nContent-Type: image/jpeg\r\n" + headers + length + b"\r\n" + jpeg
        self.sockets[-1].sendall(part)
        return self.count, sent_us

    def unplug(self) -> None:
        with contextlib.suppress(OSError):
            self.server.shutdown(socket.SHUT_RDWR)
        self.server.close()
        for line in self.sockets:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
            line.close()


MULTIPART = b"HTTP/1.%d 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=frame\r\n\r\n"


@pytest.fixture(params=[(True, 1), (False, 0)], ids=["length given, HTTP/1.1", "no length given, HTTP/1.0"])
def http_world(request: pytest.FixtureRequest) -> Iterator[HttpWorld]:
    with_length, version = request.param
    world = HttpWorld(MULTIPART % version, with_length)
    yield world
    world.unplug()


def next_taken(read: Callable[[], Taken | None]) -> Taken:
    deadline = time.monotonic() + DEADLINE_S
    while time.monotonic() < deadline:
        taken = read()
        if taken is not None:
            return taken
    raise AssertionError("no picture comes")


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
    assert len(numbers) < 4  # they came together, and were not decoded one by one
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


class Watched:
    """A camera of the agent's, and how the test waits for it."""

    def __init__(self, spec: str) -> None:
        self.changes = threading.Semaphore(0)
        self.camera = Camera(make_source(spec), PictureRequest(WIDTH, HEIGHT, 30.0), self.changes.release)
        self.camera.start()

    def until(self, there: Callable[[], object]) -> None:
        deadline = time.monotonic() + DEADLINE_S
        while not there():
            assert self.changes.acquire(timeout=max(deadline - time.monotonic(), 0.01)), self.camera.words

    def picture(self) -> Picture:
        found: list[Picture] = []
        self.until(lambda: found.extend(filter(None, [self.camera.newest()])) or found)
        return found[0]


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


def test_unplugged_it_is_said_at_once_and_comes_back_with_a_key_picture(http_world: HttpWorld) -> None:
    watched = Watched(f"http://127.0.0.1:{http_world.port}/")
    http_world.wait()
    encoder = make_encoder(Codec.MPEG1, Quality.LOW)

    def unit() -> EncodedPicture:
        http_world.give()
        (coded,) = encoder.encode(watched.picture())
        return coded

    assert [unit()[1:6:4] for _ in range(3)] == [(True, True), (False, False), (False, False)]  # key, break
    unplugged_at = time.monotonic()
    http_world.unplug()
    watched.until(lambda: watched.camera.state is CameraState.LOST)
    assert time.monotonic() - unplugged_at < 1.0
    watched.until(lambda: "Connection refused" in watched.camera.words)
    http_world.listen(http_world.port)
    http_world.wait()
    assert [unit()[1:6:4] for _ in range(2)] == [(True, True), (False, False)]
    assert watched.camera.state is CameraState.LIVE
    assert watched.camera.stop()


@pytest.mark.parametrize("scheme", ["rtsp", "http"])
def test_a_camera_that_is_not_wanted_any_more_while_it_connects_is_let_go_and_hangs_in_nothing(scheme: str) -> None:
    """Its answer never comes. What cannot be let go ends the whole video process."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        watched = Watched(f"{scheme}://127.0.0.1:{server.getsockname()[1]}/main")
        server.settimeout(DEADLINE_S)
        line, _ = server.accept()
        assert line.recv(4096)
        began = time.monotonic()
        assert watched.camera.stop()
        assert scheme == "rtsp" or time.monotonic() - began < 2.0, "we make this connection ourselves"
        line.close()


def test_a_camera_that_falls_silent_is_said_within_a_second(http_world: HttpWorld) -> None:
    watched = Watched(f"http://127.0.0.1:{http_world.port}/")
    http_world.wait()
    http_world.give()
    watched.picture()
    silent_at = time.monotonic()
    watched.until(lambda: watched.camera.state is CameraState.LOST)
    assert time.monotonic() - silent_at < 1.0
    assert watched.camera.stop()


def film_of(count: int, path: Path, rate: int = 25) -> Path:
    with av.open(str(path), "w") as film:
        stream = film.add_stream("mpeg4", rate=rate)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.bit_rate = 2_000_000
        for number in range(count):
            film.mux(stream.encode(av.VideoFrame.from_ndarray(numbered(number), format="bgr24")))
        film.mux(stream.encode(None))
    return path


@pytest.mark.parametrize("name", ["film.mp4", "film.avi", "film.ts"])
def test_a_file_over_and_over_at_its_own_pace(tmp_path: Path, name: str) -> None:
    source = make_source(f"file:{film_of(10, tmp_path / name, rate=50)}")
    source.open(PictureRequest())
    taken = [next_taken(source.read) for _ in range(25)]
    source.close()
    assert [number_of(one.frame) for one in taken] == [*range(10), *range(10), *range(5)]
    apart_us = np.diff([one.capture_us for one in taken])
    assert np.median(apart_us) == pytest.approx(20_000, abs=10)
    assert abs(apart_us - 20_000).max() <= 1000 or max(apart_us) > 500_000  # unless this machine stood still


def test_an_http_camera_whose_pictures_are_too_large_is_lost_with_both_sizes_and_stays_so(
    http_world: HttpWorld,
) -> None:
    watched = Watched(f"http://127.0.0.1:{http_world.port}/")
    large = cv2.imencode(".jpg", np.zeros((8000, 8000), np.uint8))[1].tobytes()
    part = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(large) + large
    states = set()
    for _ in range(3):
        http_world.wait()
        with contextlib.suppress(OSError):  # it may have seen enough before all has been sent
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
        ("film.avi", "mjpeg", "its pictures cannot be decoded, or are too large: the most is"),  # FFmpeg says no size
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


RPICAM = """#!{python}
import os, sys, time
words = sys.argv[1:]
of = lambda name: words[words.index(name) + 1]
size = int(of("--width")) * int(of("--height"))
assert of("--codec") == "yuv420" and of("--output") == "-" and of("--timeout") == "0", words
if not os.path.exists({plugged!r}):
    print("Preview window unavailable", file=sys.stderr)
    sys.exit("ERROR: *** no cameras available ***")
number = 0
while os.path.exists({plugged!r}):
    number += 1
    os.write(1, b"") or sys.stdout.buffer.write(bytes([number % 200 + 20]) * size + bytes([128]) * (size // 2))
    sys.stdout.flush()
    time.sleep(1 / float(of("--framerate")))
sys.exit("ERROR: Device timeout detected, attempting a restart!!!")
"""


@pytest.fixture
def plugged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that stands for the ribbon cable; the program is found where the others are."""
    cable = tmp_path / "plugged"
    cable.touch()
    program = tmp_path / "rpicam-vid"
    program.write_text(RPICAM.format(python=sys.executable, plugged=str(cable)))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    return cable


def test_a_pi_camera_unplugged_and_back(plugged: Path) -> None:
    watched = Watched("pi:0?width=140&height=121&rate=40")
    first = watched.picture()
    assert (first.frame.width, first.frame.height, first.is_break) == (128, 120, True)
    luma = first.frame.to_ndarray()
    assert luma[:120].std() == 0
    assert (luma[120:] == 128).all()
    assert 0 <= now_us() - first.capture_us < 5_000_000
    plugged.unlink()
    watched.until(lambda: "ERROR: *** no cameras available ***" in watched.camera.words)
    assert watched.camera.state is CameraState.LOST
    while watched.camera.newest():
        pass
    plugged.touch()
    assert watched.picture().is_break
    assert watched.camera.stop()


def test_a_pi_without_its_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CameraLost, match="rpicam-vid is not installed"):
        make_source("pi:0").open(PictureRequest())


class RtspCamera:
    """An RTSP server for one listener: H.264 in RTP inside the RTSP connection, each picture when the test gives it."""

    def __init__(self, frames: list[av.VideoFrame]) -> None:
        self.frames, self.count, self.playing = frames, 0, threading.Event()
        self.encoder = make_encoder(Codec.H264, Quality.LOW)
        self.sequence = 0
        self.server = socket.create_server(("127.0.0.1", 0))
        self.address = f"rtsp://127.0.0.1:{self.server.getsockname()[1]}/main"
        self.thread = threading.Thread(target=self._talk, daemon=True)
        self.thread.start()

    def _talk(self) -> None:
        session = b"v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=x\r\nt=0 0\r\nm=video 0 RTP/AVP 96\r\n"
        session += b"a=rtpmap:96 H264/90000\r\na=fmtp:96 packetization-mode=1\r\na=control:track0\r\n"
        answers = {
            b"OPTIONS": b"Public: DESCRIBE, SETUP, PLAY, TEARDOWN\r\n\r\n",
            b"DESCRIBE": b"Content-Type: application/sdp\r\nContent-Length: %d\r\n\r\n" % len(session) + session,
            b"SETUP": b"Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\nSession: 7\r\n\r\n",
            b"PLAY": b"Session: 7\r\n\r\n",
        }
        with contextlib.suppress(OSError):
            self.line, _ = self.server.accept()
            asked = self.line.makefile("rb")
            while request := asked.readline():
                number = b""
                while (line := asked.readline()) not in (b"\r\n", b""):
                    if line.lower().startswith(b"cseq:"):
                        number = line.strip()
                method = request.split()[0]
                self.line.sendall(b"RTSP/1.0 200 OK\r\n" + number + b"\r\n" + answers.get(method, b"\r\n"))
                if method == b"PLAY":
                    self.playing.set()

    def give(self) -> int:
        """When it was sent; the picture is the next of `frames`."""
        at_us = (self.count + 1) * 40_000
        picture = Picture(self.frames[self.count], at_us, self.count + 1, self.count == 0)
        (coded,) = self.encoder.encode(picture)
        self.count += 1
        units = [unit.rstrip(b"\0") for unit in coded.payload.split(b"\0\0\1") if unit.strip(b"\0")]
        sent_us = now_us()
        for unit in units:
            last = 0x80 if unit is units[-1] else 0
            self.sequence += 1
            packet = bytes([0x80, 96 | last]) + self.sequence.to_bytes(2) + (at_us * 9 // 100).to_bytes(4) + b"same"
            self.line.sendall(b"$\0" + (len(packet) + len(unit)).to_bytes(2) + packet + unit)
        return sent_us

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self.line.shutdown(socket.SHUT_RDWR)
        self.thread.join(DEADLINE_S)
        self.line.close()
        self.server.close()


def test_an_rtsp_picture_comes_with_the_next_one_and_that_counts_as_its_age() -> None:
    frames = flight(WIDTH, HEIGHT, 60)
    camera = RtspCamera(frames)
    source = make_source(camera.address)
    opening = threading.Thread(target=source.open, args=(PictureRequest(),), daemon=True)
    opening.start()
    assert camera.playing.wait(DEADLINE_S)
    while opening.is_alive():  # it looks at a few pictures to see what they are
        camera.give()
        opening.join(0.04)
    for _ in range(camera.count - 1):
        next_taken(source.read)
    later_than_next_us = []
    for number in range(camera.count - 1, camera.count + 19):
        next_sent_us = camera.give()
        taken = next_taken(source.read)
        later_than_next_us.append(taken.capture_us - next_sent_us)
        off = [off_by(taken.frame, frames[other]) for other in (number - 1, number, number + 1)]
        assert min(off) == off[1]
    assert min(later_than_next_us) < 0  # not when it was handed on
    source.close()
    camera.close()
