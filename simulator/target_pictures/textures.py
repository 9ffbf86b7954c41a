"""What lies on the ground, seen straight from above: targets of concentric squares, and decoys that resemble them.

A texture is grey, `TEXTURE_PX` square, with a mask of the same size (255 where it covers the ground).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

Picture = npt.NDArray[np.uint8]

TEXTURE_PX: Final = 512
INNERMOST: Final = 0.42
"""Side of the innermost square, where the letter is, as a share of the outermost."""

_HERSHEY: Final = (cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_TRIPLEX)


class Texture(NamedTuple):
    pixels: Picture
    mask: Picture


def _blank(level: int) -> Texture:
    pixels = np.full((TEXTURE_PX, TEXTURE_PX), level, np.uint8)
    return Texture(pixels, np.full_like(pixels, 255))


def _square(pixels: Picture, side: float, level: int, middle: tuple[float, float] = (0.5, 0.5)) -> None:
    """Fills a square; `side` and `middle` as shares of the texture."""
    half = side * TEXTURE_PX / 2
    x, y = (share * (TEXTURE_PX - 1) for share in middle)
    corners = np.array([(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)])
    cv2.fillConvexPoly(pixels, np.round(corners).astype(np.int32), level)


def draw_letter(pixels: Picture, letter: str, level: int, side: float, rng: np.random.Generator) -> None:
    """Draws a letter of a random face into the middle square of this side. OpenCV 5 has outline fonts besides
    Hershey's; half of the letters are of these where it does."""
    canvas = np.zeros_like(pixels)
    if hasattr(cv2, "FontFace") and rng.random() < 0.5:
        cv2.putText(canvas, letter, (120, 380), 255, cv2.FontFace("sans"), 300, int(rng.integers(400, 800)))
    else:
        thick = int(rng.integers(18, 34))
        cv2.putText(canvas, letter, (120, 380), _HERSHEY[int(rng.integers(3))], 10.0, 255, thick, cv2.LINE_AA)
    left, top, wide, high = cv2.boundingRect((canvas > 127).astype(np.uint8))
    glyph = canvas[top : top + high, left : left + wide]
    factor = side * 0.68 * TEXTURE_PX / max(wide, high)
    size = (max(round(wide * factor), 1), max(round(high * factor), 1))
    glyph = np.asarray(cv2.resize(glyph, size, interpolation=cv2.INTER_AREA), np.uint8)
    x, y = (TEXTURE_PX - size[0]) // 2, (TEXTURE_PX - size[1]) // 2
    under = pixels[y : y + size[1], x : x + size[0]]
    share = glyph.astype(np.float32) / 255
    under[:] = np.round(under * (1 - share) + level * share).astype(np.uint8)


def target(letter: str, squares: int, rng: np.random.Generator) -> Texture:
    """Returns `squares` concentric squares (3 or more) around a letter. Two kinds: filled squares, dark and light in
    turn, or frames of dark lines on a light board whose edge is the outermost square."""
    dark, light = int(rng.integers(5, 35)), int(rng.integers(215, 250))
    texture = _blank(light)
    if rng.random() < 0.3 and squares >= 5:
        frames = (squares - 1) // 2
        for number in range(frames):
            outer = 1.0 - (1.0 - INNERMOST) * (number + 0.6) / (frames + 0.1)
            _square(texture.pixels, outer, dark)
            _square(texture.pixels, outer - 0.5 * (1.0 - INNERMOST) / frames, light)
        level = dark
    else:
        levels = (dark, light) if rng.random() < 0.5 else (light, dark)
        for number, side in enumerate(np.linspace(1.0, INNERMOST, squares)):
            _square(texture.pixels, float(side), levels[number % 2])
        level = levels[squares % 2]
    draw_letter(texture.pixels, letter, level, INNERMOST * 0.8, rng)
    return texture


def _plate(rng: np.random.Generator) -> Texture:
    """A letter in one frame: two squares."""
    texture = _blank(int(rng.integers(215, 250)))
    _square(texture.pixels, 0.8, 20)
    draw_letter(texture.pixels, "ABCDEFGH"[int(rng.integers(8))], 235, 0.5, rng)
    return texture


def _marker(rng: np.random.Generator) -> Texture:
    """A fiducial marker on its plate."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    texture = _blank(240)
    side = TEXTURE_PX * 3 // 4
    edge = (TEXTURE_PX - side) // 2
    drawn = cv2.aruco.generateImageMarker(dictionary, int(rng.integers(50)), side)
    texture.pixels[edge : edge + side, edge : edge + side] = drawn
    return texture


def _circles(rng: np.random.Generator) -> Texture:
    texture = _blank(0)
    texture.mask[:] = 0
    middle, count = (TEXTURE_PX // 2, TEXTURE_PX // 2), int(rng.integers(3, 7))
    cv2.circle(texture.mask, middle, TEXTURE_PX // 2 - 1, 255, -1)
    for number in range(count):
        radius = round((TEXTURE_PX // 2 - 1) * (1 - number / count))
        cv2.circle(texture.pixels, middle, radius, (230, 20)[number % 2], -1)
    return texture


def _eccentric(rng: np.random.Generator) -> Texture:
    """Squares inside each other, each in a corner of the one around it."""
    texture = _blank(235)
    x = y = 0.5
    side = 1.0
    for number in range(4):
        shift = side * 0.13
        x, y, side = x + shift * rng.choice([-1, 1]), y + shift * rng.choice([-1, 1]), side * 0.68
        _square(texture.pixels, side, (20, 235)[number % 2], (float(x), float(y)))
    return texture


def _chequers(rng: np.random.Generator) -> Texture:
    count = int(rng.integers(3, 8))
    cells = (np.indices((count, count)).sum(axis=0) % 2 * 215 + 20).astype(np.uint8)
    texture = _blank(0)
    texture.pixels[:] = cv2.resize(cells, (TEXTURE_PX, TEXTURE_PX), interpolation=cv2.INTER_NEAREST)
    return texture


def _turned(rng: np.random.Generator) -> Texture:
    """Three squares with one centre, each turned by 45 degrees against the one around it."""
    texture = _blank(235)
    for number, half in enumerate((0.48, 0.32)):
        angles = np.radians(np.arange(0, 360, 90) + 45 * (number % 2))
        corners = (0.5 + half * np.stack([np.cos(angles), np.sin(angles)], axis=1)) * TEXTURE_PX
        cv2.fillConvexPoly(texture.pixels, np.round(corners).astype(np.int32), (20, 235)[number % 2])
    return texture


def _roof(rng: np.random.Generator) -> Texture:
    """A roof with a grid of windows."""
    texture = _blank(int(rng.integers(150, 200)))
    count = int(rng.integers(2, 5))
    for row in range(count):
        for column in range(count):
            middle = ((column + 0.5) / count, (row + 0.5) / count)
            _square(texture.pixels, 0.6 / count, 40, middle)
            _square(texture.pixels, 0.35 / count, 190, middle)
    return texture


DECOYS: Final = (_plate, _marker, _circles, _eccentric, _chequers, _turned, _roof)


def decoy(rng: np.random.Generator) -> Texture:
    """Returns one of `DECOYS`. None has three concentric squares."""
    return DECOYS[int(rng.integers(len(DECOYS)))](rng)
