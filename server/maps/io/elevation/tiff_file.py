"""Reads the first image of a TIFF or BigTIFF file with one value per pixel: tags, and block by block the values.

TIFF 6.0; BigTIFF: https://www.awaresystems.be/imaging/tiff/bigtiff.html
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.elevation.tiff_codecs import (
    COMPRESSIONS,
    DIFFERENCES,
    FLOAT_DIFFERENCES,
    PLAIN,
    unpack,
    unpredict,
)

MAX_PIXELS: Final = 500_000_000
MAX_BLOCKS: Final = 2_000_000
MAX_BLOCK_BYTES: Final = 256_000_000
MAX_ENTRIES: Final = 1_000
MAX_VALUE_BYTES: Final = MAX_BLOCKS * 8

Value = tuple[int | float, ...] | bytes
_FORMATS: Final = {
    1: "B", 2: "s", 3: "H", 4: "I", 6: "b", 7: "s", 8: "h", 9: "i", 11: "f", 12: "d", 13: "I", 16: "Q", 17: "q", 18: "Q"
}  # fmt: skip
_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC = 256, 257, 258, 259, 262
_STRIP_OFFSETS, _SAMPLES, _STRIP_ROWS, _STRIP_BYTES = 273, 277, 278, 279
_PREDICTOR, _TILE_WIDTH, _TILE_HEIGHT, _TILE_OFFSETS, _TILE_BYTES, _SAMPLE_FORMAT = 317, 322, 323, 324, 325, 339
_WANTED: Final = frozenset({*range(256, 280), *range(317, 340), 33550, 33922, 34264, 34735, 42113})
"""Others, which may be as large as the file, are not read: GeoTIFF's tags beside those of the image."""
_MIN_IS_BLACK: Final = (0, 1)
_TYPES: Final = {
    (1, 16): "u2", (2, 16): "i2", (1, 32): "u4", (2, 32): "i4", (3, 32): "f4", (3, 64): "f8"
}  # fmt: skip


