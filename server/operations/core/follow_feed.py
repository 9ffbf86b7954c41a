"""Sends agents the position of the drone or person that theirs follows, and ends what may not continue. Part of the
hub.

Rules, each tested:

- A follower's agent gets its leader's newest position and age five times a second.
- The requester must be allowed to see the leader throughout, and the position must be within the limits of a loan and
  in no zone that refuses the drone.
- No drone follows a follower, and two followers of one leader keep apart.
- A drone that follows a person holds when the browser that reports their position is gone.
"""

from dataclasses import dataclass
from math import cos, radians
from typing import Final

from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion, motion_in
from server.airspace.core.zones.check import zone_at
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.operations.core.operation import Operation
from server.operations.core.person import Fix, PersonTrack
from server.operations.core.service import OperationService
from wire.following import FollowWork, LeaderPosition, is_apart
from wire.ids import DroneId, UserId
from wire.lateness import stamp_ms
from wire.zones.track import Spot

EVERY_S: Final = 0.2
_EARLY_S: Final = 0.05
"""Half a tick of the hub: what is due before the next one goes now."""
_MAX_AGE_MS: Final = 3_600_000


@dataclass
class Following:
    """What the tower has to know of it. `stopped`: why the tower itself ended it, for people. A drone leads, or a
    `person`."""

    leader_id: DroneId | None
    work: FollowWork
    asked_by: Principal
    person: PersonTrack | None = None
    stopped: str = ""
    number: int = 0
    next_at: float = float("-inf")


class FollowFeed:
    """One for the hub. Call `tick` several times a second, after the service's own."""

    def __init__(self, state: LiveState, service: OperationService) -> None:
        self._state = state
        self._service = service
        self._running: dict[DroneId, tuple[Operation, Following]] = {}
        """By the follower."""

    def began(self, operation: Operation, following: Following) -> None:
        """Starts sending positions to its agent."""
        self._running[operation.drone_id] = (operation, following)

    def leader_of(self, drone_id: DroneId) -> Following | None:
        """Whom this drone follows now."""
        operation, following = self._running.get(drone_id, (None, None))
        return following if operation is not None and operation.running else None

    def followers_of(self, drone_id: DroneId) -> dict[DroneId, Following]:
        """Who follows this drone now."""
        running = ((one, self.leader_of(one)) for one in self._running)
        return {one: following for one, following in running if following and following.leader_id == drone_id}

    def with_person(self, user_id: UserId) -> DroneId | None:
        """Which drone follows this person now."""
        for drone_id in self._running:
            following = self.leader_of(drone_id)
            if following and following.person is not None and following.asked_by.user_id == user_id:
                return drone_id
        return None

    def taken_place(self, leader_id: DroneId, work: FollowWork) -> DroneId | None:
        """Whose place at this leader is too near to that one."""
        for drone_id, other in self.followers_of(leader_id).items():
            there = other.work
            gaps = (work.north_m - there.north_m, work.east_m - there.east_m, work.up_m - there.up_m)
            if not is_apart(*gaps):
                return drone_id
        return None

    def person_fix(self, drone_id: DroneId, fix: Fix, *, browser: int, asked_by: Principal) -> str | None:
        """Where the person is whom this drone follows. Why it does not count, or None."""
        following = self.leader_of(drone_id)
        if following is None or following.person is None:
            return "it follows nobody"
        return following.person.take(fix, browser=browser, sign_in=asked_by.session_id)

    def browser_gone(self, browser: int) -> None:
        """Stops sending positions."""
        for operation, following in list(self._running.values()):
            person = following.person
            if operation.running and person is not None and person.browser == browser:
                self._stop(operation, following, f"the browser of {following.work.leader_name} is gone")

    def tick(self, now: float) -> None:
        """Tells those that are due, and stops those that may not go on."""
        for drone_id, (operation, following) in list(self._running.items()):
            drone = self._state.drones.get(drone_id)
            if not operation.running or drone is None:
                del self._running[drone_id]
            elif not operation.cancelling and now >= following.next_at - _EARLY_S:
                following.next_at = max(now, following.next_at + EVERY_S) if following.number else now + EVERY_S
                self._check(drone, operation, following, now)

    def _check(self, drone: LiveDrone, operation: Operation, following: Following, now: float) -> None:
        leader = None if following.leader_id is None else self._state.drones.get(following.leader_id)
        person = following.person
        unseen = why_not_seen(leader, following) if person is None else None
        motion = _motion(leader) if person is None else person.motion()
        why = unseen or why_beyond(drone, motion, following) or why_in_zone(drone, motion, following)
        if why is not None:
            self._stop(operation, following, why)
        elif motion is not None and drone.link is not None and isinstance(operation.step.work, FollowWork):
            # A silent leader is not known to have landed: the age of its position shows the silence.
            on_ground = leader is not None and leader.airborne is False
            drone.link.send_newest(self._position(motion, operation, following, now, on_ground=on_ground), now)

    def _stop(self, operation: Operation, following: Following, why: str) -> None:
        following.stopped = following.stopped or why
        self._service.cancel(operation)

    @staticmethod
    def _position(
        motion: Motion, operation: Operation, following: Following, now: float, *, on_ground: bool
    ) -> LeaderPosition:
        following.number += 1
        return LeaderPosition(
            id=operation.transaction_id,
            number=following.number,
            sent_ms=stamp_ms(now),
            lat_e7=round(motion.lat_deg * 1e7),
            lon_e7=round(motion.lon_deg * 1e7),
            alt_amsl_mm=max(-10_000_000, min(round(motion.alt_amsl_m * 1000), 100_000_000)),
            north_cm_s=round(motion.north_m_s * 100),
            east_cm_s=round(motion.east_m_s * 100),
            down_cm_s=round(-motion.up_m_s * 100),
            age_ms=min(max(0, round((now - motion.at) * 1000)), _MAX_AGE_MS),
            airborne=not on_ground,
        )


