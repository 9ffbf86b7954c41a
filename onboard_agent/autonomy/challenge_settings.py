"""The settings of the controller `challenge`, from the request that starts it. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

from onboard_agent.autonomy.core.lines import Waypoint
from onboard_agent.vision.letter_reading import CHARACTERS, MAX_CHARACTERS
from onboard_agent.vision.target_kind import SQUARES, BadKind, parse_kind


class BadSetting(ValueError):
    """One line for people."""


@dataclass(frozen=True, slots=True)
class ChallengeSettings:
    """Heights in metres above home, m/s, seconds. `target`: its kind, as `parse_kind` reads it. `letter`: one to three
    characters that are sought; empty: any target. `alphabet`: the characters that occur. `points`: `LAT,LON` pairs
    between semicolons, in place of the mission on board."""

    target: str = SQUARES
    letter: str = ""
    alphabet: str = CHARACTERS
    camera: str = ""
    points: str = ""
    search_height_m: float = 10.0
    search_speed_m_s: float = 3.0
    drop_height_m: float = 3.0
    centred_m: float = 0.35
    search_s: float = 300.0
    centre_s: float = 60.0
    home_s: float = 120.0

    @classmethod
    def of(cls, given: Mapping[str, str | float]) -> ChallengeSettings:
        """Raises BadSetting."""
        kinds = {one.name: str if isinstance(one.default, str) else float for one in fields(cls)}
        values: dict[str, str | float] = {}
        for name, value in given.items():
            if name not in kinds:
                raise BadSetting(f"there is no setting {name}; known: {', '.join(kinds)}")
            try:
                values[name] = kinds[name](value)
            except ValueError:
                raise BadSetting(f"{name}: {value!r} is no number") from None
        made = cls(**values)  # type: ignore[arg-type]
        positive = (made.search_height_m, made.search_speed_m_s, made.drop_height_m, made.centred_m)
        if not all(value > 0.0 for value in (*positive, made.search_s, made.centre_s, made.home_s)):
            raise BadSetting("heights, speeds, times and distances must be above 0")
        if made.drop_height_m > made.search_height_m:
            raise BadSetting("drop_height_m is above search_height_m")
        try:
            kind = parse_kind(made.target)
        except BadKind as error:
            raise BadSetting(str(error)) from None
        if not made.alphabet or not set(made.alphabet) <= set(CHARACTERS):
            raise BadSetting("alphabet: it is made of capital letters and digits")
        if made.letter and not kind.has_text:
            raise BadSetting("letter: a marker has none; its number is in target")
        if len(made.letter) > MAX_CHARACTERS or not set(made.letter) <= set(made.alphabet):
            raise BadSetting(f"letter: {made.letter!r} is not 1 to {MAX_CHARACTERS} characters of {made.alphabet}")
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
