"""Drones that follow another: tells their agents where the leader is, and stops what may not go on. A part of the hub.

Laws, each with a test:
- A follower's agent hears of its leader five times a second, with the newest that the tower has and how old that is.
- Who asked for it must be allowed to see the leader all the time, and the place must be within the limits of a loan.
- Nobody follows a drone that follows, and two that follow the same one have places apart.
"""

from dataclasses import dataclass
from typing import Final

from server.accounts.sessions import Principal
from server.operations.desk import OperationDesk
from server.operations.operation import Operation
from server.relay.live_drone import LiveDrone
from server.relay.live_state import LiveState
from server.separation.motion import METRES_PER_DEGREE, Motion, motion_in
from wire.following import FollowWork, LeaderPosition, is_apart
from wire.ids import DroneId
from wire.lateness import stamp_ms

EVERY_S: Final = 0.2
_EARLY_S: Final = 0.05
"""Half a tick of the hub: what is due before the next one goes now."""
_LARGEST_AGE_MS: Final = 3_600_000


@dataclass
class Following:
    """What the tower has to know of it. `stopped`: why the tower itself ended it, for people."""

    leader_id: DroneId
    work: FollowWork
    asked_by: Principal
    stopped: str = ""
    number: int = 0
    next_at: float = float("-inf")


class FollowFeed:
    """One for the hub. Call `tick` several times a second, after the desk's own."""

    def __init__(self, state: LiveState, desk: OperationDesk) -> None:
        self._state = state
        self._desk = desk
        self._running: dict[DroneId, tuple[Operation, Following]] = {}
        """By the follower."""

    def began(self, operation: Operation, following: Following) -> None:
        """From now on its agent is told."""
        self._running[operation.drone_id] = (operation, following)

    def leader_of(self, drone_id: DroneId) -> Following | None:
        """Whom this drone follows now."""
        operation, following = self._running.get(drone_id, (None, None))
        return following if operation is not None and operation.running else None

    def followers_of(self, drone_id: DroneId) -> dict[DroneId, Following]:
        """Who follows this drone now."""
        running = ((one, self.leader_of(one)) for one in self._running)
        return {one: following for one, following in running if following and following.leader_id == drone_id}

    def taken_place(self, leader_id: DroneId, work: FollowWork) -> DroneId | None:
        """Whose place at this leader is too near to that one."""
        for drone_id, other in self.followers_of(leader_id).items():
            there = other.work
            gaps = (work.north_m - there.north_m, work.east_m - there.east_m, work.up_m - there.up_m)
            if not is_apart(*gaps):
                return drone_id
        return None

    def tick(self, now: float) -> None:
        """Tells those that are due, and stops those that may not go on."""
        for drone_id, (operation, following) in list(self._running.items()):
            drone = self._state.drones.get(drone_id)
            if not operation.running or drone is None:
                del self._running[drone_id]
            elif not operation.cancelling and now >= following.next_at - _EARLY_S:
                following.next_at = max(now, following.next_at + EVERY_S) if following.number else now + EVERY_S
                self._look(drone, operation, following, now)

    def _look(self, drone: LiveDrone, operation: Operation, following: Following, now: float) -> None:
        leader = self._state.drones.get(following.leader_id)
        why = why_not_seen(leader, following) or why_beyond(drone, leader, following, now)
        if why is not None:
            following.stopped = why
            self._desk.cancel(operation)
        elif leader is not None and drone.link is not None and isinstance(operation.step.work, FollowWork):
            told = self._position(leader, operation, following, now)
            if told is not None:
                drone.link.send_newest(told, now)

    @staticmethod
    def _position(leader: LiveDrone, operation: Operation, following: Following, now: float) -> LeaderPosition | None:
        motion = motion_of(leader)
        if motion is None:
            return None
        following.number += 1
        # While nobody hears it, nobody knows that it has landed: its position gets old, and says that.
        on_ground = leader.link is not None and leader.autopilot_heard and not leader.airborne
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
            age_ms=min(max(0, round((now - motion.at) * 1000)), _LARGEST_AGE_MS),
            airborne=not on_ground,
        )


def motion_of(drone: LiveDrone) -> Motion | None:
    """The newest that was heard of where it is, however old."""
    return None if drone.position_frame is None else motion_in(drone.position_frame, drone.position_at)


def why_not_seen(leader: LiveDrone | None, following: Following) -> str | None:
    """Why whoever asked may not know where the leader is, or None."""
    viewer = following.asked_by
    seen = leader is not None and leader.may_be_seen_by(viewer.user_id, viewer.role)
    if leader is None or not seen or leader.blind_user_id == viewer.user_id:
        return f"{following.work.leader_name} is not yours to see any more"
    return None


def why_beyond(drone: LiveDrone, leader: LiveDrone | None, following: Following, now: float) -> str | None:
    """Why the limits of a loan do not allow the place where it would be now, or None."""
    limits = drone.limits_of(following.asked_by.user_id, following.asked_by.role)
    if limits is None or not limits.in_space:
        return None
    motion = None if leader is None else motion_of(leader)
    if drone.home is None or motion is None:
        return "where that is within the limits of the loan is not known"
    work, home = following.work, drone.home
    lat_deg = motion.lat_deg + work.north_m / METRES_PER_DEGREE
    reach_m = home.distance_m(lat_deg, motion.lon_deg) + abs(work.east_m)
    if limits.max_height_m is not None and motion.alt_amsl_m + work.up_m - home.alt_amsl_m > limits.max_height_m:
        return f"the place is above the {limits.max_height_m:.0f} m of the loan"
    if limits.radius_m is not None and reach_m > limits.radius_m:
        return f"the place is further from home than the {limits.radius_m:.0f} m of the loan"
    return None
