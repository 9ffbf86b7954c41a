"""The built-in controller `challenge`: searches for a target along the mission, drops the payload over it, comes home.

    TAKE_OFF -> SEARCH -> APPROACH -> DESCEND -> DROP -> RETURN -> LAND
                   ^----------+   another letter, or none to be read
                   +--> RETURN    nothing found, or its time is over

In the air it begins with SEARCH. Every stage has a time; when it is over, the drone returns and says why.
"""

from __future__ import annotations

from enum import StrEnum
from math import cos, hypot, radians, sin
from typing import Final

from onboard_agent.autonomy.challenge_settings import SETTINGS, ChallengeSettings
from onboard_agent.autonomy.controller import (
    Controller,
    Direction,
    DirectionState,
    Drop,
    Found,
    GoBy,
    GoTo,
    Hold,
    Land,
    Seen,
    SetUp,
    TakeOff,
    Waypoint,
)
from onboard_agent.autonomy.core.local_plane import LocalPlane
from onboard_agent.autonomy.search_pattern import square_spiral
from onboard_agent.autonomy.target_estimate import TargetEstimate
from onboard_agent.autonomy.target_watch import TargetSeen, TargetWatch
from onboard_agent.vision.letter_reading import may_be

APPROACH_SPEED_M_S: Final = 1.5
DESCENT_STEP_M: Final = 3.0
REJECTED_WITHIN_M: Final = 4.0
"""Of a target with another letter: this is the same one again."""
READ_WITHIN_S: Final = 12.0
"""Above a target. A letter that is not read by then does not count."""
CENTRED_TIMES: Final = 3
LANES: Final = 0.8
"""Between two lanes of a search, as a share of its height: a lens of 60 degrees sees 1.15 of it across."""
CORNER: Final = 0.7
"""How far the side of a square is, as a share of its corner's distance."""
STILL_M_S: Final = 0.25


class Stage(StrEnum):
    """For people, too."""

    TAKE_OFF = "taking off"
    SEARCH = "searching"
    APPROACH = "centring over a target"
    DESCEND = "descending"
    DROP = "dropping"
    RETURN = "returning"
    LAND = "landing"


class ChallengeFailed(Exception):
    """The drone holds, because it cannot even return."""


