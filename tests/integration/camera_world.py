"""Cameras for tests: numbered pictures, and a camera that serves them over HTTP."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path

import av
import cv2
import numpy as np

from onboard_agent.video.sources.camera import Camera
from onboard_agent.video.sources.schemes import make_source
from onboard_agent.video.sources.source import Picture, PictureRequest, Taken, now_us

DEADLINE_S = 60.0

WIDTH, HEIGHT = 160, 128

BITS = 16


def numbered(number: int) -> np.ndarray:
    """Returns a picture that shows its number: a strip of cells above, noise below."""
    picture = np.random.default_rng(0).integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    for bit in range(BITS):
        picture[:32, bit * 10 : bit * 10 + 10] = 230 if number >> bit & 1 else 20
    return picture


def number_of(frame: av.VideoFrame) -> int:
    grey = frame.to_ndarray(format="gray")
    return sum(int(grey[16, bit * 10 + 5] > 128) << bit for bit in range(BITS))


class HttpWorld:
    """An HTTP camera that sends a picture when the test says so."""

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
        self._accepting = threading.Thread(target=self._accept, args=(self.server,), daemon=True)
        self._accepting.start()

    def _accept(self, server: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while True:
                line, _ = server.accept()
                self.sockets.append(line)
                with contextlib.suppress(OSError):  # a client that only probes may have disconnected
                    self.asked = line.recv(4096)
                    line.sendall(self.head)
                self.connected.release()

    def wait(self) -> None:
        assert self.connected.acquire(timeout=DEADLINE_S)

    def give(self, headers: bytes = b"") -> tuple[int, int]:
        """Sends one whole picture and no byte of the next. Returns its number and time."""
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
        while self._accepting.is_alive():  # it may just have taken another line, and wait there
            for line in self.sockets:
                with contextlib.suppress(OSError):
                    line.shutdown(socket.SHUT_RDWR)
            self._accepting.join(0.02)
        for line in self.sockets:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
            line.close()


MULTIPART = b"HTTP/1.%d 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=frame\r\n\r\n"


def next_taken(read: Callable[[], Taken | None]) -> Taken:
    deadline = time.monotonic() + DEADLINE_S
    while time.monotonic() < deadline:
        taken = read()
        if taken is not None:
            return taken
    raise AssertionError("no picture comes")


class Watched:
    """One of the agent's cameras, with the waits that a test needs."""

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


def film_of(count: int, path: Path, rate: int = 25) -> Path:
    with av.open(str(path), "w") as film:
        stream = film.add_stream("mpeg4", rate=rate)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.bit_rate = 2_000_000
        for number in range(count):
            film.mux(stream.encode(av.VideoFrame.from_ndarray(numbered(number), format="bgr24")))
        film.mux(stream.encode(None))
    return path
