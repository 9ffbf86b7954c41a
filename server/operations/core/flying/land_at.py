"""The command to land at a place: a go-to, then a landing once the drone has arrived. Nothing is sent here.

Rules, each tested:

- The landing is sent only after the drone has stood at the place for a while, by positions that are fresh.
- Until then the drone must stay in the mode that flies to targets: a failsafe, a pilot's switch or a hold changes it,
  and nothing more is sent.
- A link that stays away, a drone that is on the ground, and a time limit end it too. The drone then does what the go-to
  makes it do: it flies to the place and stays there.
"""

from __future__ import annotations

from math import cos, hypot, radians
from typing import Final

from server.airspace.core.separation.motion import METRES_PER_DEGREE, motion_in
from server.control.core.loan_limits import whole_place_in
from server.kernel.refusal import Refusal
from server.live.live_drone import LiveDrone
from server.operations.core.flying.bodies import LandAt
from server.operations.core.flying.steps import ANSWER_WITHIN_S, step_of
from server.operations.core.flying.vehicle import NotKnownHow, NotKnownYet, Vehicle
from server.operations.core.operation import Lane, Order, Step, Wait
from wire.autopilots import commands
from wire.autopilots.profile import FlightMode
from wire.transactions import Outcome

ARRIVED_M: Final = 3.0
"""From the place, over ground and in height."""
STANDS_M_S: Final = 1.0
STANDS_FOR_S: Final = 2.0
"""From one position to a later one."""
FRESH_S: Final = 3.0
"""An older position or heartbeat says nothing."""
MODE_WITHIN_S: Final = 3.0
"""In which a heartbeat shows the mode that the go-to has changed to."""
LINK_PATIENCE_S: Final = 10.0
SLOWEST_M_S: Final = 1.0
EXTRA_S: Final = 120.0
LONGEST_S: Final = 3600.0


class NotInTheAir(Refusal):
    """On the ground, or not known to be in the air."""

    def __init__(self, name: str, *, known: bool) -> None:
        if known:
            super().__init__(f"{name} is not in the air: take off first")
        else:
            super().__init__(f"it is not known whether {name} is in the air: its autopilot is silent")


def land_at_order(drone: LiveDrone, body: LandAt, now: float) -> Order:
    """Raises NotInTheAir, NotKnownHow, NotKnownYet."""
    vehicle = Vehicle.of(drone, now)
    name, targets, here = vehicle.name, vehicle.profile.roles.targets, vehicle.state.place_deg
    go_to = vehicle.steps(commands.GoTo(body.lat, body.lon, body.height_m, body.speed_m_s))
    (land,) = vehicle.steps(commands.Land())
    if targets is None:
        raise NotKnownHow(f"{name} flies {vehicle.profile.label}, which cannot land at a place")
    if not drone.airborne:
        raise NotInTheAir(name, known=drone.airborne is False)
    if here is None:
        raise NotKnownYet(f"the position of {name} is not known yet")

    def result_text(step: Step, outcome: Outcome, words: str, seen: bool | None) -> str:
        if outcome is Outcome.DONE and seen is None:
            return f"{name} accepted, now {step.phase}."
        return f"{name}, {step.phase}: {words}"

    approach = Approach(drone, body, targets, way_m=_metres(here, (body.lat, body.lon)))
    return Order(
        "land_at",
        Lane.COMMANDS,
        [*(step_of(one) for one in go_to), Step(land.work, ANSWER_WITHIN_S, "landing there", waits=approach)],
        writes=True,
        overrules=True,
        result_text=result_text,
        about=body.model_dump(exclude_none=True),
    )


class Approach:
    """Waits until the drone stands at the place. `way_m`: over ground, from where it begins."""

    def __init__(self, drone: LiveDrone, body: LandAt, targets: FlightMode, *, way_m: float) -> None:
        self._drone = drone
        self._place = (body.lat, body.lon)
        self._height_m = body.height_m
        self._targets = targets
        self._way_m = way_m
        self._limit_s = min(LONGEST_S, EXTRA_S + way_m / SLOWEST_M_S)
        self._began_at: float | None = None
        self._linked_at = 0.0
        self._stands_since: float | None = None

    def __call__(self, now: float) -> Wait | None:
        """None: it stands there, and may land."""
        drone = self._drone
        if self._began_at is None:
            self._began_at = self._linked_at = now
        if drone.link is not None and drone.link.has_channel:
            self._linked_at = now
        why_not = self._why_not(now, self._began_at)
        if why_not:
            return Wait(failed=why_not)
        left_m = self._left_m(now)
        if left_m is None or not self._stands_there(left_m, now):
            self._stands_since = None
        elif self._stands_since is None:
            self._stands_since = drone.position_at
        elif drone.position_at - self._stands_since >= STANDS_FOR_S:
            return None
        if left_m is None:
            return Wait("on the way there: its position is not known now")
        phase = f"on the way there, {left_m:.0f} m left: then it lands"
        return Wait(phase, max(0, round(self._way_m - left_m)), round(self._way_m))

    def _why_not(self, now: float, began_at: float) -> str:
        drone = self._drone
        name = drone.record.name
        if drone.airborne is False or drone.armed is False:
            return f"{name} is on the ground."
        if now - self._linked_at > LINK_PATIENCE_S:
            return f"The link to {name} was lost on the way."
        if now - began_at > self._limit_s:
            return f"{name} did not arrive within {self._limit_s:.0f} s."
        if drone.heartbeat_at - began_at > MODE_WITHIN_S and not self._is_in_mode(now):
            return f"{name} left the mode {self._targets.name}."
        return ""

    def _is_in_mode(self, now: float) -> bool:
        if self._drone.heartbeat is None:
            return False
        return Vehicle.of(self._drone, now).state.custom_mode == self._targets.custom_mode

    def _left_m(self, now: float) -> float | None:
        frame = self._drone.position_frame
        place = None if frame is None or now - self._drone.position_at > FRESH_S else whole_place_in(frame)
        return None if place is None else _metres((place.lat_deg, place.lon_deg), self._place)

    def _stands_there(self, left_m: float, now: float) -> bool:
        frame = self._drone.position_frame
        place = None if frame is None else whole_place_in(frame)
        motion = None if frame is None else motion_in(frame, now)
        if place is None or motion is None or now - self._drone.heartbeat_at > FRESH_S or not self._is_in_mode(now):
            return False
        near = left_m <= ARRIVED_M and abs(place.alt_rel_m - self._height_m) <= ARRIVED_M
        return near and hypot(motion.north_m_s, motion.east_m_s, motion.up_m_s) <= STANDS_M_S


def _metres(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Over ground; good for the few kilometres of a flight."""
    north = other[0] - one[0]
    east = ((other[1] - one[1] + 180.0) % 360.0 - 180.0) * cos(radians(one[0]))
    return hypot(north, east) * METRES_PER_DEGREE
