"""What one flight of `bench challenge` is about, drawn from a seed, with its truth; and the mission that is flown."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Final

from bench.rig import HOME
from wire.plans import Plan, PlanItem

ALPHABET: Final = "ABDEFGJKLPRTUVY"
NORTH_M: Final = (8.0, 44.0)
EAST_M: Final = (-18.0, 18.0)
LEGS_EAST_M: Final = (-15.0, -5.0, 5.0, 15.0)
"""The search: from south to north and back, 10 m apart."""
APART_M: Final = 12.0
SIDE_M: Final = 1.2
PAINTED_M: Final = 2.0
PAINTED: Final = "white 2, any 1"
"""The published challenge's own target."""
COLOURS: Final = ("red", "blue", "green", "yellow", "purple", "black")
HEIGHT_M: Final = 10.0
_METRES: Final = 111_319.5


def on_map(north_m: float, east_m: float) -> tuple[float, float]:
    """Returns latitude and longitude of a place north and east of home."""
    return HOME[0] + north_m / _METRES, HOME[1] + east_m / (_METRES * math.cos(math.radians(HOME[0])))


def apart_m(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Returns the distance of two places on the map."""
    east = (one[1] - other[1]) * math.cos(math.radians(HOME[0]))
    return math.hypot(one[0] - other[0], east) * _METRES


@dataclass(frozen=True, slots=True)
class Task:
    """The target and one with another letter. Places north and east of home; `wind`: m/s, and from where in degrees.
    `colours`: of white targets with a coloured square in them; empty: concentric squares, black and white."""

    letter: str
    place_m: tuple[float, float]
    other: str
    other_m: tuple[float, float]
    headings_deg: tuple[float, float]
    light: float
    wind: tuple[float, float]
    colours: tuple[str, ...] = ()

    @classmethod
    def drawn(cls, seed: int, number: int, *, painted: bool = False) -> Task:
        """The same for the same seed and number."""
        draw = random.Random(seed * 1000 + number)
        letter, other = draw.sample(ALPHABET, 2)
        place = (draw.uniform(*NORTH_M), draw.uniform(*EAST_M))
        while math.dist(place, there := (draw.uniform(*NORTH_M), draw.uniform(*EAST_M))) < APART_M:
            continue
        headings = (draw.uniform(0, 360), draw.uniform(0, 360))
        wind = (draw.uniform(0, 4), draw.uniform(0, 360))
        light = draw.uniform(0.4, 1.2)
        colours = (draw.choice(COLOURS), draw.choice(COLOURS)) if painted else ()
        return cls(letter, place, other, there, headings, light, wind, colours)

    @property
    def settings(self) -> dict[str, str | float]:
        """Of the controller."""
        kind = {"target": PAINTED} if self.colours else {}
        return {"letter": self.letter, "alphabet": ALPHABET, **kind}

    @property
    def targets(self) -> list[str]:
        """As `tower-sim --target` takes them."""
        names = [f"{letter}:{colour}" for letter, colour in zip((self.letter, self.other), self.colours, strict=False)]
        first, second = names or (self.letter, self.other)
        both, side_m = ((first, self.place_m), (second, self.other_m)), PAINTED_M if self.colours else SIDE_M
        places = [(letter, *on_map(*place_m)) for letter, place_m in both]
        return [
            f"{letter}@{lat:.7f},{lon:.7f},{heading:.1f},{side_m}"
            for (letter, lat, lon), heading in zip(places, self.headings_deg, strict=True)
        ]

    def options(self) -> list[str]:
        """For tower-sim."""
        words = [word for target in self.targets for word in ("--target", target)]
        return [*words, "--light", f"{self.light:.2f}", "--wind", f"{self.wind[0]:.1f},{self.wind[1]:.0f}"]


def mission() -> Plan:
    """As the console writes it: take-off, way-points, return."""
    items = [_item(22, 0.0, 0.0, HEIGHT_M)]
    for number, east_m in enumerate(LEGS_EAST_M):
        ends = (NORTH_M[0] - 2.0, NORTH_M[1] + 2.0)
        norths = ends if number % 2 == 0 else tuple(reversed(ends))
        items += [_item(16, *on_map(north_m, east_m), HEIGHT_M) for north_m in norths]
    return (*items, _item(20, 0.0, 0.0, 0.0))


def _item(command: int, lat_deg: float, lon_deg: float, height_m: float) -> PlanItem:
    return PlanItem(command, 2 if command == 20 else 3, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7), z=height_m)


@dataclass(frozen=True, slots=True)
class Flown:
    """The results of a flight; None: it did not come to that."""

    words: str
    target_m: float | None
    payload_m: float | None
    letter: str
    took_s: float
    phase: str
    """The last one with measured rates."""
