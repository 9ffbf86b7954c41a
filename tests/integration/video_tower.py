"""A tower that receives video: extends agent_fakes.FakeTower with a video channel that acknowledges each unit."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from typing import Any

import av
import cv2
import msgspec
import numpy as np
from agent_fakes import FakeTower, until
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import Opcode
from websockets.http11 import Request, Response

from wire.video import (
    VIDEO,
    CameraState,
    KeyWanted,
    StreamRequest,
    Unit,
    VideoState,
    VideoWanted,
    decode_unit,
    encode_got,
)
from wire.video import Got as GotUnit

VIDEO_PATH = "/api/v1/agent/video"
TICKET = "ticket-1"


class VideoTower(FakeTower):
    """`units`: each with its time of arrival. `answers` False: receives them without acknowledgement."""

    def __init__(self) -> None:
        super().__init__()
        self.takes = (VIDEO,)
        self.ticket = TICKET
        self.answers = True
        self.units: list[tuple[float, Unit]] = []
        self.refused = 0
        self.pings = 0
        self.channels: list[ServerConnection] = []

    def _sign_in(self, connection: ServerConnection, request: Request) -> Response | None:
        if request.path != VIDEO_PATH:
            return super()._sign_in(connection, request)
        if request.headers.get("Authorization") != f"Bearer {self.ticket}":
            self.refused += 1
            return connection.respond(401, "no\n")  # type: ignore[arg-type]
        return None

    async def _agent(self, connection: ServerConnection) -> None:
        assert connection.request is not None
        if connection.request.path != VIDEO_PATH:
            await super()._agent(connection)
            return
        self.channels.append(connection)
        process_event = connection.process_event

        def count_pings(event: Any) -> None:
            self.pings += event.opcode is Opcode.PING
            process_event(event)

        connection.process_event = count_pings  # type: ignore[method-assign]
        with contextlib.suppress(ConnectionClosed):
            async for message in connection:
                assert isinstance(message, bytes)
                unit = decode_unit(message)
                self.units.append((time.monotonic(), unit))
                if self.answers:
                    await connection.send(encode_got(GotUnit(unit.quality, unit.codec, unit.sequence)))

    async def watch(self, *streams: StreamRequest, ticket: str = TICKET) -> None:
        """Requests streams. None given: stop."""
        await self.announce(VideoWanted(ticket=ticket, streams=streams))

    async def ask_for_key(self, stream_request: StreamRequest) -> None:
        await self.channels[-1].send(
            msgspec.json.encode(KeyWanted(stream_request.quality, stream_request.codec)), text=True
        )

    def of(self, stream_request: StreamRequest, since: float = 0.0) -> list[Unit]:
        """Returns the units of one stream received since then."""
        return [
            unit for at, unit in self.units if at >= since and (unit.quality, unit.codec) == request_key(stream_request)
        ]

    async def more(self, stream_request: StreamRequest, count: int, timeout_s: float = 30.0) -> list[Unit]:
        """Returns the next `count` units of one stream."""
        since = time.monotonic()
        await until(
            lambda: len(self.of(stream_request, since)) >= count, timeout_s, f"{count} units of {stream_request}"
        )
        return self.of(stream_request, since)[:count]

    @property
    def camera_states(self) -> list[VideoState]:
        """Returns all camera states reported."""
        return [one for one in self.messages if isinstance(one, VideoState)]

    @property
    def camera(self) -> VideoState | None:
        """Returns the latest camera state."""
        return next((one for one in reversed(self.messages) if isinstance(one, VideoState)), None)

    async def camera_is(self, state: CameraState, timeout_s: float = 30.0) -> VideoState:
        found = await until(
            lambda: self.camera if self.camera is not None and self.camera.camera is state else None, timeout_s, state
        )
        assert isinstance(found, VideoState)
        return found


def request_key(stream_request: StreamRequest) -> tuple[Any, Any]:
    return stream_request.quality, stream_request.codec


@contextlib.asynccontextmanager
async def video_tower() -> AsyncIterator[VideoTower]:
    tower = VideoTower()
    await tower.start()
    try:
        yield tower
    finally:
        await tower.die()


def picture(number: int, width: int = 320, height: int = 240) -> Any:
    """Returns a moving picture: rgb24."""
    rows, columns = np.mgrid[0:height, 0:width]
    wave = 127 + 90 * np.sin((columns + 5 * number) / 17) * np.cos((rows - 3 * number) / 13)
    return np.repeat(wave.astype(np.uint8)[:, :, None], 3, axis=2)


def write_film(path: str, *, pictures: int = 50, rate_hz: int = 25) -> None:
    """Writes a short film of these pictures."""
    with av.open(path, "w") as container:
        stream = container.add_stream("mpeg4", rate=rate_hz)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        for number in range(pictures):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture(number), format="rgb24")))
        container.mux(stream.encode())


class MjpegCamera:
    """A network camera that can be unplugged: nothing listens on its port then."""

    def __init__(self) -> None:
        self.port = 0
        self._server: asyncio.Server | None = None
        self._writers: set[asyncio.StreamWriter] = set()
        self.opened = 0
        """Number of connections opened."""
        self._jpegs = [_jpeg(number) for number in range(8)]

    async def plug_in(self) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def unplug(self) -> None:
        assert self._server is not None
        self._server.close()
        for writer in self._writers:
            writer.transport.abort()
        await self._server.wait_closed()
        await until(lambda: not self._writers, what="nobody is served any more")

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.add(writer)
        self.opened += 1
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            await reader.readuntil(b"\r\n\r\n")
            writer.write(b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=next\r\n\r\n")
            number = 0
            while not writer.is_closing():
                jpeg = self._jpegs[number % len(self._jpegs)]
                number += 1
                head = f"--next\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
                writer.write(head.encode() + jpeg + b"\r\n")
                await writer.drain()
                await asyncio.sleep(1 / 25)
        self._writers.discard(writer)
        writer.close()


def _jpeg(number: int) -> bytes:
    done, jpeg = cv2.imencode(".jpg", picture(number))
    assert done
    return bytes(jpeg)
