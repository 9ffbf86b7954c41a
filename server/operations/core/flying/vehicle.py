"""What the tower knows of the vehicle that a command is for. Pure.

What kind it is, and how it is commanded, is its profile's (`wire.autopilots`)."""

from __future__ import annotations

from dataclasses import dataclass
from struct import Struct
from typing import Final

from server.alerts.core.kept_telemetry import MISSION_CURRENT
from server.control.core.loan_limits import whole_place_in
from server.kernel.refusal import Refusal
from server.live.live_drone import LiveDrone
from server.operations.core.onboard_state import KnownPlan
from wire.autopilots import registry
from wire.autopilots.commands import (
    CommandRefused,
    NotHeardYet,
    NotSupported,
    Steps,
    UnknownItem,
    UnknownMode,
    VehicleState,
)
from wire.autopilots.mission_state import MissionState, state_before
from wire.autopilots.pilot_command import PilotCommand
from wire.autopilots.profile import AutopilotProfile
from wire.frames import payload
from wire.plans import PlanKind

_HEARTBEAT: Final = Struct("<IBB")
_HEADING: Final = Struct("<26xH")
_NO_HEADING: Final = 0xFFFF
UNKNOWN_PLAN: Final = KnownPlan(None, None)
PLACE_STALE_S: Final = 3.0
"""A place older than this is none: a drone that was sent there would fly back."""


class NotKnownHow(Refusal):
    """This vehicle has no such thing, or the tower does not know how to ask it for it."""


class NotKnownYet(Refusal):
    """The drone has not reported something that the command needs."""


class NoSuchMode(Refusal):
    """The vehicle's autopilot."""


class NoSuchItem(Refusal):
    """Beyond the plan that is on board."""


class StateNotRestored(Refusal):
    """What earlier items of the mission set cannot be set again."""


_REFUSALS: Final[dict[type[CommandRefused], type[Refusal]]] = {
    NotSupported: NotKnownHow,
    NotHeardYet: NotKnownYet,
    UnknownMode: NoSuchMode,
    UnknownItem: NoSuchItem,
}


@dataclass(frozen=True)
class Vehicle:
    """At this moment."""

    profile: AutopilotProfile
    state: VehicleState
    plan: KnownPlan = UNKNOWN_PLAN
    """The mission on board."""
    current_item: int = 0
    """Of the mission, as the autopilot reports it, from 0 without home."""

    @classmethod
    def of(cls, drone: LiveDrone, now: float) -> Vehicle:
        """Raises NotKnownYet before a heartbeat, NotKnownHow of a vehicle that has no profile."""
        name = drone.record.name
        if drone.heartbeat is None:
            raise NotKnownYet(f"no heartbeat yet from the autopilot of {name}")
        body = payload(drone.heartbeat).ljust(_HEARTBEAT.size, b"\0")
        custom_mode, vehicle_type, autopilot = _HEARTBEAT.unpack_from(body)
        profile = registry.of(autopilot, vehicle_type)
        if profile is None:
            raise NotKnownHow(f"the tower knows no vehicle of {name}'s kind, and has no commands for it")
        plan, known = drone.onboard.plan(PlanKind.MISSION)
        frame = drone.position_frame if now - drone.position_at <= PLACE_STALE_S else None
        place = whole_place_in(frame) if frame is not None else None
        state = VehicleState(
            name=name,
            custom_mode=custom_mode,
            armed=drone.armed,
            airborne=drone.airborne,
            home_alt_m=drone.home.alt_amsl_m if drone.home is not None else None,
            place_deg=None if place is None else (place.lat_deg, place.lon_deg),
            height_m=None if place is None else place.alt_rel_m,
            heading_deg=None if frame is None else _heading_in(frame),
            mission_items=plan.count if plan.state == "known" else None,
        )
        current = drone.telemetry.newest.get((MISSION_CURRENT, 0))
        seq = 0 if current is None else int.from_bytes(payload(current)[:2], "little")
        current_item = max(0, seq - int(profile.family.has_home_slot))
        return cls(profile, state, known if plan.state == "known" else UNKNOWN_PLAN, current_item)

    @property
    def name(self) -> str:
        """The drone's."""
        return self.state.name

    def steps(self, command: PilotCommand) -> Steps:
        """What a command becomes. Raises NotKnownHow, NotKnownYet, NoSuchMode, NoSuchItem."""
        try:
            return self.profile.steps(self.state, command)
        except CommandRefused as refused:
            raise _REFUSALS[type(refused)](str(refused)) from refused

    def mission_state(self, item: int) -> MissionState:
        """What the items before this one have set. Raises StateNotRestored if the plan is not known."""
        items = self.plan.items()
        if items is None:
            raise StateNotRestored(
                f"the tower does not know the mission on board of {self.name}, and what its items before {item + 1} "
                f"set: read it first (`as_it_is` flies without)"
            )
        return state_before(items, item, self.profile.family, self.state)


def _heading_in(frame: bytes) -> float | None:
    (hundredths,) = _HEADING.unpack_from(payload(frame).ljust(_HEADING.size, b"\0"))
    return None if hundredths == _NO_HEADING else hundredths / 100.0
