"""Finds MAVLink frames in a stream of bytes that may be cut anywhere and may contain noise.

Used at the autopilot's end: serial lines, TCP, and UDP programs that cut frames across datagrams. Bytes in, whole
frames out, nothing else.
"""

from wire.dialect import CRC_EXTRA
from wire.frames import (
    MAGIC_V1,
    MAGIC_V2,
    MAX_FRAME_BYTES,
    MalformedFrame,
    checksum_holds,
    frame_length,
    message_id,
)


class FrameStream:
    """Feed it bytes, take frames. Holds at most one incomplete frame (280 bytes) between calls.

    A known message must have a valid checksum; otherwise one byte is skipped and the search continues. A message that
    the dialect lacks cannot be checked, so it passes only if another frame, or the end of the data, follows it
    directly: unknown messages must be forwarded, but noise must not become frames.
    """

    def __init__(self) -> None:
        self._buffer = b""
        self.skipped_bytes = 0
        """Total bytes that belonged to no frame."""
        self.unknown_frames = 0
        """Frames passed on without a verifiable checksum."""

    def feed(self, data: bytes) -> list[bytes]:
        """Returns the whole frames that end within `data`, in order, unchanged."""
        buffer = self._buffer + data
        end = len(buffer)
        frames: list[bytes] = []
        at = 0
        while at < end:
            if buffer[at] not in (MAGIC_V1, MAGIC_V2):
                at = self._skip(buffer, at)
                continue
            try:
                length = frame_length(buffer, at)
            except MalformedFrame:
                at += 1
                self.skipped_bytes += 1
                continue
            if length == 0 or at + length > end:
                break
            frame = buffer[at : at + length]
            if self._believable(frame, buffer, at + length):
                frames.append(frame)
                at += length
            else:
                at += 1
                self.skipped_bytes += 1
        self._buffer = buffer[at:]
        assert len(self._buffer) < MAX_FRAME_BYTES
        return frames

    def _skip(self, buffer: bytes, at: int) -> int:
        starts = [i for i in (buffer.find(b"\xfe", at), buffer.find(b"\xfd", at)) if i >= 0]
        start = min(starts, default=len(buffer))
        self.skipped_bytes += start - at
        return start

    def _believable(self, frame: bytes, buffer: bytes, after: int) -> bool:
        if message_id(frame) in CRC_EXTRA:
            return checksum_holds(frame)
        if after == len(buffer) or buffer[after] in (MAGIC_V1, MAGIC_V2):
            self.unknown_frames += 1
            return True
        return False
