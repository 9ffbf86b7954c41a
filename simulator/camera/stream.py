"""One viewer's pictures, drawn when they are due and when the last one has left: nothing waits in a queue.

Each part of the answer ends with the boundary of the next one, so that nobody has to wait for the next picture to
know that this one is whole.
"""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.clock_strip import draw_strip
from simulator.camera.overlay import draw_texts
from simulator.camera.request import Wanted

Picture = npt.NDArray[np.uint8]

BOUNDARY = "picture"
HEAD = (
    "HTTP/1.1 200 OK\r\n"
    f"Content-Type: multipart/x-mixed-replace; boundary={BOUNDARY}\r\n"
    "Cache-Control: no-store\r\n"
    "Connection: close\r\n"
    "\r\n"
    f"--{BOUNDARY}\r\n"
).encode()
CHECK_AGAIN_S = 0.5
"""How long a reader that does not read keeps a thread from seeing that the camera is gone, at most."""
SEND_BUFFER_BYTES = 64 * 1024


class Lens(Protocol):
    """Draws what is before the camera now, without its texts."""

    def draw(self, wanted: Wanted) -> Picture: ...


def encode(picture: Picture, wanted: Wanted) -> tuple[int, bytes]:
    """Writes the texts and, last of all, the clock strip; the moment of that in microseconds of Unix time, and the
    JPEG."""
    draw_texts(picture, wanted.name, time.time_ns() // 1000)
    drawn_us = time.time_ns() // 1000
    draw_strip(picture, drawn_us // 1000)
    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, wanted.quality])
    return drawn_us, jpeg.tobytes()


def part_of(jpeg: bytes, drawn_us: int) -> bytes:
    head = f"Content-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\nX-Capture-Unix-Us: {drawn_us}\r\n\r\n"
    return b"".join((head.encode(), jpeg, f"\r\n--{BOUNDARY}\r\n".encode()))


def prepare(connection: socket.socket) -> None:
    """Each picture leaves at once, and a little of it only waits in this machine."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
    lowat = getattr(socket, "TCP_NOTSENT_LOWAT", None)
    if lowat is not None:
        connection.setsockopt(socket.IPPROTO_TCP, lowat, 1)
    connection.settimeout(None)


def send_pictures(connection: socket.socket, lens: Lens, wanted: Wanted, is_gone: Callable[[], bool]) -> None:
    """Until the camera is gone or the viewer hangs up (OSError)."""
    connection.sendall(HEAD)
    period_s = 1.0 / wanted.rate
    due_s = time.monotonic()
    while not is_gone():
        if not _has_left(connection):
            continue
        now_s = time.monotonic()
        if now_s < due_s:
            time.sleep(due_s - now_s)
        # A picture that could not be drawn in time is left out; the others keep their places.
        due_s += period_s * max(1, int((time.monotonic() - due_s) / period_s) + 1)
        drawn_us, jpeg = encode(lens.draw(wanted), wanted)
        connection.sendall(part_of(jpeg, drawn_us))


def _has_left(connection: socket.socket) -> bool:
    """Whether the last picture is on its way as a whole. Waits for it, but not for ever."""
    _, writable, _ = select.select([], [connection], [], CHECK_AGAIN_S)
    return bool(writable)
