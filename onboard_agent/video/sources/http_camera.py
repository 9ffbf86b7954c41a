"""MJPEG over HTTP without FFmpeg: a picture as soon as its last byte arrives, timed by the arrival of its first byte.

FFmpeg handles every other format, and authentication other than a password in the clear (network.py).

http.client rather than httpx, because `read1` returns what has arrived, and `interrupt` shuts the socket down from
another thread. httpx exposes neither. Its memory and start-up time: onboard_agent/link/enrolment.py.
"""

import base64
import contextlib
import http.client
import socket
import ssl
import time
from typing import Final
from urllib.parse import unquote, urlsplit

from onboard_agent.video.sources.arrival_clock import ArrivalClock
from onboard_agent.video.sources.decoding import JpegDecoder
from onboard_agent.video.sources.multipart import Malformed, MultipartPictures, Part
from onboard_agent.video.sources.network import NetworkSource
from onboard_agent.video.sources.picture_size import TooLarge
from onboard_agent.video.sources.source import (
    NETWORK_LETS_GO_WITHIN_S,
    OPEN_PATIENCE_S,
    READ_PATIENCE_S,
    CameraLost,
    PictureRequest,
    Source,
    Taken,
    now_us,
)

_READ_BYTES: Final = 256 * 1024
_NOT_FOUND: Final = 404


class HttpCamera(Source):
    """`http` and `https`."""

    lets_go_within_s = NETWORK_LETS_GO_WITHIN_S

    def __init__(self, name: str, address: str) -> None:
        super().__init__(name)
        self._address = address
        self._by_ffmpeg: NetworkSource | None = None
        self._connection: http.client.HTTPConnection | None = None
        self._answer: http.client.HTTPResponse | None = None
        self._socket: socket.socket | None = None
        """Socket of the connection, which drops its reference if the server announces to close it."""
        self._parts = MultipartPictures()
        self._decoder = JpegDecoder()
        self._clock = ArrivalClock()
        self._whole_at = 0.0
        self._interrupted = False

    def open(self, picture_request: PictureRequest) -> None:
        try:
            self._connection = self._ask()
            self._socket = self._connection.sock
            self._go_on()
            self._answer = self._connection.getresponse()
            self._socket.settimeout(READ_PATIENCE_S)
        except ssl.SSLCertVerificationError as error:
            raise CameraLost(f"{self.name}: its certificate is not trusted ({error.verify_message})") from None
        except (OSError, http.client.HTTPException) as error:
            raise CameraLost(f"{self.name}: {_words(error)}") from None
        if self._answer.status == _NOT_FOUND or self._answer.status >= http.client.INTERNAL_SERVER_ERROR:
            raise CameraLost(f"{self.name}: answers {self._answer.status} {self._answer.reason}")
        kind = self._answer.headers.get_content_type()
        if self._answer.status == http.client.OK and kind.startswith("multipart/"):
            self._parts, self._decoder, self._clock = MultipartPictures(), JpegDecoder(), ArrivalClock()
            self._whole_at = time.monotonic()
            return
        self.close()
        self._go_on()
        source = NetworkSource(self.name, self._address)
        source.open(picture_request)
        self._by_ffmpeg = source

    def read(self) -> Taken | None:
        if self._by_ffmpeg is not None:
            return self._by_ffmpeg.read()
        assert self._answer is not None
        try:
            data = self._answer.read1(_READ_BYTES)
            if not data:
                raise CameraLost(f"{self.name}: has closed the connection")
            taken = self._newest(self._parts.feed(data, now_us()))
        except (OSError, http.client.HTTPException) as error:
            raise CameraLost(f"{self.name}: {_words(error)}") from None
        except (Malformed, TooLarge) as error:
            raise CameraLost(f"{self.name}: {error}") from None
        now = time.monotonic()
        if taken is not None:
            self._whole_at = now
        elif now - self._whole_at > READ_PATIENCE_S:
            raise CameraLost(f"{self.name}: sends bytes, but no whole picture")
        return taken

    def close(self) -> None:
        if self._by_ffmpeg is not None:
            self._by_ffmpeg.close()
        if self._answer is not None:
            self._answer.close()
        if self._connection is not None:
            self._connection.close()
        self._by_ffmpeg = self._answer = self._connection = self._socket = None

    def interrupt(self) -> None:
        self._interrupted = True
        if self._socket is not None:
            with contextlib.suppress(OSError):  # it may be closed already
                self._socket.shutdown(socket.SHUT_RDWR)

    def _go_on(self) -> None:
        """Raises CameraLost after `interrupt`: each step may have used up its whole timeout."""
        if self._interrupted:
            raise CameraLost(f"{self.name}: is not wanted any more")

    def _ask(self) -> http.client.HTTPConnection:
        parts = urlsplit(self._address)
        assert parts.hostname is not None
        make = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
        connection = make(parts.hostname, parts.port, timeout=OPEN_PATIENCE_S)
        headers = {"Accept": "*/*"}
        if parts.username is not None:
            secret = f"{unquote(parts.username)}:{unquote(parts.password or '')}".encode()
            headers["Authorization"] = "Basic " + base64.b64encode(secret).decode()
        path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        connection.request("GET", path, headers=headers)
        return connection

    def _newest(self, parts: list[Part]) -> Taken | None:
        """Returns the last decodable picture: the others are outdated."""
        for part in reversed(parts):
            frame = self._decoder.decode(part.picture)
            if frame is not None:
                return Taken(frame, self._taken_us(part))
        return None

    def _taken_us(self, part: Part) -> int:
        """Uses the timestamp that mjpg-streamer and similar servers send, by their own clock."""
        try:
            stamp_us = int(float(part.headers["x-timestamp"]) * 1e6)
        except (KeyError, ValueError, OverflowError):
            return part.began_us
        return self._clock.taken_us(stamp_us, part.began_us)


def _words(error: Exception) -> str:
    if isinstance(error, TimeoutError):
        return "sends nothing"
    if isinstance(error, OSError):
        return error.strerror or str(error) or type(error).__name__
    return str(error) or type(error).__name__
