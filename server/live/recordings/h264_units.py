"""The parameter sets of H.264 units: can all of a recording be decoded with those of its first picture? Pure."""

import re
from itertools import pairwise
from typing import Final

_START: Final = re.compile(rb"\x00\x00\x01")
_SEQUENCE_SET: Final = 7
_PICTURE_SET: Final = 8


def parameter_sets(payload: bytes) -> tuple[bytes, ...]:
    """The sequence and picture parameter sets of an access unit in Annex B, in order, without start codes."""
    starts = [found.end() for found in _START.finditer(payload)]
    found: list[bytes] = []
    for start, following in pairwise([*starts, len(payload) + 3]):
        if start < len(payload) and payload[start] & 0x1F in (_SEQUENCE_SET, _PICTURE_SET):
            found.append(payload[start : following - 3].rstrip(b"\x00"))
    return tuple(found)
