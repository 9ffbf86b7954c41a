"""The plan of the land, generated from a seed: fields, roads, houses and trees. A square that repeats infinitely.

Fields are rectangles, split until they are small; tracks run between them. Then all of it is bent a little, because
real fields form no chessboard.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]

SIZE_M = 1024.0
"""Side of the square; the world's origin is its middle."""
MAX_FIELD_M = 150.0
MIN_FIELD_M = 45.0
ROAD_EAST_M, ROAD_NORTH_M = 58.0, -130.0
"""The two main roads: the one that runs north, and the one that runs east."""
CLEAR_OF_HOUSES_M = 14.0
BEND_M = 9.0
BENDS = ((1, 2, 0.7), (2, 1, 2.1), (3, 2, 4.0))
"""Waves along and across the square, and their phases."""


@dataclass(frozen=True, slots=True)
class Field:
    """Edges in metres east and north of the origin, before bending."""

    west: float
    south: float
    east: float
    north: float
    kind: int


@dataclass(frozen=True, slots=True)
class House:
    """`north_m`, `east_m`: its middle. `turn_rad`: its long side, from north. `roof`: the number of a colour."""

    north_m: float
    east_m: float
    turn_rad: float
    long_m: float
    wide_m: float
    wall_m: float
    ridge_m: float
    roof: int


@dataclass(frozen=True, slots=True)
class Tree:
    north_m: float
    east_m: float
    radius_m: float
    height_m: float
    shade: float
    """Of its green, 0 to 1."""
    in_wood: bool = False


@dataclass(frozen=True)
class Land:
    fields: tuple[Field, ...]
    houses: tuple[House, ...]
    trees: tuple[Tree, ...]

    @cached_property
    def house_places(self) -> Points:
        """North, east and down, one row per house."""
        return _places(self.houses)

    @cached_property
    def tree_places(self) -> Points:
        return _places(self.trees)


def _places(things: tuple[House, ...] | tuple[Tree, ...]) -> Points:
    return np.array([(thing.north_m, thing.east_m, 0.0) for thing in things]).reshape(-1, 3)


MEADOW, WHEAT, GRASS, SOIL, RAPE, WOOD, MAIZE = range(7)
KINDS = (WHEAT, WHEAT, GRASS, GRASS, SOIL, RAPE, WOOD, MAIZE)


def bend(across: Points, along: Points) -> tuple[Points, Points]:
    """Returns the displacement in metres of a place of the bent land (east, north) from its drawn position. It is
    continuous at the edges, and 0 near the origin, where the drones stand."""
    turn = 2.0 * math.pi / SIZE_M
    east, north = np.zeros_like(across + along), np.zeros_like(across + along)
    for here, there, begin in BENDS:
        east += np.sin(turn * (here * along + there * across) + begin)
        north += np.cos(turn * (there * along - here * across) + begin)
    calm = 1.0 - np.exp(-(np.sin(turn * across / 2) ** 2 + np.sin(turn * along / 2) ** 2) / 0.02)
    return east * calm * BEND_M, north * calm * BEND_M


def bent(east_m: Points, north_m: Points) -> tuple[Points, Points]:
    """Returns the bent positions of drawn points."""
    east, north = east_m, north_m
    for _ in range(4):
        by_east, by_north = bend(east, north)
        east, north = east_m - by_east, north_m - by_north
    return east, north


def make_land(seed: int) -> Land:
    random = np.random.default_rng(seed)
    fields = list(_fields(random))
    houses = list(_houses(random))
    return Land(tuple(fields), tuple(houses), tuple(_trees(random, fields, houses)))


def _fields(random: np.random.Generator) -> Iterator[Field]:
    half = SIZE_M / 2
    for west, east in ((-half, ROAD_EAST_M), (ROAD_EAST_M, half)):
        for south, north in ((-half, ROAD_NORTH_M), (ROAD_NORTH_M, half)):
            yield from _split(random, west, south, east, north)


def _split(random: np.random.Generator, west: float, south: float, east: float, north: float) -> Iterator[Field]:
    wide, high = east - west, north - south
    holds_home = west < 0.0 < east and south < 0.0 < north
    if max(wide, high) <= (MAX_FIELD_M if not holds_home else 190.0) * random.uniform(0.7, 1.3):
        yield Field(west, south, east, north, MEADOW if holds_home else int(random.choice(KINDS)))
        return
    part = random.uniform(0.35, 0.65)
    if wide > high:
        at = west + max(MIN_FIELD_M, wide * part)
        if abs(at) < 45.0 and holds_home:
            at = -75.0 if west < -110.0 else east
        if at >= east:
            yield Field(west, south, east, north, MEADOW if holds_home else GRASS)
            return
        yield from _split(random, west, south, at, north)
        yield from _split(random, at, south, east, north)
        return
    at = south + max(MIN_FIELD_M, high * part)
    if abs(at) < 45.0 and holds_home:
        at = 80.0
    yield from _split(random, west, south, east, at)
    yield from _split(random, west, at, east, north)


