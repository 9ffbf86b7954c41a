"""Houses and trees that stand up from the ground near the camera; farther away the map shows them from above, which
suffices."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.ground import haze_at
from simulator.camera.ground_map import ROOF_COLOURS, outline, tree_colour
from simulator.camera.land import SIZE_M, House, Land, Tree
from simulator.camera.sky import HAZE
from simulator.camera.view import Floats, View, cut

Picture = npt.NDArray[np.uint8]
Colour = tuple[float, float, float]

HOUSES_TO_M = 420.0
TREES_TO_M = 240.0
WINDOWS_TO_M = 90.0
MAX_HOUSES, MAX_TREES = 30, 120
MARGIN_M = 14.0
"""How much of an object may be in the picture while its middle is not."""
MAX_OUTLINE_PX = 30000.0
"""Distance from the picture; the drawing functions count in 32 bits."""
NEAREST_M = 0.4
SUN = np.array([-0.50, -0.62, -0.60])
"""Direction to the sun, in the south-west; north, east, down."""
WALL = (196, 210, 216)
WINDOW = (92, 78, 66)
BARK = (46, 60, 76)
BLOBS = ((0.0, 0.0, 1.0, 0.66), (-0.1, 0.14, 0.84, 0.84), (-0.2, 0.30, 0.60, 1.05))
"""The blobs of a crown, from dark to light: offset aside and up, size, brightness."""
FACES = ((0, 1, 5, 8, 4), (1, 2, 6, 5), (2, 3, 7, 9, 6), (3, 0, 4, 7), (4, 8, 9, 7), (8, 5, 6, 9))
"""Corners of each: four walls, gable ends first and third, and the two halves of the roof. Corners 0 to 3 are on the
ground, 4 to 7 above them under the eaves, 8 and 9 the ends of the ridge."""
ROOFS = (4, 5)


@dataclass(frozen=True)
class _Shape:
    corners: Floats
    normals: Floats
    """Of each face, outwards."""
    bright: list[float]


@lru_cache(maxsize=256)
def _shape(house: House) -> _Shape:
    around = outline(house)
    low = [(north, east, 0.0) for east, north in around]
    high = [(north, east, -house.wall_m) for north, east, _ in low]
    top = -house.wall_m - house.ridge_m
    ends = [((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, top) for a, b in ((low[0], low[1]), (low[2], low[3]))]
    corners = np.array([*low, *high, *ends])
    middle = corners.mean(axis=0)
    normals = []
    for face in FACES:
        a, b, c = (corners[i] for i in face[:3])
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        normals.append(normal if normal @ (a - middle) > 0.0 else -normal)
    bright = [0.70 + 0.50 * max(float(normal @ SUN), 0.0) for normal in normals]
    return _Shape(corners, np.array(normals), bright)


def draw_solids(picture: Picture, view: View, land: Land) -> None:
    """Draws the farthest first."""
    trees = _near(view, land.tree_places, TREES_TO_M, MAX_TREES)
    houses = _near(view, land.house_places, HOUSES_TO_M, MAX_HOUSES)
    turns: list[tuple[float, Callable[[], None]]] = []
    for i, moved, ahead_m in houses:
        turns.append((ahead_m, partial(_draw_house, picture, view, land.houses[i], moved, haze_at(ahead_m))))
    turns.extend(_tree_turns(picture, view, land, trees))
    for _, draw in sorted(turns, key=lambda turn: -turn[0]):
        draw()


Near = tuple[int, Floats, float]
"""Index, offset of its copy of the land, and distance ahead."""


def _near(view: View, places: Floats, to_m: float, most: int) -> list[Near]:
    """Selects the objects in view. The land repeats: the nearest copy of each."""
    moved = np.round((view.eye - places) / SIZE_M) * SIZE_M
    moved[:, 2] = 0.0
    seen = view.to_lens(places + moved)
    ahead = seen[:, 2]
    wide = ahead * (view.width / 2 / view.focal_px) + MARGIN_M
    high = ahead * (view.height / 2 / view.focal_px) + MARGIN_M
    keep = (ahead > -MARGIN_M) & (ahead < to_m) & (np.abs(seen[:, 0]) < wide) & (np.abs(seen[:, 1]) < high)
    found = np.flatnonzero(keep)
    found = found[np.argsort(ahead[found])][:most]
    return [(int(i), moved[i], float(ahead[i])) for i in found]


def _shaded(colour: Colour, bright: float, haze: float) -> Colour:
    clear = 1.0 - haze
    return (
        min(colour[0] * bright, 255.0) * clear + HAZE[0] * haze,
        min(colour[1] * bright, 255.0) * clear + HAZE[1] * haze,
        min(colour[2] * bright, 255.0) * clear + HAZE[2] * haze,
    )


def _fill(picture: Picture, view: View, seen: Floats, colour: Colour) -> None:
    """Fills a convex face with corners in lens axes."""
    seen = cut(seen, (0.0, 0.0, 1.0), NEAREST_M)
    if len(seen) < 3:
        return
    pixels = view.to_pixels(seen)
    if np.abs(pixels).max() < MAX_OUTLINE_PX:
        cv2.fillConvexPoly(picture, np.round(pixels * 16).astype(np.int32), colour, cv2.LINE_AA, 4)


def _draw_house(picture: Picture, view: View, house: House, moved: Floats, haze: float) -> None:
    shape = _shape(house)
    corners = shape.corners + moved
    seen = view.to_lens(corners)
    firsts = corners[[face[0] for face in FACES]]
    towards_us = ((view.eye - firsts) * shape.normals).sum(axis=1) > 0.0
    near = float(seen[:, 2].min()) < WINDOWS_TO_M
    for number in np.flatnonzero(towards_us):
        is_roof = number in ROOFS
        colour = ROOF_COLOURS[house.roof] if is_roof else WALL
        _fill(picture, view, seen[list(FACES[number])], _shaded(colour, shape.bright[number], haze))
        if near and not is_roof:
            _draw_windows(picture, view, corners[list(FACES[number][:2])], house, haze)


def _draw_windows(picture: Picture, view: View, wall: Floats, house: House, haze: float) -> None:
    start, along = wall[0], wall[1] - wall[0]
    long_m = float(np.linalg.norm(along))
    count = max(int(long_m / 3.0), 1)
    aside = along / long_m * 0.55
    low, high = (np.array([0.0, 0.0, -rise]) for rise in (min(1.0, house.wall_m - 1.6), min(2.3, house.wall_m - 0.3)))
    for number in range(count):
        middle = start + along * ((number + 0.5) / count)
        pane = np.array([middle - aside + low, middle + aside + low, middle + aside + high, middle - aside + high])
        _fill(picture, view, view.to_lens(pane), _shaded(WINDOW, 1.0, haze))


def _tree_turns(
    picture: Picture, view: View, land: Land, near: list[Near]
) -> Iterator[tuple[float, Callable[[], None]]]:
    """All are transformed at once: there are many."""
    if not near:
        return
    trees = [land.trees[i] for i, _, _ in near]
    foot = land.tree_places[[i for i, _, _ in near]] + np.array([moved for _, moved, _ in near])
    crown = foot - np.array([(0.0, 0.0, tree.height_m - tree.radius_m) for tree in trees])
    crowns, feet = view.to_lens(crown), view.to_lens(foot)
    ahead = crowns[:, 2]
    radii = np.array([tree.radius_m for tree in trees])
    drawn = (ahead > np.maximum(radii * 0.7, NEAREST_M)) & (feet[:, 2] > NEAREST_M)
    ahead = np.where(drawn, ahead, 1.0)
    at = crowns[:, :2] / ahead[:, None] * view.focal_px + view.middle
    stand = feet[:, :2] / np.where(drawn, feet[:, 2], 1.0)[:, None] * view.focal_px + view.middle
    radii_px = radii / ahead * view.focal_px
    drawn &= (np.abs(at).max(axis=1) < MAX_OUTLINE_PX) & (np.abs(stand).max(axis=1) < MAX_OUTLINE_PX) & (radii_px > 1.0)
    up_x, up_y = (float(part) for part in -view.turned[2, :2])
    for i in np.flatnonzero(drawn):
        x, y, radius = float(at[i, 0]), float(at[i, 1]), float(radii_px[i])
        trunk = (round(x), round(y)), (round(float(stand[i, 0])), round(float(stand[i, 1])))
        haze = haze_at(float(ahead[i]))
        yield float(ahead[i]), partial(_draw_tree, picture, trees[i], trunk, (x, y, radius), (up_x, up_y), haze)


def _draw_tree(
    picture: Picture,
    tree: Tree,
    trunk: tuple[tuple[int, int], tuple[int, int]],
    crown: tuple[float, float, float],
    up: tuple[float, float],
    haze: float,
) -> None:
    x, y, radius = crown
    if radius > 3.0 and not tree.in_wood:
        cv2.line(picture, *trunk, _shaded(BARK, 1.0, haze), max(round(radius * 0.16), 1), cv2.LINE_AA)
    colour = tree_colour(tree)
    for aside, rise, size, bright in BLOBS if radius > 4.0 else BLOBS[:2]:
        right = x + radius * (rise * up[0] - aside * up[1])
        down = y + radius * (rise * up[1] + aside * up[0])
        cv2.circle(
            picture,
            (round(right * 16), round(down * 16)),
            round(radius * size * 16),
            _shaded(colour, bright, haze),
            -1,
            cv2.LINE_AA if radius > 4.0 else cv2.LINE_8,
            4,
        )
