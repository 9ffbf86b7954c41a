"""Encodes Mapbox Vector Tiles, version 2: https://github.com/mapbox/vector-tile-spec/tree/master/2.1

Features are not cut at the tile's edge: they are small beside a tile, and maps cut them when they draw.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from simulator.land_map.pmtiles import varint

EXTENT: Final = 8192
"""Units along a tile's edge: 0.2 m at the greatest zoom."""
Value = str | int
Points = npt.NDArray[np.int64]
"""Rows of x and y in units of the tile."""

_MOVE_TO, _LINE_TO, _CLOSE = 1, 2, 7


class Shape(IntEnum):
    POINT = 1
    LINE = 2
    AREA = 3


@dataclass(frozen=True, slots=True)
class TileFeature:
    shape: Shape
    points: Points
    facts: dict[str, Value]


def encode_tile(layers: Iterable[tuple[str, Sequence[TileFeature]]]) -> bytes:
    """Returns a tile with these layers, without those that have no feature."""
    return b"".join(_field(3, _layer(name, features)) for name, features in layers if features)


def _layer(name: str, features: Sequence[TileFeature]) -> bytes:
    keys: dict[str, int] = {}
    values: dict[Value, int] = {}
    encoded = [_field(2, body) for feature in features if (body := _feature(feature, keys, values))]
    words = [_field(3, key.encode()) for key in keys]
    facts = [_field(4, _value(value)) for value in values]
    return b"".join([_number(15, 2), _field(1, name.encode()), *encoded, *words, *facts, _number(5, EXTENT)])


def _feature(feature: TileFeature, keys: dict[str, int], values: dict[Value, int]) -> bytes:
    """Returns nothing for what has shrunk to less than its shape needs."""
    steps = _steps(feature.shape, feature.points)
    if not steps:
        return b""
    tags = [
        number
        for key, value in feature.facts.items()
        for number in (keys.setdefault(key, len(keys)), values.setdefault(value, len(values)))
    ]
    return _field(2, _packed(tags)) + _number(3, feature.shape) + _field(4, _packed(steps))


def _steps(shape: Shape, points: Points) -> list[int]:
    kept = points[np.r_[True, (np.diff(points, axis=0) != 0).any(axis=1)]]
    if shape is Shape.AREA:
        if len(kept) > 1 and (kept[0] == kept[-1]).all():
            kept = kept[:-1]
        x, y = kept[:, 0], kept[:, 1]
        twice_area = int((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
        if len(kept) < 3 or twice_area == 0:
            return []
        if twice_area < 0:  # an outer ring is clockwise on the screen, where y grows downwards
            kept = kept[::-1]
    elif shape is Shape.LINE and len(kept) < 2:
        return []
    moved = np.diff(kept, axis=0, prepend=np.zeros((1, 2), np.int64))
    zigzag = ((moved << 1) ^ (moved >> 63)).ravel().tolist()
    if shape is Shape.POINT:
        return [_MOVE_TO | 1 << 3, *zigzag[:2]]
    steps = [_MOVE_TO | 1 << 3, *zigzag[:2], _LINE_TO | (len(kept) - 1) << 3, *zigzag[2:]]
    return [*steps, _CLOSE | 1 << 3] if shape is Shape.AREA else steps


def _value(value: Value) -> bytes:
    return _field(1, value.encode()) if isinstance(value, str) else _number(5, value)


def _field(number: int, body: bytes) -> bytes:
    return varint(number << 3 | 2) + varint(len(body)) + body


def _number(number: int, value: int) -> bytes:
    return varint(number << 3) + varint(value)


def _packed(numbers: list[int]) -> bytes:
    return b"".join(varint(number) for number in numbers)
