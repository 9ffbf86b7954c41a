"""A short notation for parameter tables: lines of `PREFIX_ NAME=tVALUE ...`, with `-` for no prefix.

The letter t is the type: b INT8, h INT16, i INT32, f FLOAT. `numbered` repeats a group for several numbers.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum


class Kind(IntEnum):
    """MAV_PARAM_TYPE, as far as ArduPilot uses it."""

    INT8 = 2
    INT16 = 4
    INT32 = 6
    FLOAT = 9


Row = tuple[str, Kind, float]

_KINDS = {"b": Kind.INT8, "h": Kind.INT16, "i": Kind.INT32, "f": Kind.FLOAT}


def rows(text: str) -> list[Row]:
    """Returns the rows in their written order. Raises KeyError, IndexError or ValueError for text not in the
    notation."""
    found: list[Row] = []
    for line in text.split("\n"):
        prefix, *cells = line.split() or [""]
        start = "" if prefix == "-" else prefix
        for cell in cells:
            name, value = cell.split("=")
            found.append((start + name, _KINDS[value[0]], float(value[1:])))
    return found


def numbered(text: str, numbers: Iterable[int | str]) -> list[Row]:
    """Returns the rows of `text` for each number, which replaces `#`."""
    return [row for number in numbers for row in rows(text.replace("#", str(number)))]
