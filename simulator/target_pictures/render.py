"""Renders pictures of a target (or none) on textured ground among decoys, with tilt, shadows, light, blur and noise.

A picture depends only on its seed and number. The camera is a pinhole; a target is wholly in the picture, and its rings
are at least `MIN_RING_PX` wide before foreshortening.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from simulator.target_pictures.textures import INNERMOST, TEXTURE_PX, Picture, Texture, decoy, target

Floats = npt.NDArray[np.float64]

WIDTH_PX: Final = 640
HEIGHT_PX: Final = 480
FOCAL_PX: Final = 560.0
OVERSAMPLE: Final = 2
WITH_TARGET: Final = 0.6
MIN_RING_PX: Final = 6.0
SIDE_PX: Final = (60.0, 330.0)
MAX_TILT_DEG: Final = 50.0
LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
MARGIN_PX: Final = 5.0


@dataclass(frozen=True, slots=True)
class Truth:
    """The target in a picture. `headings_deg`: where its upper, right, lower and left side lie from its centre, from
    the picture's top, clockwise; under tilt they are not 90 degrees apart. `side_px`: mean of the four sides of the
    outermost square. `corners_px`: (4, 2), from its top left, clockwise."""

    centre_px: tuple[float, float]
    side_px: float
    headings_deg: tuple[float, float, float, float]
    corners_px: Floats
    letter: str
    squares: int
    tilt_deg: float


@dataclass(frozen=True, slots=True)
class Weather:
    """How bad a picture is. `blur_px`: sigma; `motion_px`: length; `noise`: sigma, of 255; `gain` of the light;
    `shadow`: the light in it."""

    blur_px: float
    motion_px: float
    noise: float
    gain: float
    shadow: float


@dataclass(frozen=True, slots=True)
class TargetPicture:
    """`pixels`: (480, 640, 3), blue, green, red. `truth` is None where there is no target."""

    pixels: Picture
    truth: Truth | None
    weather: Weather


def _pose(rng: np.random.Generator, side_px: float) -> tuple[Floats, float, float]:
    """Returns the homography from a unit square around the origin to pixels, tilt and spin in degrees."""
    tilt_deg = float(rng.uniform(0, MAX_TILT_DEG))
    spin, axis, tilt = rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi), math.radians(tilt_deg)
    turn = cv2.Rodrigues(np.array([math.cos(axis), math.sin(axis), 0.0]) * tilt)[0]
    spun = cv2.Rodrigues(np.array([0.0, 0.0, spin]))[0]
    rotation = np.asarray(turn @ spun, np.float64)
    depth = FOCAL_PX / side_px
    x, y = rng.uniform(0, WIDTH_PX - 1), rng.uniform(0, HEIGHT_PX - 1)
    middle = np.array([(WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2])
    place = np.array([(x - middle[0]) * depth / FOCAL_PX, (y - middle[1]) * depth / FOCAL_PX, depth])
    lens = np.array([[FOCAL_PX, 0, middle[0]], [0, FOCAL_PX, middle[1]], [0, 0, 1.0]])
    return lens @ np.column_stack([rotation[:, 0], rotation[:, 1], place]), tilt_deg, math.degrees(spin)


def project(homography: Floats, points: Floats) -> Floats:
    """Maps points (n, 2)."""
    mapped = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


_CORNERS: Final = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def _fits(corners: Floats) -> bool:
    low, high = corners.min(axis=0), corners.max(axis=0)
    return bool((low > MARGIN_PX).all() and high[0] < WIDTH_PX - MARGIN_PX and high[1] < HEIGHT_PX - MARGIN_PX)


def _ground(rng: np.random.Generator) -> Picture:
    """Grey ground of several grain sizes, with some straight edges."""
    size = (WIDTH_PX * OVERSAMPLE, HEIGHT_PX * OVERSAMPLE)
    ground = np.full((size[1], size[0]), rng.uniform(80, 160), np.float32)
    for cells in (4, 16, 64, 200):
        coarse = rng.normal(0.0, rng.uniform(2, 11), (cells * 3 // 4, cells)).astype(np.float32)
        ground += cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)
    for _ in range(int(rng.integers(0, 5))):
        ends = rng.uniform(0, 1, (2, 2)) * size
        level = float(rng.uniform(60, 200))
        (x1, y1), (x2, y2) = ends.astype(int).tolist()
        cv2.line(ground, (x1, y1), (x2, y2), level, int(rng.integers(2, 24)), cv2.LINE_AA)
    return np.clip(ground, 0, 255).astype(np.uint8)


def _lay(picture: Picture, texture: Texture, homography: Floats, side_px: float) -> None:
    """Warps a texture onto the oversampled picture."""
    shrink = max(min(int(TEXTURE_PX / max(side_px * OVERSAMPLE, 1.0)), 8), 1)
    px = TEXTURE_PX // shrink
    pixels, mask = (
        np.asarray(cv2.resize(layer, (px, px), interpolation=cv2.INTER_AREA), np.uint8) for layer in texture
    )
    to_unit = np.array([[1 / px, 0, 0.5 / px - 0.5], [0, 1 / px, 0.5 / px - 0.5], [0, 0, 1.0]])
    shift = (OVERSAMPLE - 1) / 2
    to_large = np.array([[OVERSAMPLE, 0, shift], [0, OVERSAMPLE, shift], [0, 0, 1.0]])
    whole = to_large @ homography @ to_unit
    size = (picture.shape[1], picture.shape[0])
    drawn = cv2.warpPerspective(pixels, whole, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    covered = cv2.warpPerspective(mask, whole, size, flags=cv2.INTER_NEAREST)
    cv2.copyTo(drawn, covered, picture)


def _weather(rng: np.random.Generator) -> Weather:
    return Weather(
        blur_px=float(rng.uniform(0, 1.8)),
        motion_px=float(rng.uniform(0, 5)),
        noise=float(rng.uniform(1, 14)),
        gain=float(rng.uniform(0.35, 1.25)),
        shadow=float(rng.uniform(0.45, 1.0)),
    )


def _expose(picture: Picture, weather: Weather, rng: np.random.Generator) -> Picture:
    """Applies shadow, light, tint, blur and noise."""
    high, wide = picture.shape
    y, x = np.mgrid[0:high, 0:wide].astype(np.float32)
    angle, where = rng.uniform(0, 2 * math.pi), rng.uniform(0.2, 0.8)
    across = (x / wide - where) * math.cos(angle) + (y / high - where) * math.sin(angle)
    light = weather.gain * (1 + 0.35 * across)
    lit_side = 0.5 + 0.5 * np.tanh(across / rng.uniform(0.008, 0.12))
    light *= weather.shadow + (1 - weather.shadow) * lit_side
    lit = np.asarray(picture * light, np.float32)
    if weather.blur_px > 0.2:
        lit = np.asarray(cv2.GaussianBlur(lit, (0, 0), weather.blur_px), np.float32)
    length = round(weather.motion_px)
    if length >= 2:
        kernel = np.zeros((2 * length + 1, 2 * length + 1), np.float32)
        step = np.array([math.cos(angle), math.sin(angle)]) * length / 2
        start, end = (np.round(length + sign * step).astype(int).tolist() for sign in (-1, 1))
        cv2.line(kernel, (start[0], start[1]), (end[0], end[1]), 1.0, 1)
        lit = np.asarray(cv2.filter2D(lit, -1, kernel / kernel.sum()), np.float32)
    tint = rng.uniform(0.85, 1.0, 3)
    seen = lit[:, :, None] * tint + rng.normal(0.0, weather.noise, (high, wide, 3))
    return np.clip(np.round(seen), 0, 255).astype(np.uint8)


def render(seed: int, number: int, *, with_target: bool | None = None) -> TargetPicture:
    """Renders picture `number` of a seed. `with_target` None: `WITH_TARGET` of the pictures have one."""
    rng = np.random.default_rng([seed, number])
    has_target = bool(rng.random() < WITH_TARGET)
    if with_target is not None:
        has_target = with_target
    large = _ground(rng)
    for _ in range(int(rng.integers(0, 3)) if has_target else int(rng.integers(1, 4))):
        side_px = float(np.exp(rng.uniform(math.log(40), math.log(260))))
        homography, _, _ = _pose(rng, side_px)
        _lay(large, decoy(rng), homography, side_px)
    truth = _add_target(large, rng) if has_target else None
    small = cv2.resize(large, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
    weather = _weather(rng)
    return TargetPicture(_expose(np.asarray(small, np.uint8), weather, rng), truth, weather)


def _add_target(large: Picture, rng: np.random.Generator) -> Truth:
    side_px = float(np.exp(rng.uniform(*np.log(SIDE_PX))))
    while True:
        homography, tilt_deg, _ = _pose(rng, side_px)
        corners = project(homography, _CORNERS)
        if _fits(corners):
            break
    max_squares = int((1.0 - INNERMOST) / 2 * side_px / MIN_RING_PX) + 1
    squares = int(rng.integers(3, max(min(max_squares, 6), 3) + 1))
    letter = LETTERS[int(rng.integers(len(LETTERS)))]
    _lay(large, target(letter, squares, rng), homography, side_px)
    centre, *middles = project(homography, np.array([(0.0, 0.0), (0.0, -0.5), (0.5, 0.0), (0.0, 0.5), (-0.5, 0.0)]))
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    up, right, down, left = (math.degrees(math.atan2(x - centre[0], centre[1] - y)) % 360.0 for x, y in middles)
    place = (float(centre[0]), float(centre[1]))
    return Truth(place, float(sides.mean()), (up, right, down, left), corners, letter, squares, tilt_deg)