def motion_of(drone: LiveDrone) -> Motion | None:
    """The newest known position, however old."""
    return None if drone.position_frame is None else motion_in(drone.position_frame, drone.position_at)


def _motion(leader: LiveDrone | None) -> Motion | None:
    return None if leader is None else motion_of(leader)


def why_not_seen(leader: LiveDrone | None, following: Following) -> str | None:
    """Why the requester may not know the leader's position, or None."""
    viewer = following.asked_by
    seen = leader is not None and leader.may(viewer.user_id, viewer.role, Right.SEE)
    if leader is None or not seen or leader.user_without_view == viewer.user_id:
        return f"{following.work.leader_name} is not yours to see any more"
    return None


def why_beyond(drone: LiveDrone, motion: Motion | None, following: Following) -> str | None:
    """Why the limits of a loan do not allow the place where it would be now, or None. `motion`: of who is followed."""
    limits = drone.limits_of(following.asked_by.user_id, following.asked_by.role)
    if limits is None or not limits.in_space:
        return None
    if drone.home is None or motion is None:
        return "it is not known whether that is within the limits of the loan"
    work, home = following.work, drone.home
    lat_deg = motion.lat_deg + work.north_m / METRES_PER_DEGREE
    reach_m = home.distance_m(lat_deg, motion.lon_deg) + abs(work.east_m)
    if limits.max_height_m is not None and motion.alt_amsl_m + work.up_m - home.alt_amsl_m > limits.max_height_m:
        return f"the place is above the {limits.max_height_m:.0f} m of the loan"
    if limits.radius_m is not None and reach_m > limits.radius_m:
        return f"the place is further from home than the {limits.radius_m:.0f} m of the loan"
    return None


def why_in_zone(drone: LiveDrone, motion: Motion | None, following: Following) -> str | None:
    """Which zone the place would be in where the drone would be now, or None."""
    if not drone.zones or motion is None:
        return None
    work = following.work
    east_m_per_degree = METRES_PER_DEGREE * max(0.01, cos(radians(motion.lat_deg)))
    above_sea_m = motion.alt_amsl_m + work.up_m
    spot = Spot(
        motion.lat_deg + work.north_m / METRES_PER_DEGREE,
        motion.lon_deg + work.east_m / east_m_per_degree,
        None if drone.home is None else above_sea_m - drone.home.alt_amsl_m,
        above_sea_m,
    )
    hit = zone_at(drone, spot)
    return None if hit is None else f"the way there {hit.words}"
