"""Unpacks the blocks of a TIFF file: LZW and deflate, and the predictors 2 and 3.

TIFF 6.0, sections 13 and 14; Adobe Photoshop TIFF Technical Note 3 (predictor 3).
"""

from __future__ import annotations

import zlib
from typing import Final

import numpy as np
import numpy.typing as npt

from server.maps.io.elevation.refusals import BadElevationFile

NONE, LZW, DEFLATE, OLD_DEFLATE = 1, 5, 8, 32946
COMPRESSIONS: Final = frozenset({NONE, LZW, DEFLATE, OLD_DEFLATE})
PLAIN, DIFFERENCES, FLOAT_DIFFERENCES = 1, 2, 3
_CLEAR, _END = 256, 257
_MAX_CODES: Final = 4096
_WORDS: Final = [*(bytes((one,)) for one in range(256)), b"", b""]


def unpack(raw: bytes, compression: int, size: int) -> bytes:
    """Returns exactly `size` bytes, however many more the block may claim to have. Raises BadElevationFile."""
    if compression == NONE:
        out = raw[:size]
    elif compression == LZW:
        out = _lzw(raw, size)
    else:
        try:
            out = zlib.decompressobj().decompress(raw, size)
        except zlib.error:
            raise BadElevationFile("is broken: a block cannot be unpacked") from None
    if len(out) != size:
        raise BadElevationFile("is broken: a block is too short")
    return out


def unpredict(block: bytes, predictor: int, dtype: np.dtype[np.generic], width: int) -> npt.NDArray[np.generic]:
    """Returns rows of `width` values. `dtype` has the byte order of the file."""
    if predictor == FLOAT_DIFFERENCES:
        # Each row has the first bytes of all its values, then the second ones: the most significant come first.
        rows = np.frombuffer(block, np.uint8).reshape(-1, width * dtype.itemsize)
        planes = np.add.accumulate(rows, axis=1, dtype=np.uint8).reshape(-1, dtype.itemsize, width)
        return np.ascontiguousarray(planes.transpose(0, 2, 1)).view(dtype.newbyteorder(">"))[..., 0]
    values = np.frombuffer(block, dtype).reshape(-1, width)
    if predictor == DIFFERENCES:
        whole = np.dtype(f"u{dtype.itemsize}")
        steps = values.view(whole.newbyteorder(dtype.byteorder)).astype(whole)
        return np.add.accumulate(steps, axis=1, dtype=whole).view(dtype.newbyteorder("="))
    return values


def _lzw(raw: bytes, most: int) -> bytes:
    """Codes of 9 to 12 bits, the high bit first; the width grows one code early."""
    out = bytearray()
    words = _WORDS.copy()
    before = b""
    width, grows_at = 9, 511
    held = count = 0
    for byte in raw:
        held = held << 8 | byte
        count += 8
        if count < width:
            continue
        count -= width
        code = held >> count
        held &= (1 << count) - 1
        if code == _CLEAR:
            words = _WORDS.copy()
            before = b""
            width, grows_at = 9, 511
            continue
        if code == _END:
            break
        if code < len(words):
            word = words[code]
        elif code == len(words) and before:
            word = before + before[:1]
        else:
            raise BadElevationFile("is broken: a block cannot be unpacked")
        out += word
        if len(out) >= most:
            break
        if before and len(words) < _MAX_CODES:
            words.append(before + word[:1])
            if len(words) >= grows_at and width < 12:
                width += 1
                grows_at = (1 << width) - 1
        before = word
    return bytes(out[:most])
