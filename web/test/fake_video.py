"""The video of the fake tower: a simulated camera, the agent's encoders and the tower's messages, all in one process.

The picture carries the simulator camera's time strip (docs/video.md), so that a test can read what a page shows. Each
viewer has its own encoder, and nothing is held back for a slow viewer: the tower's pacing is not simulated.
"""

import asyncio
import contextlib
import json
import time
from typing import Any, Final

import av
import numpy as np
from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from onboard_agent.video.encoders.encoder import Encoder
from onboard_agent.video.encoders.h264 import BY_PROCESSOR, H264Encoder
from onboard_agent.video.encoders.mpeg1 import Mpeg1Encoder
from onboard_agent.video.sources.source import Picture
from wire.video import LIMITS, VIEWER_VIDEO_SUBPROTOCOL, Codec, Quality, Unit, encode_unit

CELLS: Final = 20
OFFERED: Final = {"mpeg1": Codec.MPEG1, "h264": Codec.H264}

router = APIRouter()


class FakeCamera:
    """The controls behind `GET /fake/video/...`."""

    def __init__(self) -> None:
        self.state = "live"
        self.codecs = list(OFFERED)
        self.left_out = 0
        """Units still to drop."""
        self.close_with = 0
        self.viewers: set[FakeViewer] = set()
        self.drawn = 0
        """The newest unit that a viewer reported as drawn."""


camera = FakeCamera()


def monotonic_us() -> int:
    return time.monotonic_ns() // 1000


def strip_cells(at_ms: int) -> list[bool]:
    """Black, white, sixteen bits of Gray code, their parity and its opposite."""
    gray = (at_ms % 65536) ^ (at_ms % 65536 >> 1)
    bits = [bool(gray >> shift & 1) for shift in range(15, -1, -1)]
    parity = sum(bits) % 2 == 1
    return [False, True, *bits, parity, not parity]


def picture(number: int, width: int, height: int) -> av.VideoFrame:
    down, across = np.mgrid[0:height, 0:width]
    luma = (60 + across * 120 // width + 25 * ((across + 3 * number) // 32 % 2) + down // 16 % 2 * 8).astype(np.uint8)
    high = -(-(height // CELLS) // 8) * 8
    for cell, white in enumerate(strip_cells(time.time_ns() // 1_000_000)):
        luma[:high, cell * width // CELLS : (cell + 1) * width // CELLS] = 235 if white else 16
    return av.VideoFrame.from_ndarray(luma, format="gray").reformat(format="yuv420p")


class FakeStream:
    def __init__(self, quality: Quality, codec: Codec) -> None:
        limits = LIMITS[quality]
        self.quality, self.codec, self.limits = quality, codec, limits
        self.encoder: Encoder = Mpeg1Encoder(limits) if codec is Codec.MPEG1 else H264Encoder(BY_PROCESSOR, limits)
        self.number = 0

    def next(self) -> bytes:
        """Blocking."""
        at_us = monotonic_us()
        frame = picture(self.number, self.limits.width, self.limits.height)
        (coded,) = self.encoder.encode(Picture(frame, at_us, self.number + 1, self.number == 0))
        head = (self.quality, self.codec, self.number, coded.key, coded.is_break, at_us, coded.width, coded.height)
        self.number += 1
        return encode_unit(Unit(*head, self.limits.rate_hz, self.limits.bits_per_s, 0, coded.payload))


class FakeViewer:
    def __init__(self, socket: WebSocket) -> None:
        self.socket = socket
        codecs = socket.query_params["codec"].split(",")
        codec = next((one for one in codecs if one in camera.codecs), codecs[-1])
        self.asked = {"quality": socket.query_params["quality"], "codec": codec}

    async def send(self, **message: Any) -> None:
        await self.socket.send_text(json.dumps(message))

    async def say_state(self) -> None:
        await self.send(type="state", state=camera.state, words="", codecs=camera.codecs, **self.asked)

    async def show(self) -> None:
        stream: FakeStream | None = None
        said = ""
        while True:
            if camera.close_with:
                await self.socket.close(camera.close_with, "as the test wishes")
                return
            if said != camera.state:
                said = camera.state
                await self.say_state()
            if camera.state not in ("live", "thin-link"):
                stream = None
                await asyncio.sleep(0.05)
                continue
            wish = Quality[self.asked["quality"].upper()], OFFERED[self.asked["codec"]]
            if stream is None or wish != (stream.quality, stream.codec):
                stream = await asyncio.to_thread(FakeStream, *wish)
                await self.say_state()
                due = time.monotonic()
            unit = await asyncio.to_thread(stream.next)
            if camera.left_out:
                camera.left_out -= 1
            else:
                await self.socket.send_bytes(unit)
            due += 1 / stream.limits.rate_hz
            await asyncio.sleep(max(0.0, due - time.monotonic()))

    async def hear(self) -> None:
        while True:
            said = await self.socket.receive_json()
            if said["type"] == "clock":
                await self.send(type="clock", sent=said["sent"], tower_us=monotonic_us())
            elif said["type"] == "got":
                camera.drawn = said["sequence"]
            elif said["type"] == "want":
                self.asked = {name: said[name] for name in ("quality", "codec")}


@router.websocket("/api/v1/drones/{drone_id}/video")
async def video(socket: WebSocket, drone_id: int) -> None:
    await socket.accept(subprotocol=VIEWER_VIDEO_SUBPROTOCOL)
    viewer = FakeViewer(socket)
    showing = asyncio.create_task(viewer.show())
    camera.viewers.add(viewer)
    try:
        await viewer.hear()
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        camera.viewers.discard(viewer)
        showing.cancel()
        with contextlib.suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
            await showing


@router.get("/fake/video/{what}/{value}")
async def turn(what: str, value: str) -> dict[str, Any]:
    """`state/camera-lost`, `left_out/3`, `close_with/4404` (0: no more), `codecs/mpeg1`. Returns who watches what."""
    if what == "state":
        camera.state = value
    elif what == "codecs":
        camera.codecs = value.split(",")
    else:
        setattr(camera, what, int(value))
    codecs = [viewer.asked["codec"] for viewer in camera.viewers]
    return {"viewers": len(camera.viewers), "codecs": codecs, "drawn": camera.drawn}
