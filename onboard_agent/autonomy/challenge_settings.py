"""The settings of the controller `challenge`: what they are, for a form, and those of a request. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.autonomy.controller_settings import BadSetting
from onboard_agent.autonomy.core.lines import Waypoint
from onboard_agent.vision.letter_reading import CHARACTERS, MAX_CHARACTERS
from onboard_agent.vision.target_kind import SQUARES, BadKind, parse_kind
from wire.controller_settings import ControllerSetting, SettingKind, fault_of


@dataclass(frozen=True, slots=True)
class ChallengeSettings:
    """Heights in metres above home, m/s, seconds. `target`: its kind, as `parse_kind` reads it. `letter`: one to three
    characters that are sought; empty: any target. `alphabet`: the characters that occur. `points`: `LAT,LON` pairs
    between semicolons, in place of the mission on board. `around_m`: without either, it searches so far to each side of
    the place where it begins; 0: it does not."""

    target: str = SQUARES
    letter: str = ""
    alphabet: str = CHARACTERS
    camera: str = ""
    points: str = ""
    around_m: float = 20.0
    search_height_m: float = 10.0
    search_speed_m_s: float = 3.0
    drop_height_m: float = 3.0
    centred_m: float = 0.35
    search_s: float = 300.0
    centre_s: float = 60.0
    home_s: float = 120.0

    @classmethod
    def of(cls, given: Mapping[str, str | float]) -> ChallengeSettings:
        """Raises BadSetting, which begins with the name of the setting."""
        fault = fault_of(SETTINGS, given)
        if fault is not None:
            raise BadSetting(": ".join(fault))
        made = cls(**given)  # type: ignore[arg-type]
        if made.drop_height_m > made.search_height_m:
            raise BadSetting("drop_height_m: must not be above search_height_m")
        try:
            kind = parse_kind(made.target)
        except BadKind as error:
            raise BadSetting(str(error)) from None
        if not made.alphabet:
            raise BadSetting("alphabet: must have at least one character")
        if made.letter and not kind.has_text:
            raise BadSetting("letter: a marker has none; its number is in target")
        if not set(made.letter) <= set(made.alphabet):
            raise BadSetting(f"letter: {made.letter!r} is not made of characters of {made.alphabet}")
        return made

    def waypoints(self, mission: tuple[Waypoint, ...]) -> tuple[Waypoint, ...]:
        """Returns where to search. Raises BadSetting for points that are none."""
        if not self.points:
            return mission
        try:
            pairs = [tuple(float(word) for word in one.split(",")) for one in self.points.split(";")]
            return tuple(Waypoint(lat_deg, lon_deg) for lat_deg, lon_deg in pairs)
        except ValueError:
            raise BadSetting(f"points: {self.points!r} is not LAT,LON;LAT,LON;...") from None


_DEFAULT: Final = ChallengeSettings()


def _text(name: str, label: str, about: str, **more: Any) -> ControllerSetting:
    default = getattr(_DEFAULT, name)
    return ControllerSetting(
        name=name, kind=more.pop("kind", SettingKind.TEXT), default=default, label=label, about=about, **more
    )


def _number(
    name: str, label: str, about: str, unit: str, bounds: tuple[float, float], **more: Any
) -> ControllerSetting:
    return ControllerSetting(
        name=name,
        kind=SettingKind.NUMBER,
        default=getattr(_DEFAULT, name),
        label=label,
        about=about,
        unit=unit,
        least=bounds[0],
        most=bounds[1],
        **more,
    )


SETTINGS: Final = (
    _text(
        "letter",
        "Characters sought",
        "One to three capital letters or digits on the target. Empty: the first target that is seen.",
        characters=CHARACTERS,
        most_characters=MAX_CHARACTERS,
    ),
    _text(
        "target",
        "Kind of target",
        "squares; colours and sides from the outermost square in; or a marker’s family, number and side.",
        choices=(SQUARES, "white 2, any 1", "apriltag-36h11 7 0.5"),
        most_characters=120,
    ),
    _number("search_height_m", "Search height", "Above home.", "m", (2.0, 60.0)),
    _number("search_speed_m_s", "Search speed", "Pictures blur when it is fast.", "m/s", (0.5, 10.0)),
    _number("drop_height_m", "Drop height", "Above home, over the target.", "m", (1.0, 60.0)),
    _number(
        "around_m",
        "Search around the start",
        "How far to each side, if no mission is on board. 0: it needs a mission.",
        "m",
        (0.0, 100.0),
    ),
    _text(
        "points",
        "Places to search",
        "LAT,LON;LAT,LON;... in degrees, in place of the mission. Empty: the mission on board.",
        is_rare=True,
    ),
    _text("camera", "Camera", "It must look straight down.", kind=SettingKind.CAMERA, is_rare=True),
    _text(
        "alphabet",
        "Characters that occur",
        "Fewer are told apart better.",
        characters=CHARACTERS,
        most_characters=len(CHARACTERS),
        is_rare=True,
    ),
    _number("centred_m", "Centred within", "Of the target, before the drop.", "m", (0.05, 5.0), is_rare=True),
    _number("search_s", "Time to search", "Then it returns.", "s", (1.0, 600.0), is_rare=True),
    _number(
        "centre_s", "Time to centre", "Above a target, and again on the way down.", "s", (1.0, 600.0), is_rare=True
    ),
    _number("home_s", "Time to return", "Then the drone holds.", "s", (1.0, 300.0), is_rare=True),
)
"""In the order of the form."""
