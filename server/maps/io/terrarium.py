"""Elevation in an image: metres above the sea + 32,768, as red * 256 + green + blue / 256 (the terrarium encoding)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

SIDES: Final = (256, 512)
_OFFSET_M: Final = 32_768.0
UNKNOWN_M: Final = -_OFFSET_M
"""Black: the tile has no height there."""
_CODECS: Final = ((b"\x89PNG\r\n\x1a\n", "png"), (b"RIFF", "webp"))


class BadTile(Exception):
    """No image, or none of heights."""


@dataclass(frozen=True, slots=True)
class HeightTile:
    """`side` pixels along each edge."""

    side: int
    red_green_blue: bytes
    row_bytes: int

    def at(self, column: int, row: int) -> float:
        """Returns metres above the sea."""
        start = row * self.row_bytes + column * 3
        red, green, blue = self.red_green_blue[start : start + 3]
        return red * 256 + green + blue / 256 - _OFFSET_M


def decode_terrarium(raw: bytes) -> HeightTile:
    """Raises BadTile."""
    import av  # large: only a tower with elevation loads it

    name = next((name for magic, name in _CODECS if raw.startswith(magic)), None)
    if name is None:
        raise BadTile("neither PNG nor WebP")
    try:
        codec = av.CodecContext.create(name, "r")
        pictures = [*codec.decode(av.Packet(raw)), *codec.decode(None)]  # type: ignore[attr-defined]
    except (av.FFmpegError, ValueError, MemoryError) as error:
        raise BadTile(str(error)) from None
    if not pictures or pictures[0].width != pictures[0].height or pictures[0].width not in SIDES:
        raise BadTile("not a square of 256 or 512 pixels")
    picture = pictures[0].reformat(format="rgb24")
    plane = picture.planes[0]
    return HeightTile(picture.width, bytes(plane), plane.line_size)
