"""Characters as a target's picture gives them to the reader: set in a typeface, seen small, tilted, blurred and noisy,
cut out by the agent's own steps. And spots of ink that are none."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from bench.characters.faces import Face
from onboard_agent.vision.character_ink import SMOOTHING_PX, box_of
from onboard_agent.vision.characters import GLYPH_PX, Glyph, glyph_of
from onboard_agent.vision.letter_reading import CHARACTERS

Floats = npt.NDArray[np.float32]
_FACE_PX: Final = 64
_CANVAS_PX: Final = 144
NONE: Final = len(CHARACTERS)
"""The class of what is no character."""


@lru_cache(maxsize=20_000)
def drawn(face: Face, character: str) -> npt.NDArray[np.uint8]:
    """Returns the character in the middle of a black canvas."""
    font = ImageFont.truetype(face.path, _FACE_PX, index=face.index)
    image = Image.new("L", (_CANVAS_PX, _CANVAS_PX))
    left, top, right, bottom = font.getbbox(character)
    place = ((_CANVAS_PX - left - right) / 2, (_CANVAS_PX - top - bottom) / 2)
    ImageDraw.Draw(image).text(place, character, 255, font)
    return np.asarray(image, np.uint8)


def _odd_shape(rng: np.random.Generator, faces: list[Face]) -> npt.NDArray[np.uint8]:
    """Returns ink that is no character: parts and heaps of them, turned ones, lines, spots."""
    canvas = np.zeros((_CANVAS_PX, _CANVAS_PX), np.uint8)
    kind, middle = int(rng.integers(10)), _CANVAS_PX // 2

    def one() -> npt.NDArray[np.uint8]:
        return drawn(faces[int(rng.integers(len(faces)))], CHARACTERS[int(rng.integers(len(CHARACTERS)))])

    if kind <= 1:  # two or three that touch, along or across
        apart, axis = int(rng.integers(16, 24)), int(rng.integers(2))
        canvas = np.maximum(np.roll(one(), -apart, axis=1), np.roll(one(), apart, axis=1))
        canvas = np.maximum(canvas, one()) if kind else canvas
        canvas = np.rot90(canvas, axis).copy()
    elif kind == 2:  # askew
        turn = cv2.getRotationMatrix2D((middle, middle), float(rng.uniform(30, 60) + 90 * rng.integers(4)), 1.0)
        canvas = np.asarray(cv2.warpAffine(one(), turn, canvas.shape[::-1]), np.uint8)
    elif kind == 3:
        points = rng.integers(middle - 30, middle + 30, (int(rng.integers(3, 7)), 2)).astype(np.int32)
        cv2.fillPoly(canvas, [points], 255)
    elif kind == 4:
        for _ in range(int(rng.integers(2, 6))):
            ends = rng.integers(middle - 30, middle + 30, (2, 2)).tolist()
            cv2.line(canvas, tuple(ends[0]), tuple(ends[1]), 255, int(rng.integers(3, 14)))
    elif kind == 5:
        axes = (int(rng.integers(10, 32)), int(rng.integers(10, 32)))
        cv2.ellipse(canvas, (middle, middle), axes, float(rng.uniform(0, 180)), 0, 360, 255, -1)
    elif kind == 6:  # a bar or a filled square
        wide, _ = rng.integers(4, 32, 2).tolist()
        cv2.rectangle(canvas, (middle - wide, middle - 28), (middle + wide, middle + 28), 255, -1)
    elif kind <= 8:  # cells, as of a marker
        cells = (rng.random((int(rng.integers(3, 7)), int(rng.integers(3, 7)))) < rng.uniform(0.35, 0.7)) * 255
        half = int(rng.integers(20, 36))
        grid = cv2.resize(cells.astype(np.uint8), (2 * half, 2 * half), interpolation=cv2.INTER_NEAREST)
        canvas[middle - half : middle + half, middle - half : middle + half] = grid
    else:
        coarse = rng.normal(0, 1, (5, 5)).astype(np.float32)
        spot = cv2.resize(coarse, (70, 70), interpolation=cv2.INTER_CUBIC)
        canvas[37:107, 37:107] = (spot > 0.2) * 255
    return canvas


def _seen(shape: npt.NDArray[np.uint8], rng: np.random.Generator) -> Glyph | None:
    """Returns the shape as it is cut out of a picture in which it is 9 to 60 pixels high. None: nothing is left."""
    weight = int(rng.integers(-1, 4))
    if weight:
        kernel = np.ones((abs(weight) + 1,) * 2, np.uint8)
        shape = np.asarray(cv2.dilate(shape, kernel) if weight > 0 else cv2.erode(shape, kernel), np.uint8)
    high_px = float(np.exp(rng.uniform(np.log(9.0), np.log(60.0))))
    scale = high_px / (_FACE_PX * 0.72)
    turn = np.radians(rng.normal(0.0, 4.0))
    spin = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    lean = np.array([[np.exp(rng.normal(0, 0.1)), rng.normal(0, 0.09)], [rng.normal(0, 0.04), 1.0]])
    size = max(round(_CANVAS_PX * scale), 24)
    onto = spin @ lean * (size / _CANVAS_PX)
    middle = np.array([_CANVAS_PX, _CANVAS_PX]) / 2
    shift = size / 2 + rng.uniform(-0.5, 0.5, 2) - onto @ middle
    smooth = cv2.GaussianBlur(shape, (0, 0), max(0.4 * _CANVAS_PX / size, 0.3))
    small = cv2.warpAffine(smooth, np.column_stack([onto, shift]), (size, size), flags=cv2.INTER_LINEAR)
    seen: Floats = small.astype(np.float32) / np.float32(255.0)
    blur_px = float(rng.uniform(0.2, min(1.7, 0.3 + high_px / 22)))
    seen = np.asarray(cv2.GaussianBlur(seen, (0, 0), blur_px), np.float32)
    length = round(rng.uniform(0.0, min(4.0, high_px / 8)))
    if length >= 2:
        kernel = np.zeros((2 * length + 1,) * 2, np.float32)
        angle = rng.uniform(0, np.pi)
        reach = np.array([np.cos(angle), np.sin(angle)]) * length / 2
        ends = np.round([length - reach, length + reach]).astype(int).tolist()
        cv2.line(kernel, tuple(ends[0]), tuple(ends[1]), 1.0, 1)
        seen = np.asarray(cv2.filter2D(seen, -1, kernel / kernel.sum()), np.float32)
    seen = seen + rng.normal(0.0, rng.uniform(0.0, 0.14), seen.shape).astype(np.float32)
    zoom = float(rng.uniform(32, 80)) / high_px
    edge = round(size * zoom)
    patch = cv2.resize(seen.astype(np.float32), (edge, edge), interpolation=cv2.INTER_CUBIC)
    patch = cv2.GaussianBlur(patch, (0, 0), SMOOTHING_PX)
    top = float(np.percentile(patch, 99.5))
    ink = np.clip(patch / max(top, 0.2), 0.0, 1.0).astype(np.float32)
    box = box_of(ink)
    if box is not None and rng.random() < 0.3:  # cut from characters that it touched
        ends = np.clip(rng.normal(0.0, 0.06, 2), -0.1, 0.1) * box.shape[1]
        left, right = round(ends[0]), round(ends[1])
        box = box[:, max(left, 0) : box.shape[1] - max(right, 0)]
        box = np.pad(box, ((0, 0), (max(-left, 0), max(-right, 0))))
    return None if box is None else glyph_of(box)


def samples(faces: list[Face], count: int, rng: np.random.Generator, odd: float = 0.15) -> tuple[Floats, Floats]:
    """Returns glyphs (n, GLYPH_PX, GLYPH_PX) upright, and their classes (n)."""
    glyphs, classes = np.empty((count, GLYPH_PX, GLYPH_PX), np.float32), np.empty(count, np.int64)
    done = 0
    while done < count:
        number = NONE if rng.random() < odd else int(rng.integers(len(CHARACTERS)))
        face = faces[int(rng.integers(len(faces)))]
        shape = _odd_shape(rng, faces) if number == NONE else drawn(face, CHARACTERS[number])
        glyph = _seen(shape, rng)
        if glyph is not None:
            glyphs[done], classes[done] = glyph, number
            done += 1
    return glyphs, classes  # type: ignore[return-value]
