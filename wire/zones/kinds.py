"""What kinds of zones there are. Pure."""

from enum import StrEnum


class ZoneKind(StrEnum):
    NO_FLY = "no-fly"
    HEIGHT_LIMIT = "height-limit"
    """Within it no drone flies above `ceiling_m`."""
    CORRIDOR = "corridor"
    """Drones stay within one of the corridors of their tower, and of their team."""


class ZoneRule(StrEnum):
    REFUSE = "refuse"
    """Plans and go-tos into it are refused; flown by hand, the drone holds at its edge."""
    WARN = "warn"
    """People are told, and nothing is refused."""


class HeightAbove(StrEnum):
    HOME = "home"
    SEA = "sea"
