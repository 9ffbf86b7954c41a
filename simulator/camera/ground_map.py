"""The land from above, as a picture: the source of the ground that the camera sees. Generated once per seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.land import (
    GRASS,
    MAIZE,
    MEADOW,
    RAPE,
    ROAD_EAST_M,
    ROAD_NORTH_M,
    SIZE_M,
    SOIL,
    WHEAT,
    WOOD,
    Field,
    House,
    Land,
    Tree,
    bend,
    make_land,
)
from simulator.camera.noise import cloudy

Picture = npt.NDArray[np.uint8]
Colour = tuple[float, float, float]
"""Blue, green, red."""

TEXEL_M = 0.25
SIZE_PX = round(SIZE_M / TEXEL_M)
LEVELS = 9
"""Each has half the resolution of the one before."""
CROWNS_FROM_LEVEL = 2
"""Nearer trees stand up from the ground (`solids`), so they must not be on the map as well; except for woods."""
GRAIN_TEXEL_M = 0.05
GRAIN_PX = 1024
SHADOW = (0.55, 0.80)
"""North and east, for an object one metre high."""

FIELD_COLOURS: dict[int, Colour] = {
    MEADOW: (62, 122, 96),
    WHEAT: (88, 160, 186),
    GRASS: (60, 116, 90),
    SOIL: (76, 100, 126),
    RAPE: (70, 178, 190),
    WOOD: (40, 72, 52),
    MAIZE: (52, 132, 88),
}
ROOF_COLOURS: tuple[Colour, ...] = ((52, 66, 142), (60, 80, 168), (74, 82, 96), (58, 64, 112), (92, 98, 108))
ASPHALT: Colour = (104, 102, 100)
TRACK: Colour = (112, 144, 164)


@dataclass(frozen=True)
class GroundMap:
    land: Land
    levels: list[Picture]
    """From the finest, TEXEL_M per pixel, north up, the world's origin in the middle."""
    grain: Picture
    """Close-range texture of grass and soil, added to the map, around 128."""
    mean: Colour


@lru_cache(maxsize=2)
def ground_map(seed: int) -> GroundMap:
    """Takes about a second and 65 MB."""
    random = np.random.default_rng(seed + 1)
    land = make_land(seed)
    finest = _bent(_fields(land, random))
    for house in land.houses:
        _polygon(finest, outline(house, more_m=5.0), (64, 122, 94))
    _add_noise(finest, random)
    for tree in land.trees:
        _tree_shadow(finest, tree)
        if tree.in_wood:
            draw_crown(finest, tree, TEXEL_M)
    for house in land.houses:
        _house(finest, house)
    levels = [finest]
    while len(levels) < LEVELS:
        above = levels[-1]
        if len(levels) == CROWNS_FROM_LEVEL + 1:
            for tree in land.trees:
                draw_crown(above, tree, TEXEL_M * 2**CROWNS_FROM_LEVEL)
        half = above.shape[0] // 2
        levels.append(np.asarray(cv2.resize(above, (half, half), interpolation=cv2.INTER_AREA), np.uint8))
    mean = levels[-1].reshape(-1, 3).mean(axis=0)
    return GroundMap(land, levels, _grain(random), (float(mean[0]), float(mean[1]), float(mean[2])))


def to_px(east_m: float, north_m: float) -> tuple[float, float]:
    """Returns the pixel on the finest map."""
    return east_m / TEXEL_M + SIZE_PX / 2, SIZE_PX / 2 - north_m / TEXEL_M


def _fixed(points: list[tuple[float, float]]) -> npt.NDArray[np.int32]:
    """Converts metres east and north to the sixteenths of a pixel that the drawing functions expect."""
    return np.array([[round(part * 16) for part in to_px(*point)] for point in points], np.int32)


def _polygon(map_: Picture, points: list[tuple[float, float]], colour: Colour) -> None:
    cv2.fillConvexPoly(map_, _fixed(points), colour, cv2.LINE_AA, 4)


def _fields(land: Land, random: np.random.Generator) -> Picture:
    map_ = np.empty((SIZE_PX, SIZE_PX, 3), np.uint8)
    map_[:] = TRACK
    for field in land.fields:
        _field(map_, field, random)
    half = SIZE_M / 2
    for west, south, east, north in (
        (ROAD_EAST_M - 3.2, -half, ROAD_EAST_M + 3.2, half),
        (-half, ROAD_NORTH_M - 3.2, half, ROAD_NORTH_M + 3.2),
    ):
        left, top, right, bottom = (round(n) for n in (*to_px(west, north), *to_px(east, south)))
        map_[top:bottom, left:right] = ASPHALT
    _road_marks(map_)
    return map_


