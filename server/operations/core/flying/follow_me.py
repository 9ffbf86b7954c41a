"""The command to follow the pilot: whether it is allowed, and its order. Sends nothing.

The drone stays on its side of the person, at the requested distance and at its present height: its path never leads
over the person, neither at the start nor when they turn round.
"""

from __future__ import annotations

from math import cos, radians, sin
from typing import Final

from server.airspace.core.separation.motion import Motion, Relative
from server.control.core.loan_limits import whole_place_in
from server.kernel.people import Principal
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.core.flying.bodies import FollowMe
from server.operations.core.flying.following import STALE_S, CannotFollow, order_for, refuse_busy
from server.operations.core.flying.vehicle import Vehicle
from server.operations.core.follow_feed import Following, motion_of, why_beyond, why_in_zone
from server.operations.core.operation import Order
from server.operations.core.person import MIN_M, Fix, PersonTrack, sure_m
from server.operations.core.refusals import LoanForbids
from wire.following import FOLLOW_PERSON, PERSON_PATIENCE_S, FollowWork

FOLLOW_ME: Final = "follow_me"
LOWEST_M: Final = 8.0
"""Above home. A fix may be wrong by as much as the drone is away: then it is above the person, and so high."""
FARTHEST_M: Final = 100.0
"""From the person, to begin with."""
_SLACK_M: Final = 0.05
"""What rounding could take from the least distance."""


def follow_me_order(
    hub: Hub, principal: Principal, drone: LiveDrone, request: FollowMe, now: float
) -> tuple[Order, Following]:
    """Raises CannotFollow, DroneBusy, LoanForbids, and what Vehicle raises."""
    name = drone.record.name
    vehicle = Vehicle.of(drone, now)
    refuse_busy(hub, drone)
    if hub.follows.with_person(principal.user_id) is not None:
        raise CannotFollow(f"another drone follows you already: {name} might come too near to it")
    if request.accuracy_m > sure_m(request.distance_m):
        raise CannotFollow(
            f"your position is accurate to {request.accuracy_m:.0f} m only: {name} needs "
            f"{sure_m(request.distance_m):.0f} m to follow you"
        )
    age_s = request.age_ms / 1000.0
    if age_s > PERSON_PATIENCE_S:
        raise CannotFollow(f"your position was measured {age_s:.0f} s ago: that is too old for {name} to follow you")
    own = motion_of(drone)
    placed = None if drone.position_frame is None else whole_place_in(drone.position_frame)
    if own is None or placed is None or now - drone.position_at > STALE_S:
        raise CannotFollow(f"no position of {name} within {STALE_S:g} s")
    if placed.alt_rel_m < LOWEST_M:
        raise CannotFollow(
            f"{name} is {placed.alt_rel_m:.1f} m above home: {LOWEST_M:g} m is the minimum to follow you"
        )
    here = Motion(request.lat, request.lon, own.alt_amsl_m, 0.0, 0.0, 0.0, own.at)
    seen = Relative.of(here, own, own.at)
    if seen.distance_m < MIN_M:
        raise CannotFollow(f"{name} is {seen.distance_m:.0f} m from you, over ground: {MIN_M:g} m are the least")
    if seen.distance_m > FARTHEST_M:
        raise CannotFollow(f"{name} is {seen.distance_m:.0f} m from you: {FARTHEST_M:g} m is the maximum to begin with")
    bearing, away_m = radians(seen.bearing_deg), request.distance_m + _SLACK_M
    work = FollowWork(principal.name[:80], away_m * cos(bearing), away_m * sin(bearing), 0.0, PERSON_PATIENCE_S)
    first = Fix(request.lat, request.lon, request.accuracy_m, now - age_s)
    person = PersonTrack(first, alt_amsl_m=own.alt_amsl_m, away_m=request.distance_m, sign_in=principal.session_id)
    following = Following(None, work, principal, person)
    beyond = why_beyond(drone, person.motion(), following)
    if beyond is not None:
        raise LoanForbids(name, f"with limits: {beyond}")
    in_zone = why_in_zone(drone, person.motion(), following)
    if in_zone is not None:
        raise CannotFollow(f"{name} cannot follow: {in_zone}")
    # The audit trail does not record where people were.
    about: dict[str, object] = {"command": FOLLOW_ME, "distance_m": request.distance_m, "leader_name": work.leader_name}
    order = order_for(vehicle, following, request.for_s, work=FOLLOW_ME, needs=FOLLOW_PERSON, about=about)
    return order, following
