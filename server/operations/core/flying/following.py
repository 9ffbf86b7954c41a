"""The command to follow another drone: who may be followed, and the order for it. Nothing is sent here."""

from __future__ import annotations

from typing import Final

from server.kernel.people import Principal
from server.kernel.refusal import Refusal
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.core.flying.bodies import Follow
from server.operations.core.flying.steps import step_of
from server.operations.core.flying.vehicle import NotKnownHow, Vehicle
from server.operations.core.follow_feed import Following, motion_of, why_beyond, why_in_zone
from server.operations.core.operation import Lane, Order, Step, WorkName
from server.operations.core.refusals import DroneBusy, LoanForbids
from wire.autopilots.profile import mode_step
from wire.following import APART_M, FOLLOW, FollowWork, is_apart
from wire.ids import DroneId
from wire.transactions import Outcome

STALE_S: Final = 2.0


class NoSuchLeader(Refusal):
    """Nor one that this user may not see: one answer for both."""

    def __init__(self) -> None:
        super().__init__("there is no such drone to follow")


class CannotFollow(Refusal):
    """This drone that one, now."""


def follow_order(
    hub: Hub, principal: Principal, drone: LiveDrone, request: Follow, now: float
) -> tuple[Order, Following]:
    """Raises NoSuchLeader, CannotFollow, DroneBusy, LoanForbids, and what Vehicle raises."""
    name = drone.record.name
    leader = hub.squads.drone(DroneId(request.leader), principal.user_id, principal.role)
    if leader is None or leader.user_without_view == principal.user_id:
        raise NoSuchLeader
    leads = leader.record.name
    work = FollowWork(leads[:80], request.north_m, request.east_m, request.up_m)
    following = Following(leader.drone_id, work, principal)
    vehicle = Vehicle.of(drone, now)
    _refuse(hub, drone, leader, work, now)
    beyond = why_beyond(drone, motion_of(leader), following)
    if beyond is not None:
        raise LoanForbids(name, f"with limits: {beyond}")
    in_zone = why_in_zone(drone, motion_of(leader), following)
    if in_zone is not None:
        raise CannotFollow(f"{name} cannot follow: {in_zone}")

    about: dict[str, object] = request.model_dump() | {"leader_name": leads}
    return order_for(vehicle, following, request.for_s, work=FOLLOW, needs=FOLLOW, about=about), following


def order_for(
    vehicle: Vehicle, following: Following, for_s: float, *, work: WorkName, needs: str, about: dict[str, object]
) -> Order:
    """Into the mode that takes targets, and then to the place. `work`, `needs`, `about`: of the order. Raises
    NotKnownHow."""

    def result_text(step: Step, outcome: Outcome, words: str, seen: bool | None) -> str:
        why = f" {following.stopped}." if following.stopped else ""
        where = "" if isinstance(step.work, FollowWork) else f", {step.phase}"
        return f"{vehicle.name}{where}:{why} {words}"

    mode = vehicle.profile.roles.targets
    if mode is None:
        raise NotKnownHow(f"{vehicle.name} flies {vehicle.profile.label}, which cannot follow")
    steps = [step_of(mode_step(mode, vehicle.state)), Step(following.work, for_s)]
    return Order(
        work, Lane.FOLLOWING, steps, writes=True, overrules=True, needs=needs, result_text=result_text, about=about
    )


def _refuse(hub: Hub, drone: LiveDrone, leader: LiveDrone, work: FollowWork, now: float) -> None:
    name, leads = drone.record.name, leader.record.name
    if leader is drone:
        raise CannotFollow(f"{name} cannot follow itself")
    if not is_apart(work.north_m, work.east_m, work.up_m):
        raise CannotFollow(f"that is too near to {leads}: {APART_M:g} m away, or higher or lower, is the least")
    refuse_busy(hub, drone)
    other = hub.follows.leader_of(leader.drone_id)
    if other is not None:
        whom = other.work.leader_name
        raise CannotFollow(f"{leads} follows {whom} itself: {name} can follow one that follows nobody")
    if hub.follows.taken_place(leader.drone_id, work) is not None:
        raise CannotFollow(f"that place is too near to another drone that follows {leads}")
    if leader.online and leader.airborne is None:
        raise CannotFollow(f"it is not known whether {leads} is in the air: its autopilot is silent")
    if not leader.online or not leader.airborne:
        raise CannotFollow(f"{leads} is not in the air: there is nobody to follow")
    if motion_of(leader) is None or now - leader.position_at > STALE_S:
        raise CannotFollow(f"no position of {leads} within {STALE_S:g} s")


def refuse_busy(hub: Hub, drone: LiveDrone) -> None:
    """Raises DroneBusy or CannotFollow if the drone cannot follow."""
    name = drone.record.name
    own = hub.follows.leader_of(drone.drone_id)
    if own is not None:
        raise DroneBusy(f"{name} follows {own.work.leader_name}: stop that first")
    if hub.follows.followers_of(drone.drone_id):
        raise CannotFollow(f"{name} is followed by another drone, and can follow nobody")
    if drone.airborne is None:
        raise CannotFollow(f"it is not known whether {name} is in the air: its autopilot is silent")
    if not drone.airborne:
        raise CannotFollow(f"{name} is not in the air: take off first")
