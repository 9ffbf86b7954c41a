"""Video of a drone as NumPy arrays. Needs the extra `video`: av and numpy.

The tower sends the next picture when it hears that the last one was used. So a program that takes long for each gets
fewer pictures, and never old ones; what it skipped is a gap in `sequence`.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import dataclass
from typing import Any, Final, Literal

import av
import msgspec
import numpy as np
from av.codec.context import Flags
from av.video.codeccontext import VideoCodecContext
from numpy.typing import NDArray
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

from control_tower.errors import SignInRefused, TowerError, TowerUnreachable
from wire.transport_stream import MalformedPackets, pictures_in, video_in
from wire.video import MAX_UNIT_BYTES, VIEWER_VIDEO_SUBPROTOCOL, Codec, MalformedUnit, Unit, decode_unit

PixelFormat = Literal["rgb24", "bgr24", "gray"]
OPEN_WITHIN_S: Final = 10.0
_SIGNED_OUT: Final = 4401


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """`image`: height x width x 3, or height x width for `gray`; 8 bits. `captured_us`: by the tower's monotonic clock,
    None while it does not know the drone's. `sequence` counts the pictures of the stream; a gap was skipped."""

    image: NDArray[np.uint8]
    sequence: int
    captured_us: int | None


class UnitDecoder:
    """Decodes the units of one stream. Begins at a key picture, and again after each gap."""

    def __init__(self, pixel_format: PixelFormat) -> None:
        self._format = pixel_format
        self._context: VideoCodecContext | None = None
        self._codec: Codec | None = None
        self._next: int | None = None

    def decode(self, unit: Unit) -> Picture | None:
        """Returns its picture; None until a key picture has come, or if it cannot be decoded."""
        leads_here = unit.sequence == self._next and not unit.is_break and unit.codec is self._codec
        if not unit.key and not leads_here:
            self._next = None
            return None
        context = self._context
        if context is None or unit.codec is not self._codec or (unit.key and not leads_here):
            context = self._context = _context(unit.codec)
            self._codec = unit.codec
        self._next = unit.sequence + 1 & 0xFFFF_FFFF
        try:
            parts = [unit.payload] if unit.codec is Codec.H264 else pictures_in(video_in(unit.payload))
            # An MPEG-1 unit may have a second picture that says "unchanged".
            frames = [frame for part in parts for frame in context.decode(av.Packet(part))]
        except (av.error.FFmpegError, MalformedPackets):
            self._next = None
            return None
        if not frames:
            return None
        image: Any = frames[0].to_ndarray(format=self._format)
        return Picture(image, unit.sequence, unit.capture_us or None)


def _context(codec: Codec) -> VideoCodecContext:
    context: VideoCodecContext = VideoCodecContext.create("mpeg1video" if codec is Codec.MPEG1 else "h264", "r")
    context.thread_count = 1
    context.flags |= Flags.low_delay
    return context


async def pictures(
    address: str, headers: dict[str, str], *, proxy: bool, pixel_format: PixelFormat
) -> AsyncGenerator[Picture, None]:
    """Yields pictures until the tower ends the channel. Raises SignInRefused, TowerUnreachable, or TowerError with the
    tower's reason."""
    decoder = UnitDecoder(pixel_format)
    try:
        async with connect(
            address,
            subprotocols=[Subprotocol(VIEWER_VIDEO_SUBPROTOCOL)],
            additional_headers=headers,
            compression=None,
            proxy=True if proxy else None,
            open_timeout=OPEN_WITHIN_S,
            max_size=MAX_UNIT_BYTES,
            max_queue=4,
        ) as socket:
            async for message in socket:
                if isinstance(message, str):
                    continue  # the state of the camera; a program sees that pictures come
                try:
                    unit = decode_unit(message)
                except MalformedUnit:
                    continue  # of another version
                picture = decoder.decode(unit)
                if picture is not None:
                    yield picture
                await socket.send(msgspec.json.encode({"type": "got", "sequence": unit.sequence}).decode())
    except ConnectionClosed as closed:
        reason = closed.rcvd.reason if closed.rcvd is not None else "the connection was cut"
        if closed.rcvd is not None and closed.rcvd.code == _SIGNED_OUT:
            raise SignInRefused(reason) from None
        raise TowerError(f"the video has ended: {reason}") from None
    except (OSError, TimeoutError, InvalidHandshake) as error:
        raise TowerUnreachable(f"the video channel cannot be opened: {error}") from None
