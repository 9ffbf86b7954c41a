"""What character a spot of ink is, and which way up: a small network over the directions of edges, one for all four
quarter turns. `bench/characters/train.py` makes its weights."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.letter_reading import CHARACTERS

Floats = npt.NDArray[np.float32]
Glyph = npt.NDArray[np.float32]
"""(GLYPH_PX, GLYPH_PX); ink is 1, ground 0."""

GLYPH_PX: Final = 32
_MARGIN_PX: Final = 2
_CELL_PX: Final = 4
_DIRECTIONS: Final = 8
WEIGHTS: Final = Path(__file__).with_name("characters.npz")


class Network(NamedTuple):
    """Two layers. `hidden` (features, n), `output` (n, characters and "none of them"), each with its bias in the last
    row."""

    hidden: Floats
    output: Floats

    def logits(self, features: Floats) -> Floats:
        inner = np.maximum(features @ self.hidden[:-1] + self.hidden[-1], 0.0)
        return np.asarray(inner @ self.output[:-1] + self.output[-1], np.float32)


@lru_cache(maxsize=1)
def network() -> Network:
    """The trained one."""
    with np.load(WEIGHTS) as kept:
        hidden, output = (kept[name].astype(np.float32) * kept[f"{name}_step"] for name in ("hidden", "output"))
    return Network(hidden, output)


def glyph_of(ink: Floats) -> Glyph:
    """Scales the ink in its box, 0 to 1, to fill the glyph in its longer direction, in the middle."""
    high, wide = ink.shape
    factor = (GLYPH_PX - 2 * _MARGIN_PX) / max(wide, high)
    size = (max(round(wide * factor), 1), max(round(high * factor), 1))
    way = cv2.INTER_AREA if factor < 1.0 else cv2.INTER_LINEAR
    glyph = np.zeros((GLYPH_PX, GLYPH_PX), np.float32)
    x, y = (GLYPH_PX - size[0]) // 2, (GLYPH_PX - size[1]) // 2
    glyph[y : y + size[1], x : x + size[0]] = cv2.resize(ink, size, interpolation=way)
    return glyph


def features_of(glyphs: Floats) -> Floats:
    """Takes (n, GLYPH_PX, GLYPH_PX). Returns (n, features): how strong edges of each direction are in each cell, and
    the ink itself at half the size."""
    count = len(glyphs)
    padded = np.pad(glyphs, ((0, 0), (1, 1), (1, 1)))
    right = padded[:, 1:-1, 2:] - padded[:, 1:-1, :-2]
    down = padded[:, 2:, 1:-1] - padded[:, :-2, 1:-1]
    strength = np.sqrt(right * right + down * down)
    turn = np.arctan2(down, right) * (_DIRECTIONS / (2.0 * np.pi)) % _DIRECTIONS
    cells = GLYPH_PX // _CELL_PX
    parts = []
    for direction in range(_DIRECTIONS):
        off = np.abs(turn - direction)
        share = strength * np.maximum(1.0 - np.minimum(off, _DIRECTIONS - off), 0.0)
        sums = share.reshape(count, cells, _CELL_PX, cells, _CELL_PX).sum(axis=(2, 4))
        blocks = sums[:, :-1, :-1] + sums[:, 1:, :-1] + sums[:, :-1, 1:] + sums[:, 1:, 1:]
        parts.append(blocks.reshape(count, -1))
    edges = np.sqrt(np.concatenate(parts, axis=1))
    edges /= np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-6) / 10.0
    half = GLYPH_PX // 2
    small = glyphs.reshape(count, half, 2, half, 2).mean(axis=(2, 4)).reshape(count, -1)
    return np.asarray(np.concatenate([edges, small], axis=1), np.float32)


def logits_of(glyphs: list[Glyph]) -> Floats:
    """Returns (n, 4, characters and "none"): logits of each glyph with each quarter turn of its top, clockwise."""
    turned = np.array([np.rot90(glyph, turn) for glyph in glyphs for turn in range(4)])
    return network().logits(features_of(turned)).reshape(len(glyphs), 4, len(CHARACTERS) + 1)