def _road_marks(map_: Picture) -> None:
    half, white = SIZE_M / 2, (206, 212, 214)
    x, y = (round(n) for n in to_px(ROAD_EAST_M, ROAD_NORTH_M))
    for at in np.arange(-half, half, 9.0):
        if abs(at - ROAD_NORTH_M) > 8:
            top = round(to_px(0.0, at + 4.0)[1])
            map_[max(top, 0) : top + 16, x : x + 1] = white
        if abs(at - ROAD_EAST_M) > 8:
            left = round(to_px(float(at), 0.0)[0])
            map_[y : y + 1, left : left + 16] = white
    for side in (-11, 11):
        map_[:, x + side : x + side + 1] = white
        map_[y + side : y + side + 1, :] = white
    map_[y - 12 : y + 13, x - 12 : x + 13] = ASPHALT


def _field(map_: Picture, field: Field, random: np.random.Generator) -> None:
    verge = 1.3
    left, top = (round(n) for n in to_px(field.west + verge, field.north - verge))
    right, bottom = (round(n) for n in to_px(field.east - verge, field.south + verge))
    part = map_[top:bottom, left:right]
    colour = np.array(FIELD_COLOURS[field.kind]) * random.uniform(0.88, 1.12)
    high, wide = part.shape[:2]
    upright = random.uniform() < 0.5
    at_m = np.arange(wide if upright else high, dtype=np.float64) * TEXEL_M
    rows = _rows(field.kind, at_m)
    lines = colour[None, :] * (1.0 + rows)[:, None]
    lines = np.clip(lines, 0, 255).astype(np.uint8)
    part[:] = lines[None, :, :] if upright else lines[:, None, :]
    # Headlands, where tractors turn.
    if field.kind in (WHEAT, RAPE, MAIZE, SOIL):
        edge = round(9.0 / TEXEL_M)
        head = np.clip(colour * 0.96, 0, 255).astype(np.uint8)
        if upright:
            part[:edge] = part[-edge:] = head
        else:
            part[:, :edge] = part[:, -edge:] = head
    part[:3] = part[-3:] = (60, 112, 84)
    part[:, :3] = part[:, -3:] = (60, 112, 84)


