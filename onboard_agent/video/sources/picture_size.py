"""How large a camera's pictures are, before they are decoded, and how large they may be. No I/O."""

from typing import Final, NamedTuple

MAX_PIXELS: Final = 4096 * 2304
"""The largest pictures of cameras of 4K, of any shape. Each takes 14 MB when it is decoded, several are in memory at
once, and what is sent has 640 x 480 pixels."""

MAX_TEXT_LENGTH: Final = f"{MAX_PIXELS / 1e6:.1f} million pixels (4096 x 2304)"

_MARKER: Final = 0xFF
_START: Final = 0xD8
_END: Final = 0xD9
_SCAN: Final = 0xDA
_ALONE: Final = frozenset({0x01, *range(0xD0, 0xD8)})
_FRAMES: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""All kinds of coding. The three others are tables, and one that is kept for later."""


class PixelCount(NamedTuple):
    """In pixels."""

    width: int
    height: int


class TooLarge(ValueError):
    """In words for people: how large it is, and how large it may be."""

    def __init__(self, width: int, height: int) -> None:
        super().__init__(f"pictures of {width} x {height} pixels are too large, the most is {MAX_TEXT_LENGTH}")


def check_size(width: int, height: int) -> None:
    """In pixels. Raises TooLarge."""
    if width * height > MAX_PIXELS:
        raise TooLarge(width, height)


def jpeg_size(jpeg: bytes) -> PixelCount | None:
    """The size in its head (ITU-T T.81, B.2.2). None: there is none before the picture begins, or it is damaged."""
    if jpeg[:2] != bytes([_MARKER, _START]):
        return None
    at = 2
    while at + 9 <= len(jpeg):
        if jpeg[at] != _MARKER:
            return None
        marker = jpeg[at + 1]
        if marker == _MARKER:  # a filler
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