def _houses(random: np.random.Generator) -> Iterator[House]:
    """Places a village along the main road, and a few farms on the other one."""
    half = SIZE_M / 2
    for side in (-1.0, 1.0):
        along = ROAD_NORTH_M + 25.0
        while along < 260.0:
            # No houses beside the field where drones start.
            if side > 0 or along < -75.0 or along > 95.0:
                yield _house(random, ROAD_EAST_M + side * random.uniform(14.0, 19.0), along, 0.0)
            along += random.uniform(18.0, 34.0)
    for east in np.arange(-half + 40.0, half - 40.0, 95.0):
        if abs(east - ROAD_EAST_M) > 40.0:
            side = random.choice((-1.0, 1.0))
            yield _house(random, float(east) + random.uniform(-20, 20), ROAD_NORTH_M + side * 18.0, math.pi / 2)


def _house(random: np.random.Generator, east_m: float, north_m: float, turn_rad: float) -> House:
    (east,), (north,) = bent(np.array([east_m]), np.array([north_m]))
    wide = random.uniform(7.0, 9.5)
    return House(
        north_m=float(north),
        east_m=float(east),
        turn_rad=turn_rad + random.normal(0.0, 0.08) + random.choice((0.0, math.pi / 2)),
        long_m=wide * random.uniform(1.15, 1.7),
        wide_m=wide,
        wall_m=random.uniform(2.8, 5.0),
        ridge_m=wide * random.uniform(0.3, 0.45),
        roof=int(random.integers(0, 5)),
    )


def _trees(random: np.random.Generator, fields: list[Field], houses: list[House]) -> Iterator[Tree]:
    """Places trees in woods, along the edges of fields, and in gardens; not on a house."""
    yield from _planted(random, list(_in_woods(random, fields)), 4.2, houses, in_wood=True)
    yield from _planted(random, list(_along_edges(random, fields)), 3.2, houses, in_wood=False)
    for house in houses:
        for _ in range(2):
            angle = random.uniform(0.0, 2.0 * math.pi)
            away = random.uniform(10.0, 13.0)
            east, north = house.east_m + away * math.sin(angle), house.north_m + away * math.cos(angle)
            if abs(east - ROAD_EAST_M) > 9.0 and abs(north - ROAD_NORTH_M) > 9.0:
                yield Tree(north, east, random.uniform(1.5, 3.0), random.uniform(4.0, 7.0), random.uniform())


def _in_woods(random: np.random.Generator, fields: list[Field]) -> Iterator[tuple[float, float]]:
    for field in fields:
        if field.kind == WOOD:
            area = (field.east - field.west) * (field.north - field.south)
            for _ in range(int(area / 30.0)):
                east = random.uniform(field.west + 5, field.east - 5)
                yield east, random.uniform(field.south + 5, field.north - 5)


def _along_edges(random: np.random.Generator, fields: list[Field]) -> Iterator[tuple[float, float]]:
    for field in fields:
        if field.kind not in (WOOD, MEADOW) and random.uniform() < 0.6:
            for north in np.arange(field.south + 8.0, field.north - 8.0, 11.0):
                if random.uniform() < 0.6:
                    yield field.west + random.uniform(2.5, 4.0), float(north) + random.uniform(-3, 3)


def _planted(
    random: np.random.Generator,
    drawn: list[tuple[float, float]],
    largest_m: float,
    houses: list[House],
    *,
    in_wood: bool,
) -> Iterator[Tree]:
    if not drawn:
        return
    east, north = bent(*np.array(drawn).T)
    taken = np.zeros(len(drawn), bool)
    for house in houses:
        taken |= np.hypot(east - house.east_m, north - house.north_m) < CLEAR_OF_HOUSES_M
    for i in np.flatnonzero(~taken):
        radius = random.uniform(0.45, 1.0) * largest_m
        yield Tree(
            float(north[i]), float(east[i]), radius, radius * random.uniform(2.2, 3.0), random.uniform(), in_wood
        )