class TiffFile:
    """An open file. Raises OSError and BadElevationFile."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        try:
            self.tags = self._directory()
            self._understand()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def block_count(self) -> int:
        return len(self._offsets)

    def blocks(self) -> Iterator[tuple[int, int, npt.NDArray[np.generic] | None]]:
        """Yields the first row, the first column and the values of each block, cut to the image. None: the writer left
        the block out, so it has no values."""
        across = -(-self.width // self.block_width)
        for number, (offset, length) in enumerate(zip(self._offsets, self._lengths, strict=True)):
            row, column = number // across * self.block_height, number % across * self.block_width
            if offset == 0 or length == 0:
                yield row, column, None
                continue
            rows = self.block_height if self._is_tiled else min(self.block_height, self.height - row)
            size = rows * self.block_width * self.dtype.itemsize
            if length > MAX_BLOCK_BYTES:
                raise BadElevationFile("is broken: a block is too large")
            block = unpack(self._bytes(offset, length), self._compression, size)
            values = unpredict(block, self._predictor, self.dtype, self.block_width)
            yield row, column, values[: self.height - row, : self.width - column]

    def numbers(self, tag: int) -> tuple[int | float, ...]:
        """Returns an empty tuple where the file has no such tag."""
        value = self.tags.get(tag, ())
        return () if isinstance(value, bytes) else value

    def text(self, tag: int) -> str:
        value = self.tags.get(tag, b"")
        return value.rstrip(b"\0 ").decode("ascii", "replace") if isinstance(value, bytes) else ""

    def _understand(self) -> None:
        self.width, self.height = self._whole(_WIDTH, 0), self._whole(_HEIGHT, 0)
        if self.width < 2 or self.height < 2:
            raise BadElevationFile("is no image of at least 2 by 2 pixels")
        if self.width * self.height > MAX_PIXELS:
            raise BadElevationFile(
                f"is too large: {self.width} by {self.height} pixels, at most {MAX_PIXELS // 1_000_000} million"
            )
        if self._whole(_SAMPLES, 1) != 1 or self._whole(_PHOTOMETRIC, 1) not in _MIN_IS_BLACK:
            raise BadElevationFile("is a colour picture: elevation has one value per pixel")
        bits, form = self._whole(_BITS, 1), self._whole(_SAMPLE_FORMAT, 1)
        if (form, bits) not in _TYPES:
            raise BadElevationFile(f"has values of {bits} bits: elevation has 16-bit or 32-bit numbers, or floats")
        self.dtype: np.dtype[np.generic] = np.dtype(self._order + _TYPES[form, bits])
        self._compression, self._predictor = self._whole(_COMPRESSION, 1), self._whole(_PREDICTOR, PLAIN)
        if self._compression not in COMPRESSIONS:
            raise BadElevationFile(
                f"has compression {self._compression}: only none, deflate and LZW are read "
                "(gdal_translate -co COMPRESS=DEFLATE)"
            )
        if self._predictor not in (PLAIN, DIFFERENCES, FLOAT_DIFFERENCES) or (
            self._predictor == FLOAT_DIFFERENCES and form != 3
        ):
            raise BadElevationFile(f"has predictor {self._predictor}, which is not known for its values")
        self._find_blocks()

    def _find_blocks(self) -> None:
        self._is_tiled = _TILE_OFFSETS in self.tags
        if self._is_tiled:
            self.block_width, self.block_height = self._whole(_TILE_WIDTH, 0), self._whole(_TILE_HEIGHT, 0)
            offsets, lengths = self.numbers(_TILE_OFFSETS), self.numbers(_TILE_BYTES)
        else:
            self.block_width = self.width
            self.block_height = min(self._whole(_STRIP_ROWS, self.height), self.height)
            offsets, lengths = self.numbers(_STRIP_OFFSETS), self.numbers(_STRIP_BYTES)
        if self.block_width < 1 or self.block_height < 1:
            raise BadElevationFile("is broken: it has blocks without a size")
        if self.block_width * self.block_height * self.dtype.itemsize > MAX_BLOCK_BYTES:
            raise BadElevationFile(
                "has one block of its whole image, which is too large (gdal_translate -co TILED=YES)"
            )
        expected = -(-self.width // self.block_width) * -(-self.height // self.block_height)
        if not len(offsets) == len(lengths) == expected <= MAX_BLOCKS:
            raise BadElevationFile("is broken: it has not as many blocks as its size needs")
        self._offsets, self._lengths = [int(one) for one in offsets], [int(one) for one in lengths]

    def _directory(self) -> dict[int, Value]:
        head = self._bytes(0, 8)
        orders = {b"II": "<", b"MM": ">"}
        self._order = orders.get(head[:2], "")
        (version,) = struct.unpack(f"{self._order}H", head[2:4]) if self._order else (0,)
        if version not in (42, 43):
            raise BadElevationFile("is no TIFF file")
        is_big = version == 43
        # Sizes of: count of entries, an entry's count, an offset.
        count_form, number = ("Q", "Q") if is_big else ("H", "I")
        (at,) = self._unpacked("Q", 8) if is_big else struct.unpack(f"{self._order}I", head[4:])
        (entries,) = self._unpacked(count_form, at)
        if entries > MAX_ENTRIES:
            raise BadElevationFile("is broken: its directory is too large")
        at += struct.calcsize(count_form)
        step, inline = (20, 8) if is_big else (12, 4)
        tags: dict[int, Value] = {}
        for place in range(at, at + entries * step, step):
            tag, kind, count = self._unpacked(f"HH{number}", place)
            form = _FORMATS.get(kind)
            if form is None or tag not in _WANTED:
                continue
            size = struct.calcsize(form) * count
            if size > MAX_VALUE_BYTES:
                raise BadElevationFile("is too large: it has too many blocks")
            value_at = place + step - inline
            if size > inline:
                (value_at,) = self._unpacked(number, value_at)
            raw = self._bytes(value_at, size)
            tags[tag] = raw if form == "s" else struct.unpack(f"{self._order}{count}{form}", raw)
        return tags

    def _whole(self, tag: int, otherwise: int) -> int:
        return int(next(iter(self.numbers(tag)), otherwise))

    def _unpacked(self, form: str, at: int) -> tuple[int, ...]:
        form = self._order + form
        return struct.unpack(form, self._bytes(at, struct.calcsize(form)))

    def _bytes(self, at: int, length: int) -> bytes:
        try:
            self._file.seek(at)
            raw = self._file.read(length)
        except (OverflowError, ValueError):
            raw = b""
        if len(raw) != length:
            raise BadElevationFile("is not whole, or is no TIFF file")
        return raw
