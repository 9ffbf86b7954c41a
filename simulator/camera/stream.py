"""One viewer's pictures, drawn when they are due and the last one has been sent: nothing waits in a queue.

Each part of the response ends with the boundary of the next one, so that a viewer knows at once that a picture is
complete.
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
"""The longest time that a stalled reader keeps a thread from noticing that the camera is gone."""
SEND_BUFFER_BYTES = 64 * 1024


class Lens(Protocol):
    """Draws the camera's present view, without texts."""

    def draw(self, wanted: Wanted) -> Picture: ...


def encode(picture: Picture, wanted: Wanted) -> tuple[int, bytes]:
    """Draws the texts and, last of all, the clock strip; returns the time of that in microseconds of Unix time, and the
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
    """Sends each picture at once, and keeps the send buffer of this machine small."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
    lowat = getattr(socket, "TCP_NOTSENT_LOWAT", None)
    if lowat is not None:
        connection.setsockopt(socket.IPPROTO_TCP, lowat, 1)
    connection.settimeout(None)


def send_pictures(connection: socket.socket, lens: Lens, wanted: Wanted, is_gone: Callable[[], bool]) -> None:
    """Runs until the camera is gone or the viewer disconnects (OSError)."""
    connection.sendall(HEAD)
    period_s = 1.0 / wanted.rate
    due_s = time.monotonic()
    while not is_gone():
        if not _has_left(connection):
            continue
        now_s = time.monotonic()
        if now_s < due_s:
            time.sleep(due_s - now_s)
        # A picture that could not be drawn in time is skipped; the others keep their schedule.
        due_s += period_s * max(1, int((time.monotonic() - due_s) / period_s) + 1)
        drawn_us, jpeg = encode(lens.draw(wanted), wanted)
        connection.sendall(part_of(jpeg, drawn_us))


def _has_left(connection: socket.socket) -> bool:
    """Waits a limited time; returns whether the last picture has left completely."""
    _, writable, _ = select.select([], [connection], [], CHECK_AGAIN_S)
    return bool(writable)
