"""What stands on the simulated land, as shapes in metres east and north of home: fields, roads, houses, names.

The land repeats every `SIZE_M`. Its shapes repeat on the map too; its names do not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from simulator.camera.ground_map import outline
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
    Land,
    bent,
)
from simulator.land_map import names
from simulator.land_map.vector_tile import Shape, Value

Floats = npt.NDArray[np.float64]

KINDS: Final = {
    MEADOW: ("meadow", ""),
    GRASS: ("meadow", ""),
    WHEAT: ("farmland", "wheat"),
    RAPE: ("farmland", "rape"),
    MAIZE: ("farmland", "maize"),
    SOIL: ("farmland", "soil"),
    WOOD: ("forest", ""),
}
VERGE_M: Final = 1.3
"""Between a field and its edge runs a track."""
GARDEN_M: Final = 5.0
STEP_M: Final = 12.0
"""Edges of fields and roads are bent in steps of about this."""
VILLAGE_NORTH_M: Final = 70.0
NAMED_FIELD_M2: Final = 9_000.0
SQUARES_ROUND_HOME: Final = 3
"""Squares of land in each direction from the one that holds home."""
HALF_M: Final = (SQUARES_ROUND_HOME + 0.5) * SIZE_M


@dataclass(frozen=True, slots=True)
class Feature:
    """`points_m`: rows of east and north. `from_zoom`: the smallest zoom whose tiles have it."""

    layer: str
    shape: Shape
    points_m: Floats
    facts: dict[str, Value]
    from_zoom: int


def features(land: Land, seed: int) -> Iterator[Feature]:
    """Yields everything within `HALF_M` of home, from bottom to top."""
    edge = np.array([(-HALF_M, -HALF_M), (HALF_M, -HALF_M), (HALF_M, HALF_M), (-HALF_M, HALF_M)])
    yield Feature("earth", Shape.AREA, edge, {"kind": "earth"}, 0)
    yield Feature("landcover", Shape.AREA, edge, {"kind": "farmland"}, 0)
    square = list(_square(land))
    squares = range(-SQUARES_ROUND_HOME, SQUARES_ROUND_HOME + 1)
    for row in squares:
        for column in squares:
            moved = np.array([column * SIZE_M, row * SIZE_M])
            for one in square:
                yield Feature(one.layer, one.shape, one.points_m + moved, one.facts, one.from_zoom)
            yield from _names(land, seed, column, row)
    yield from _roads(seed)


def _square(land: Land) -> Iterator[Feature]:
    for field in land.fields:
        kind, crop = KINDS[field.kind]
        facts: dict[str, Value] = {"kind": kind, "crop": crop} if crop else {"kind": kind}
        yield Feature("landuse", Shape.AREA, _edge(field), facts, 12)
    for house in land.houses:
        garden = np.array(outline(house, more_m=GARDEN_M))
        yield Feature("landuse", Shape.AREA, garden, {"kind": "garden"}, 14)
    for house in land.houses:
        facts = {"kind": "building", "height": round(house.wall_m + house.ridge_m)}
        yield Feature("buildings", Shape.AREA, np.array(outline(house)), facts, 13)


def _edge(field: Field) -> Floats:
    west, east = field.west + VERGE_M, field.east - VERGE_M
    south, north = field.south + VERGE_M, field.north - VERGE_M
    across = np.linspace(west, east, max(round((east - west) / STEP_M), 1) + 1)[:-1]
    along = np.linspace(south, north, max(round((north - south) / STEP_M), 1) + 1)[:-1]
    x = np.concatenate([across, np.full_like(along, east), west + east - across, np.full_like(along, west)])
    y = np.concatenate([np.full_like(across, south), along, np.full_like(across, north), south + north - along])
    return np.column_stack(bent(x, y))


def _names(land: Land, seed: int, column: int, row: int) -> Iterator[Feature]:
    moved = np.array([column * SIZE_M, row * SIZE_M])

    def name(layer: str, text: str, kind: str, east: float, north: float, from_zoom: int) -> Feature:
        place = np.column_stack(bent(np.array([east]), np.array([north]))) + moved
        return Feature(layer, Shape.POINT, place, {"kind": kind, "name": text}, from_zoom)

    central = column % 3 == 0 and row % 3 == 0
    yield name(
        "places",
        names.village(seed, column, row),
        "town" if central else "village",
        ROAD_EAST_M,
        VILLAGE_NORTH_M,
        10 if central else 12,
    )
    for number, field in enumerate(land.fields):
        middle = (field.west + field.east) / 2, (field.south + field.north) / 2
        if field.kind == WOOD:
            yield name("pois", names.wood(seed, column, row, number), "forest", *middle, 13)
        elif (field.east - field.west) * (field.north - field.south) > NAMED_FIELD_M2:
            of = names.meadow if field.kind in (MEADOW, GRASS) else names.field
            yield name("pois", of(seed, column, row, number), "field", *middle, 14)


def _roads(seed: int) -> Iterator[Feature]:
    """One piece for each square, so that no feature is large beside a tile."""
    squares = range(-SQUARES_ROUND_HOME, SQUARES_ROUND_HOME + 1)
    for runs_north in (True, False):
        for number in squares:
            facts: dict[str, Value] = {
                "kind": "major_road" if number % 3 == 0 else "medium_road",
                "name": names.road(seed, runs_north, number),
            }
            for piece in squares:
                begin = piece * SIZE_M - SIZE_M / 2
                along = begin + np.linspace(0.0, SIZE_M, math.ceil(SIZE_M / STEP_M) + 1)
                beside = np.full_like(along, number * SIZE_M + (ROAD_EAST_M if runs_north else ROAD_NORTH_M))
                line = np.column_stack(bent(beside, along) if runs_north else bent(along, beside))
                yield Feature("roads", Shape.LINE, line, facts, 9 if number % 3 == 0 else 11)
