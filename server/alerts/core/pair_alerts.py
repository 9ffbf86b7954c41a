"""The findings of the separation watch as conditions of pairs. Pure.

Whoever may see both drones gets one alert with both names. Whoever may see only one gets another, which the rules for
strangers (`separation/strangers.py`) begin and end, and which says nothing about the second drone but what they allow.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

from server.airspace.core.separation.bounds import Level
from server.airspace.core.separation.encounter import Encounter
from server.airspace.core.separation.strangers import Rounded
from server.alerts.core.rules import NEAR, TOO_NEAR, Rule
from wire.ids import DroneId

_SOON_S: Final = 1.0
_DIRECTIONS: Final = (
    "north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west",
)  # fmt: skip


class PairKey(NamedTuple):
    """`about_stranger`: the alert for those who may not see `other_id`."""

    drone_id: DroneId
    other_id: DroneId
    about_stranger: bool


class PairFound(NamedTuple):
    rule: Rule
    words: str


def pairs_found(
    encounters: Iterable[Encounter],
    for_strangers: Iterable[tuple[DroneId, DroneId, Rounded]],
    open_rules: dict[PairKey, str],
    names: dict[DroneId, str],
) -> dict[PairKey, PairFound]:
    """What is so now. A warning stays a warning until it is over: another alert on the way back would add nothing.
    `open_rules`: the rule of each alert that is open."""
    found = {}
    for one in encounters:
        first, second = one.pair
        key = PairKey(first, second, about_stranger=False)
        rule = _rule(one.level, open_rules.get(key))
        if rule is not None and first in names and second in names:
            found[key] = PairFound(rule, _words(one, names[first], names[second]))
    for own, other, about in for_strangers:
        key = PairKey(own, other, about_stranger=True)
        rule = _rule(about.level, open_rules.get(key))
        if rule is not None and own in names:
            found[key] = PairFound(rule, stranger_words(about, names[own]))
    return found


def _rule(level: Level, open_rule: str | None) -> Rule | None:
    if level is Level.CLEAR:
        return None
    return TOO_NEAR if level is Level.WARNING or open_rule == TOO_NEAR.name else NEAR


def _words(one: Encounter, first: str, second: str) -> str:
    both = f"{first} and {second}"
    if one.judged is None:
        return f"{both} are too near each other."
    _, in_s, horizontal_m, vertical_m = one.judged.approach
    soon = in_s > _SOON_S
    what, when = ("will be", f", in {in_s:.0f} s") if soon else ("are", "")
    return f"{both} {what} {horizontal_m:.0f} m apart, {vertical_m:.0f} m in height{when}."


def stranger_words(about: Rounded, name: str) -> str:
    """With the rounded figures that strangers may know."""
    both = f"{name} and another drone"
    soon = about.in_s is not None and about.in_s > _SOON_S
    when = f"{both} will be close in about {about.in_s} s." if soon else f"{both} are near each other."
    if about.bearing_deg is None or about.distance_m is None or about.above_m is None:
        return when
    above = about.above_m
    height = "at about the same height" if above == 0 else f"about {abs(above)} m {'higher' if above > 0 else 'lower'}"
    direction = _DIRECTIONS[round(about.bearing_deg % 360 / 45) % len(_DIRECTIONS)]
    where = f"about {about.distance_m} m to the {direction} ({about.bearing_deg:03d}°), {height}"
    return f"{when} Seen from {name} it is {where}."
