"""Reads the size of a camera's pictures before they are decoded, and limits it. No I/O."""

from typing import Final, NamedTuple

MAX_PIXELS: Final = 4096 * 2304
"""The largest pictures of 4K cameras, in any proportions. Each takes 14 MB decoded, several are in memory at once, and
the pictures sent have only 640 x 480 pixels."""

MAX_TEXT_LENGTH: Final = f"{MAX_PIXELS / 1e6:.1f} million pixels (4096 x 2304)"

_MARKER: Final = 0xFF
_START: Final = 0xD8
_END: Final = 0xD9
_SCAN: Final = 0xDA
_ALONE: Final = frozenset({0x01, *range(0xD0, 0xD8)})
_FRAMES: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Frame headers of all coding processes. The three excluded markers are tables, and one reserved marker."""


class PixelCount(NamedTuple):
    """Width and height in pixels."""

    width: int
    height: int


class TooLarge(ValueError):
    """The text gives the size and the limit, in words for users."""

    def __init__(self, width: int, height: int) -> None:
        super().__init__(f"pictures of {width} x {height} pixels are too large, the most is {MAX_TEXT_LENGTH}")


def check_size(width: int, height: int) -> None:
    """`width` and `height` in pixels. Raises TooLarge."""
    if width * height > MAX_PIXELS:
        raise TooLarge(width, height)


def jpeg_size(jpeg: bytes) -> PixelCount | None:
    """Returns the size in the header (ITU-T T.81, B.2.2). None: none before the image data, or the JPEG is damaged."""
    if jpeg[:2] != bytes([_MARKER, _START]):
        return None
    at = 2
    while at + 9 <= len(jpeg):
        if jpeg[at] != _MARKER:
            return None
        marker = jpeg[at + 1]
        if marker == _MARKER:  # a fill byte
            at += 1
        elif marker in _ALONE or marker == _START:
            at += 2
        elif marker in (_SCAN, _END):
            return None
        elif marker in _FRAMES:
            height, width = int.from_bytes(jpeg[at + 5 : at + 7]), int.from_bytes(jpeg[at + 7 : at + 9])
            return PixelCount(width, height) if width and height else None
        else:
            at += 2 + int.from_bytes(jpeg[at + 2 : at + 4])
    return None
