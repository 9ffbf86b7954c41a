"""The tower's zones on board: whether a way leads into one, and how fast a drone may fly towards its edge. No I/O;
takes `now`.

It judges as the tower judges a go-to (`wire.zones.ways`): the straight way, with its heights; a way out of a zone is
free. Zones come and go with their times and with each message of the tower.
"""

from dataclasses import replace
from math import cos, hypot, inf, radians
from typing import Final

from onboard_agent.autonomy.core.course import Setpoint, Velocity
from onboard_agent.autonomy.core.local_plane import METRES_PER_DEGREE
from onboard_agent.autonomy.core.position import PositionTrack
from onboard_agent.autonomy.core.safe_commands import SHRINKS_PER_S, Goal, Judged, MoveGoal, PlaceGoal, turned
from wire.zones.index import NO_ZONES, ZoneIndex
from wire.zones.kinds import ZoneRule
from wire.zones.nearby import NearbyZone, NearbyZones
from wire.zones.track import Crossing, Spot
from wire.zones.ways import crossings_of, words_of
from wire.zones.zone import Zone, ZoneShape

MIN_SPEED_M_S: Final = 0.01

Vector = tuple[float, float, float]
"""North, east and up: m/s, or metres from the start and above home."""


class ZoneGuard:
    """`position`: of the drone, as the flight follows it."""

    def __init__(self, position: PositionTrack) -> None:
        self._position = position
        self._all: list[tuple[Zone, float, float]] = []
        """With when each begins and ends."""
        self._middle: tuple[float, float] | None = None
        self._radius_m = 0.0
        self._index = NO_ZONES
        self._index_until = inf

    def told(self, message: NearbyZones, at: float) -> None:
        """Takes the tower's message, which replaces the one before. `at`: when it came."""
        self._all = [(_zone(one), *_times(one, at)) for one in message.zones]
        self._middle = (message.lat_e7 / 1e7, message.lon_e7 / 1e7) if message.radius_m > 0 else None
        self._radius_m = message.radius_m
        self._index_until = -inf

    def judged(self, judged: Judged, heading_deg: float, now: float) -> Judged:
        """Returns the judgement of a direction with the zones: a place behind an edge is refused, and of a velocity
        that leads over one the words say where the drone stops."""
        goal = judged.goal
        if isinstance(goal, PlaceGoal):
            why = self.why_not_goal(goal, now)
            return Judged(None, why) if why else judged
        if not isinstance(goal, MoveGoal):
            return judged
        velocity = (*turned(goal.forward_m_s, goal.right_m_s, heading_deg), goal.up_m_s)
        crossing = self._ahead(velocity, goal.until - now, now)
        if crossing is None:
            return judged
        return Judged(goal, f"it stops at the edge, because the way {words_of(crossing.zone)}", bounded=True)

    def why_not_goal(self, goal: Goal, now: float) -> str:
        """Returns what forbids the way from here to a goal; empty: nothing. A turn on the spot is free everywhere."""
        if not isinstance(goal, PlaceGoal) or goal.heading_deg is not None:
            return ""
        return self.why_not((goal.north_m, goal.east_m, goal.height_m), now)

    def why_not_up(self, height_m: float, now: float) -> str:
        """Returns what forbids a climb to this height; empty: nothing."""
        motion = self._position.motion
        return "" if motion is None else self.why_not((motion.north_m, motion.east_m, height_m), now)

    def why_not(self, place: Vector, now: float) -> str:
        """Returns what forbids the straight way from here to `place`; empty: nothing."""
        index, here = self._now(now), self._here()
        if here is None or self._middle is None:
            return ""
        to = self._spot(place)
        if self._is_beyond(to):
            return "it is not known on board which zones there are"
        crossing = next(iter(crossings_of(index, here, to)), None) if index else None
        return "" if crossing is None else f"the way {words_of(crossing.zone)}"

    def bounded(self, setpoint: Setpoint, now: float) -> Setpoint:
        """Returns the set-point with a speed at which the drone still stops in front of an edge."""
        if not isinstance(setpoint, Velocity):
            return setpoint
        velocity = (setpoint.north_m_s, setpoint.east_m_s, setpoint.up_m_s)
        crossing = self._ahead(velocity, 1.0 / SHRINKS_PER_S, now) if hypot(*velocity) >= MIN_SPEED_M_S else None
        if crossing is None:
            return setpoint
        north, east, up = (part * crossing.span[0] for part in velocity)
        return replace(setpoint, north_m_s=north, east_m_s=east, up_m_s=up)

    def _ahead(self, velocity: Vector, for_s: float, now: float) -> Crossing | None:
        index, motion, here = self._now(now), self._position.motion, self._here()
        if not index or motion is None or here is None:
            return None
        place = (motion.north_m, motion.east_m, motion.height_m)
        north, east, up = (at + part * for_s for at, part in zip(place, velocity, strict=True))
        return next(iter(crossings_of(index, here, self._spot((north, east, up)))), None)

    def _now(self, now: float) -> ZoneIndex:
        """The zones that count at this moment."""
        if now >= self._index_until:
            counting = [zone for zone, begins_at, ends_at in self._all if begins_at <= now < ends_at]
            changes = [at for _, begins_at, ends_at in self._all for at in (begins_at, ends_at) if at > now]
            self._index = ZoneIndex(counting) if counting else NO_ZONES
            self._index_until = min(changes, default=inf)
        return self._index

    def _here(self) -> Spot | None:
        motion = self._position.motion
        return None if motion is None else self._spot((motion.north_m, motion.east_m, motion.height_m))

    def _spot(self, place: Vector) -> Spot:
        north_m, east_m, height_m = place
        assert self._position.plane is not None
        lat_deg, lon_deg = self._position.plane.on_map(north_m, east_m)
        return Spot(lat_deg, lon_deg, height_m, self._position.home_alt_m + height_m)

    def _is_beyond(self, to: Spot) -> bool:
        assert self._middle is not None
        north = (to.lat_deg - self._middle[0]) * METRES_PER_DEGREE
        east = (to.lon_deg - self._middle[1]) * METRES_PER_DEGREE * cos(radians(to.lat_deg))
        return hypot(north, east) > self._radius_m


def _times(one: NearbyZone, at: float) -> tuple[float, float]:
    begins_at = -inf if one.begins_in_s is None else at + one.begins_in_s
    return begins_at, inf if one.ends_in_s is None else at + one.ends_in_s


def _zone(one: NearbyZone) -> Zone:
    points = tuple((lat / 1e7, lon / 1e7) for lat, lon in one.points_e7)
    return Zone(
        id=one.id,
        name=one.name,
        kind=one.kind,
        rule=ZoneRule.REFUSE,
        shape=ZoneShape(points=points, width_m=one.width_m),
        team_id=one.group or None,
        floor_m=one.floor_m,
        ceiling_m=one.ceiling_m,
        height_above=one.height_above,
        reason=one.reason,
    )
