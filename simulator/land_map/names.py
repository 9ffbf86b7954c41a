"""Invented names of villages, roads, woods and fields. The same seed and place give the same name."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import Final

_FIRST: Final = (
    *("Alder", "Amber", "Ash", "Barrow", "Beck", "Birch", "Bram", "Brook", "Carr", "Cole", "Crane", "Dun", "Elder"),
    *("Fern", "Finch", "Fox", "Gorse", "Hart", "Hazel", "Heron", "Holm", "Ivy", "Kings", "Lark", "Linden", "Marl"),
    *("Mill", "Moss", "Nether", "Oak", "Over", "Plover", "Quarry", "Rook", "Rush", "Sand", "Stone", "Swan", "Thorn"),
    *("Upper", "Wether", "Whin", "Willow", "Wren", "Yarrow"),
)
_LAST: Final = (
    *("bourne", "bridge", "bury", "combe", "cote", "den", "field", "ford", "ham", "hurst", "ley", "low", "mere"),
    *("minster", "ridge", "stead", "thorpe", "ton", "well", "wick", "worth"),
)
_WOODS: Final = ("Wood", "Copse", "Spinney", "Grove", "Hanger")
_FIELDS: Final = ("Acre", "Bottom", "Close", "Croft", "Furlong", "Leaze", "Piece", "Slade")
_MEADOWS: Final = ("Common", "Green", "Meadow", "Pasture")
_ROADS: Final = ("Road", "Lane", "Way", "Street")


def _choice(words: Sequence[str], *where: object) -> str:
    return Random(repr(where)).choice(words)  # noqa: S311 - no secret


def village(seed: int, column: int, row: int) -> str:
    first = _choice(_FIRST, "village", seed, column, row)
    last = _choice(_LAST, "last", seed, column, row)
    return first[:-1] + last if first[-1] == last[0] else first + last


def road(seed: int, runs_north: bool, number: int) -> str:
    """Returns the name of a main road, the same along its whole length."""
    where = ("road", seed, runs_north, number)
    return f"{_choice(_FIRST, *where)} {_choice(_ROADS, 'kind', *where)}"


def wood(seed: int, *where: int) -> str:
    return f"{_choice(_FIRST, 'wood', seed, *where)} {_choice(_WOODS, 'woods', seed, *where)}"


def meadow(seed: int, *where: int) -> str:
    return f"{_choice(_FIRST, 'meadow', seed, *where)} {_choice(_MEADOWS, 'meadows', seed, *where)}"


def field(seed: int, *where: int) -> str:
    return f"{_choice(_FIRST, 'field', seed, *where)} {_choice(_FIELDS, 'fields', seed, *where)}"
