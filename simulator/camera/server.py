"""The camera on the network: a port that accepts viewers while the camera is plugged in, and a thread for each viewer.

It asks for the vehicle's pose for each picture, and is notified when the camera is plugged in or unplugged; it passes
on requests of viewers to unplug it.
"""

from __future__ import annotations

import logging
import select
import socket
import socketserver
import threading
from collections.abc import Callable
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler
from typing import cast

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.request import (
    CAMERA_PATH,
    UNPLUG_PATH,
    BadRequest,
    Wanted,
    read_unplugged_s,
    read_wanted,
)
from simulator.camera.scene import Scene
from simulator.camera.stream import prepare, send_pictures
from simulator.camera.view import Pose

MAX_VIEWERS = 16
BACKLOG = 16
AGAIN_S = 0.5
"""Retry interval for a port that another process has taken meanwhile."""
REQUEST_WITHIN_S = 10.0
END_WITHIN_S = 2.0

log = logging.getLogger("simulator")


@dataclass(frozen=True, slots=True)
class CameraEndpoint:
    host: str
    port: int

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}{CAMERA_PATH}"


def parse_camera(text: str) -> CameraEndpoint:
    """Parses `[HOST:]PORT`; without a host only this machine can connect."""
    host, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdecimal() and 0 < int(port) < 65536) or (":" in text and not host):
        raise ValueError(f"{text!r} is not [HOST:]PORT")
    return CameraEndpoint(host.strip("[]") or "127.0.0.1", int(port))


def listen(endpoint: CameraEndpoint) -> socket.socket:
    """Raises OSError if the port is not available."""
    family = socket.AF_INET6 if ":" in endpoint.host else socket.AF_INET
    return socket.create_server((endpoint.host, endpoint.port), family=family, backlog=BACKLOG)


class Camera:
    """The camera of one vehicle. `sight` returns its pose and the simulated seconds of that pose; `on_unplug` receives
    for how many simulated seconds a viewer wants it unplugged. `start` opens the port; `close` releases it and ends the
    threads."""

    def __init__(
        self,
        endpoint: CameraEndpoint,
        name: str,
        scene: Scene,
        *,
        sight: Callable[[], tuple[Pose, float]],
        on_unplug: Callable[[float], None],
    ) -> None:
        self.endpoint = endpoint
        self.name = name
        self.on_unplug = on_unplug
        self._scene = scene
        self._sight = sight
        self._plugged = True
        self._pulled = 0
        """How often it was unplugged: connections end even if it is plugged in again before a viewer notices."""
        self._closed = False
        self._listener: socket.socket | None = None
        self._wake_reader, self._wake_writer = socket.socketpair()
        self._viewers: dict[socket.socket, threading.Thread] = {}
        self._lock = threading.Lock()
        """Guards the viewers."""
        self._thread = threading.Thread(target=self._serve, name=f"camera of {name}", daemon=True)

    def start(self, listener: socket.socket | None = None) -> None:
        """Uses `listener` if the port is already open."""
        cv2.setNumThreads(1)  # the pictures are small, and the flight needs the other processors
        self._listener = listener
        self._thread.start()

    def close(self) -> None:
        self._closed = True
        self._wake()
        if self._thread.ident is not None:
            self._thread.join()
        self._wake_reader.close()
        self._wake_writer.close()

    def plug(self, plugged: bool) -> None:
        """Unplugging closes the viewers' connections, and the port refuses new ones."""
        if plugged is not self._plugged:
            self._plugged = plugged
            self._pulled += not plugged
            self._wake()

    # Called by the viewers' threads.

    def draw(self, wanted: Wanted) -> npt.NDArray[np.uint8]:
        pose, now_s = self._sight()
        return self._scene.draw(
            pose, wanted.width, wanted.height, tilt_deg=wanted.tilt, now_s=now_s, field_of_view_deg=wanted.fov
        )

    def is_gone(self) -> bool:
        return self._closed or not self._plugged

    def _attend(self, connection: socket.socket) -> None:
        try:
            connection.settimeout(REQUEST_WITHIN_S)
            _Handler(connection, connection.getpeername(), cast(socketserver.BaseServer, self))
        except OSError:
            pass  # the viewer or the camera is gone
        finally:
            with self._lock:
                self._viewers.pop(connection, None)
            connection.close()

    # The thread that has the port.

    def _wake(self) -> None:
        self._wake_writer.send(b"!")

    def _serve(self) -> None:
        pulled = 0
        while not self._closed:
            if pulled != self._pulled:
                pulled = self._pulled
                self._disconnect()
            if not self._plugged:
                self._sleep(None)
            elif self._listener is None:
                try:
                    self._listener = listen(self.endpoint)
                except OSError as error:
                    log.warning("the camera of %s cannot come back: %s", self.name, error)
                    self._sleep(AGAIN_S)
            else:
                self._sleep(None, self._listener)
        for thread in self._disconnect():
            thread.join(END_WITHIN_S)

    def _sleep(self, timeout_s: float | None, listener: socket.socket | None = None) -> None:
        """Waits for a wake-up, a connection (which it accepts), or the timeout."""
        readable, _, _ = select.select([self._wake_reader, *([listener] if listener else [])], [], [], timeout_s)
        if self._wake_reader in readable:
            self._wake_reader.recv(1024)
        elif listener is not None and listener in readable:
            self._accept(listener)

    def _accept(self, listener: socket.socket) -> None:
        try:
            connection, _ = listener.accept()
        except OSError:
            return
        thread = threading.Thread(target=self._attend, args=(connection,), name="viewer", daemon=True)
        with self._lock:
            if len(self._viewers) >= MAX_VIEWERS:
                connection.close()
                return
            self._viewers[connection] = thread
        thread.start()

    def _disconnect(self) -> list[threading.Thread]:
        """Closes the port and every connection. Returns the viewers' threads, which end soon."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        with self._lock:
            viewers = dict(self._viewers)
        for connection in viewers:
            try:
                connection.shutdown(socket.SHUT_RDWR)
            except OSError:
                continue  # it has ended by itself
        return list(viewers.values())


class _Handler(BaseHTTPRequestHandler):
    """One request: pictures until the viewer leaves, or a request to the camera."""

    protocol_version = "HTTP/1.1"
    server_version = "tower-sim"

    def do_GET(self) -> None:
        self.close_connection = True
        camera = cast(Camera, self.server)
        if self.path.partition("?")[0] != CAMERA_PATH:
            self._respond(404, f"The camera is at {CAMERA_PATH}")
            return
        try:
            wanted = read_wanted(self.path, camera.name)
        except BadRequest as error:
            self._respond(400, str(error))
            return
        prepare(self.connection)
        send_pictures(self.connection, camera, wanted, camera.is_gone)

    def do_POST(self) -> None:
        self.close_connection = True
        camera = cast(Camera, self.server)
        if self.path.partition("?")[0] != UNPLUG_PATH:
            self._respond(404, f"It is unplugged with POST {UNPLUG_PATH}?seconds=5")
            return
        try:
            seconds = read_unplugged_s(self.path)
        except BadRequest as error:
            self._respond(400, str(error))
            return
        self._respond(202, f"unplugged for {seconds:g} s")
        camera.on_unplug(seconds)

    def _respond(self, status: int, text: str) -> None:
        body = f"{text}\n".encode()
        self.send_response(status)
        self.send_header("Content-Type", "text/plain; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Suppresses the log: viewers come and go."""