def _rows(kind: int, at_m: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns how much lighter a field is across its rows: drills, tramlines, mowing strips."""
    if kind == MEADOW:
        return 0.05 * np.sign(np.sin(2 * math.pi * at_m / 9.0))
    if kind == GRASS:
        return 0.035 * np.sin(2 * math.pi * at_m / 6.0)
    if kind in (WHEAT, RAPE):
        in_lane = at_m % 18.0
        wheel = (np.abs(in_lane - 8.0) < 0.35) | (np.abs(in_lane - 9.9) < 0.35)
        return np.where(wheel, -0.22, 0.02 * np.sin(2 * math.pi * at_m / 3.0))
    if kind in (SOIL, MAIZE):
        return 0.10 * np.sin(2 * math.pi * at_m / 2.4)
    return np.zeros_like(at_m)


def _bent(map_: Picture) -> Picture:
    """The displacements are smooth, so they are computed on a coarse grid."""
    coarse = 256
    step = SIZE_M / coarse
    east = (np.arange(coarse, dtype=np.float64) + 0.5) * step - SIZE_M / 2
    by_east, by_north = bend(east[None, :], -east[:, None])
    across = _finer(by_east / TEXEL_M) + np.arange(SIZE_PX, dtype=np.float32)[None, :]
    along = _finer(-by_north / TEXEL_M) + np.arange(SIZE_PX, dtype=np.float32)[:, None]
    return np.asarray(cv2.remap(map_, across, along, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP), np.uint8)


def _finer(coarse: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    return np.asarray(
        cv2.resize(coarse.astype(np.float32), (SIZE_PX, SIZE_PX), interpolation=cv2.INTER_LINEAR), np.float32
    )


def _add_noise(map_: Picture, random: np.random.Generator) -> None:
    """Adds patches tens of metres wide, and the unevenness of the vegetation."""
    wide = cloudy(random, SIZE_PX // 8, 16, 5)
    patches = cv2.resize(np.pad(wide, 1, mode="wrap"), None, fx=8, fy=8, interpolation=cv2.INTER_LINEAR)
    patches = patches[8:-8, 8:-8]
    tile = random.normal(0.0, 7.0, (1024, 1024)).astype(np.float32)
    tile += cv2.resize(random.normal(0.0, 9.0, (256, 256)).astype(np.float32), (1024, 1024))
    amount = patches * 26.0
    amount += np.tile(tile, (SIZE_PX // 1024, SIZE_PX // 1024))
    grey = np.clip(amount + 128.0, 0, 255).astype(np.uint8)
    cv2.addWeighted(map_, 1.0, cv2.merge([grey, grey, grey]), 1.0, -128.0, dst=map_)


def _grain(random: np.random.Generator) -> Picture:
    total = np.zeros((GRAIN_PX, GRAIN_PX), np.float32)
    for cells, strength in ((32, 6.0), (128, 10.0), (512, 16.0)):
        total += cloudy(random, GRAIN_PX, cells, 2) * strength
    total += random.normal(0.0, 5.0, total.shape).astype(np.float32)
    grey = np.clip(total + 128.0, 0, 255)
    return np.asarray(grey, np.uint8)


def _house(map_: Picture, house: House) -> None:
    """Draws a house from above: shadow, and the two halves of the roof, the sunny one lighter."""
    corners = outline(house)
    reach = house.wall_m + house.ridge_m / 2
    shadow = [(e + SHADOW[1] * reach, n + SHADOW[0] * reach) for e, n in corners]
    hull = cv2.convexHull(np.array([*corners, *shadow], np.float32)).reshape(-1, 2)
    _polygon(map_, [(float(e), float(n)) for e, n in hull], (44, 66, 56))
    roof = ROOF_COLOURS[house.roof]
    a, b, c, d = corners
    ab, cd = _between(a, b), _between(c, d)
    _polygon(map_, [a, ab, cd, d], (roof[0] * 1.12, roof[1] * 1.12, roof[2] * 1.12))
    _polygon(map_, [ab, b, c, cd], (roof[0] * 0.8, roof[1] * 0.8, roof[2] * 0.8))


def _between(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    return (one[0] + other[0]) / 2, (one[1] + other[1]) / 2


def outline(house: House, *, more_m: float = 0.0) -> list[tuple[float, float]]:
    """Returns the corners, metres east and north. The first two belong to one short side; the ridge runs from between
    them to between the others."""
    c, s = math.cos(house.turn_rad), math.sin(house.turn_rad)
    half_long, half_wide = house.long_m / 2 + more_m, house.wide_m / 2 + more_m
    around = ((half_long, -half_wide), (half_long, half_wide), (-half_long, half_wide), (-half_long, -half_wide))
    return [(house.east_m + ahead * s + aside * c, house.north_m + ahead * c - aside * s) for ahead, aside in around]


def _disc(map_: Picture, east_m: float, north_m: float, radius_m: float, colour: Colour, texel_m: float) -> None:
    middle = map_.shape[0] / 2
    x, y = middle + east_m / texel_m, middle - north_m / texel_m
    cv2.circle(map_, (round(x * 16), round(y * 16)), round(radius_m / texel_m * 16), colour, -1, cv2.LINE_AA, 4)


def _tree_shadow(map_: Picture, tree: Tree) -> None:
    crown_m = tree.height_m - tree.radius_m
    at = tree.east_m + SHADOW[1] * crown_m, tree.north_m + SHADOW[0] * crown_m
    _disc(map_, *at, tree.radius_m, (36, 60, 46), TEXEL_M)


def draw_crown(map_: Picture, tree: Tree, texel_m: float) -> None:
    colour = tree_colour(tree)
    dark = (colour[0] * 0.8, colour[1] * 0.8, colour[2] * 0.8)
    _disc(map_, tree.east_m, tree.north_m, tree.radius_m, dark, texel_m)
    off_m = tree.radius_m * 0.25
    _disc(map_, tree.east_m - off_m, tree.north_m - off_m, tree.radius_m * 0.65, colour, texel_m)


def tree_colour(tree: Tree) -> Colour:
    return 44 + 12 * tree.shade, 92 + 26 * tree.shade, 62 + 30 * tree.shade