class Challenge(Controller):
    """One direction at a time; each step looks at what the watch has seen since the last one."""

    make_watch = TargetWatch
    described_settings = SETTINGS

    def begin(self, limits: SetUp) -> None:
        """Raises BadSetting, and ChallengeFailed without a camera or anywhere to search."""
        self.settings = ChallengeSettings.of(limits.settings)
        self.limits = limits
        self.ways = list(self.settings.waypoints(limits.mission))
        if not self.ways and not self.settings.around_m:
            raise ChallengeFailed("there is no mission on board, and neither points nor around_m is set")
        name = self.settings.camera or next(iter(self.cameras.settings), "")
        if name not in self.cameras.settings:
            raise ChallengeFailed("it needs a camera: set controller_cameras in agent.toml")
        self.watch = self.make_watch(self.cameras, name, self.settings.target, self.settings.alphabet)
        self.watch.start()
        self.estimate = TargetEstimate()
        self.stage = Stage.TAKE_OFF
        self.stage_at_s = 0.0
        self.search_ends_s = float("inf")
        self.given = 0
        self.next_way = 0
        self.home: tuple[float, float] | None = None
        self.rejected: list[tuple[float, float]] = []
        self.centred = 0
        self.dropped = False
        self.outcome = ""

    # The step.

    def step(self, seen: Seen) -> Direction | None:
        """Returns the next direction of the stage."""
        if self.home is None:
            self.home = (seen.lat_deg, seen.lon_deg)
            self.plane = LocalPlane(*self.home)
            self.ways = self.ways or self._spiral()
            self._enter(Stage.SEARCH if seen.airborne else Stage.TAKE_OFF, seen)
        for one in self.watch.pop():
            self.estimate.add(one, self.plane)
            self._show(one)
        if self.watch.words and self.stage in (Stage.SEARCH, Stage.APPROACH, Stage.DESCEND):
            return self._go_home(f"the vision failed: {self.watch.words}", seen)
        if seen.number < self.given:
            return None  # the last direction is not acknowledged yet
        direction = self._next(seen)
        self.given += direction is not None
        return direction

    def _spiral(self) -> list[Waypoint]:
        """Around home, within the limits also at its corners."""
        around_m = min(self.settings.around_m, CORNER * self.limits.max_distance_m)
        corners = square_spiral(around_m, LANES * self.settings.search_height_m)
        return [Waypoint(*self.plane.on_map(*corner)) for corner in corners]

    def _next(self, seen: Seen) -> Direction | None:
        match self.stage:
            case Stage.TAKE_OFF:
                return self._take_off(seen)
            case Stage.SEARCH:
                return self._search(seen)
            case Stage.APPROACH:
                return self._approach(seen)
            case Stage.DESCEND:
                return self._descend(seen)
            case Stage.DROP:
                return self._drop(seen)
            case Stage.RETURN:
                return self._return(seen)
            case Stage.LAND:
                if seen.state is DirectionState.REFUSED:
                    raise ChallengeFailed(seen.words)
                return None

    def _enter(self, stage: Stage, seen: Seen) -> None:
        self.stage, self.stage_at_s, self.centred = stage, seen.at_s, 0
        self.fresh = True
        self.note(f"{stage}{self._which()}", False)

    def _which(self) -> str:
        return f" {self.settings.letter}" if self.settings.letter and self.stage is not Stage.TAKE_OFF else ""

    def _since(self, seen: Seen) -> float:
        return seen.at_s - self.stage_at_s

    def _first(self) -> bool:
        """Whether this stage has given no direction yet."""
        fresh, self.fresh = self.fresh, False
        return fresh

    # The stages.

    def _take_off(self, seen: Seen) -> Direction | None:
        if self._first():
            return TakeOff(self.settings.search_height_m)
        if seen.state is DirectionState.REFUSED:
            raise ChallengeFailed(f"the take-off was refused: {seen.words}")
        if seen.state is DirectionState.DONE:
            self._enter(Stage.SEARCH, seen)
            return self._search(seen)
        return None

    def _search(self, seen: Seen) -> Direction | None:
        self.search_ends_s = min(self.search_ends_s, seen.at_s + self.settings.search_s)
        if self._is_worth_a_look(seen):
            self._enter(Stage.APPROACH, seen)
            return Hold()
        if seen.at_s >= self.search_ends_s:
            return self._go_home("nothing was found in time", seen)
        if not self._first():
            if seen.state is DirectionState.FLYING:
                return None
            if seen.state is DirectionState.REFUSED:
                self.note(f"way-point {self.next_way} was left out: {seen.words}", True)
        if self.next_way >= len(self.ways):
            return self._go_home("nothing was found", seen)
        way = self.ways[self.next_way]
        self.next_way += 1
        self.note(f"{self.stage}{self._which()}, way-point {self.next_way} of {len(self.ways)}", False)
        height = self.settings.search_height_m
        return GoTo(way.lat_deg, way.lon_deg, height, self.settings.search_speed_m_s, within_s=120.0)

    def _is_worth_a_look(self, seen: Seen) -> bool:
        place = self.estimate.place(seen.at_s)
        if place is None:
            return False
        if self._is_other():
            self._reject(place)
            return False
        return all(hypot(place[0] - one[0], place[1] - one[1]) > REJECTED_WITHIN_M for one in self.rejected)

    def _is_other(self) -> bool:
        letter = self.estimate.letter
        return bool(self.settings.letter) and letter is not None and not may_be(letter, self.settings.letter)

    def _reject(self, place: tuple[float, float]) -> None:
        self.rejected.append(place)
        self.estimate.clear()

    def _approach(self, seen: Seen) -> Direction | None:
        place = self.estimate.place(seen.at_s)
        if place is not None and self._is_other():
            self._reject(place)
            return self._search_on(seen)
        if self._since(seen) > self.settings.centre_s or (place is None and self._since(seen) > READ_WITHIN_S):
            return self._search_on(seen)
        if place is None:
            return None
        if self.settings.letter and self.estimate.letter is None and self._since(seen) > READ_WITHIN_S:
            self._reject(place)
            return self._search_on(seen)
        if not self._is_centred(place, seen):
            return self._move_over(place, 0.0, seen)
        if self.settings.letter and self.estimate.letter is None:
            return None
        self._report(place)
        self._enter(Stage.DESCEND, seen)
        return self._descend(seen)

    def _search_on(self, seen: Seen) -> Direction | None:
        """Back to the way-point that was flown to."""
        self.next_way = max(self.next_way - 1, 0)
        self._enter(Stage.SEARCH, seen)
        return self._search(seen)

    def _descend(self, seen: Seen) -> Direction | None:
        place = self.estimate.place(seen.at_s)
        if self._since(seen) > self.settings.centre_s:
            return self._go_home("the target was lost on the way down", seen)
        if place is None:
            return None
        above_m = seen.height_m - self.settings.drop_height_m
        if above_m > 0.4:
            return self._move_over(place, -min(above_m, DESCENT_STEP_M), seen)
        if not self._is_centred(place, seen):
            return self._move_over(place, -above_m, seen)
        self._report(place)
        self._enter(Stage.DROP, seen)
        return self._drop(seen)

    def _drop(self, seen: Seen) -> Direction | None:
        if self._first():
            return Drop()
        if seen.state is DirectionState.FLYING:
            return None
        if seen.state is not DirectionState.DONE:
            return self._go_home(f"the payload was not dropped: {seen.words}", seen)
        self.dropped = True
        return self._go_home("the payload was dropped", seen)

    def _go_home(self, why: str, seen: Seen) -> Direction:
        self.outcome = why
        self._enter(Stage.RETURN, seen)
        self.note(f"{why}; {self.stage}", True)
        self.fresh = False
        assert self.home is not None
        within_s = min(self.settings.home_s, 300.0)
        return GoTo(*self.home, self.settings.search_height_m, self.settings.search_speed_m_s, within_s)

    def _return(self, seen: Seen) -> Direction | None:
        if seen.state is DirectionState.FLYING:
            return None
        if seen.state is not DirectionState.DONE:
            raise ChallengeFailed(f"{self.outcome}, and it did not come home: {seen.words}")
        self._enter(Stage.LAND, seen)
        self.note(f"{self.outcome}; {self.stage}", False)
        return Land()

    # Over the target.

    def _offset(self, place: tuple[float, float], seen: Seen) -> tuple[float, float]:
        """Metres forward and right from the drone to the target."""
        north, east = self.plane.local(seen.lat_deg, seen.lon_deg)
        north, east, nose = place[0] - north, place[1] - east, radians(seen.heading_deg)
        return north * cos(nose) + east * sin(nose), east * cos(nose) - north * sin(nose)

    def _is_centred(self, place: tuple[float, float], seen: Seen) -> bool:
        off_m = hypot(*self._offset(place, seen))
        still = hypot(seen.north_m_s, seen.east_m_s, seen.up_m_s) < STILL_M_S
        self.centred = self.centred + 1 if still and off_m <= self.settings.centred_m else 0
        return self.centred >= CENTRED_TIMES

    def _move_over(self, place: tuple[float, float], up_m: float, seen: Seen) -> Direction | None:
        """A new relative move once the last one is done, or the target turns out to be elsewhere."""
        if seen.state is DirectionState.FLYING and not self.fresh:
            return None
        self.fresh = False
        forward_m, right_m = self._offset(place, seen)
        if self.centred and up_m == 0.0:
            return None
        return GoBy(forward_m, right_m, up_m, APPROACH_SPEED_M_S, within_s=15.0)

    def _report(self, place: tuple[float, float]) -> None:
        lat_deg, lon_deg = self.plane.on_map(*place)
        latest = self.estimate.latest
        assert latest is not None
        letter = self.estimate.letter or ""
        confidence, thumbnail = latest.target.confidence, latest.target.thumbnail
        self.report(Found(letter, confidence, lat_deg, lon_deg, thumbnail, latest.in_video))
        self.note(f"target {letter or 'without a letter'} at {lat_deg:.7f},{lon_deg:.7f}", True)

    def _show(self, seen: TargetSeen) -> None:
        """In the live video, for those who watch."""
        if seen.in_video is not None:
            letter, confidence = self.estimate.letter or "", seen.target.confidence
            self.report(Found(letter, confidence, seen.lat_deg, seen.lon_deg, b"", seen.in_video, sighting=True))
