"""What the tower knows of the vehicle that a command is for, and the names of its flight modes. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from struct import Struct
from types import MappingProxyType
from typing import Final

from server.domain.refusal import Refusal
from server.live.relay.live_drone import LiveDrone
from server.live.relay.loan_limits import whole_place_in
from wire.dialect import mavlink
from wire.frames import payload
from wire.plans import PlanKind

_HEARTBEAT: Final = Struct("<IBB")
_MULTICOPTERS: Final = frozenset(
    {
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_TYPE_COAXIAL,
        mavlink.MAV_TYPE_HELICOPTER,
        mavlink.MAV_TYPE_HEXAROTOR,
        mavlink.MAV_TYPE_OCTOROTOR,
        mavlink.MAV_TYPE_TRICOPTER,
        mavlink.MAV_TYPE_DODECAROTOR,
        mavlink.MAV_TYPE_DECAROTOR,
    }
)

ModeNumbers = tuple[int, int]
"""param2 and param3 of MAV_CMD_DO_SET_MODE."""

COPTER_MODES: Final[Mapping[str, ModeNumbers]] = MappingProxyType(
    {
        entry.name.removeprefix("COPTER_MODE_"): (number, 0)
        for number, entry in mavlink.enums["COPTER_MODE"].items()
        if not entry.name.endswith("_ENUM_END")
    }
)
_AUTO: Final = 4
PX4_MODES: Final[Mapping[str, ModeNumbers]] = MappingProxyType(
    {
        "MANUAL": (1, 0),
        "ALTCTL": (2, 0),
        "POSCTL": (3, 0),
        "AUTO.TAKEOFF": (_AUTO, 2),
        "AUTO.LOITER": (_AUTO, 3),
        "AUTO.MISSION": (_AUTO, 4),
        "AUTO.RTL": (_AUTO, 5),
        "AUTO.LAND": (_AUTO, 6),
        "ACRO": (5, 0),
        "OFFBOARD": (6, 0),
        "STABILIZED": (7, 0),
    }
)
_PX4_ALSO: Final = {
    "ALTITUDE": "ALTCTL",
    "POSITION": "POSCTL",
    "TAKEOFF": "AUTO.TAKEOFF",
    "LOITER": "AUTO.LOITER",
    "HOLD": "AUTO.LOITER",
    "MISSION": "AUTO.MISSION",
    "RTL": "AUTO.RTL",
    "RETURN": "AUTO.RTL",
    "LAND": "AUTO.LAND",
}


class NotKnownHow(Refusal):
    """This vehicle has no such thing, or the tower does not know how to ask it for it."""


class NotKnownYet(Refusal):
    """Something that the command needs has not been heard from the drone."""


class NoSuchMode(Refusal):
    """Of this autopilot."""


@dataclass(frozen=True)
class Vehicle:
    """At this moment. `custom_mode`: as its heartbeat shows it; `home_alt_m`: above the sea, None: not known."""

    name: str
    px4: bool
    custom_mode: int
    armed: bool | None
    """None: not known, as `airborne`."""
    airborne: bool | None
    home_alt_m: float | None
    mission_items: int | None
    """None: nobody knows what is on board."""
    place_deg: tuple[float, float] | None = None
    """Latitude and longitude; None: not known."""

    @classmethod
    def of(cls, drone: LiveDrone) -> Vehicle:
        """Raises NotKnownYet before a heartbeat, NotKnownHow of what is no multicopter of ArduPilot's or PX4's."""
        name = drone.record.name
        if drone.heartbeat is None:
            raise NotKnownYet(f"nothing has been heard of the autopilot of {name} yet")
        body = payload(drone.heartbeat).ljust(_HEARTBEAT.size, b"\0")
        custom_mode, vehicle_type, autopilot = _HEARTBEAT.unpack_from(body)
        px4 = autopilot == mavlink.MAV_AUTOPILOT_PX4
        if vehicle_type not in _MULTICOPTERS or not (px4 or autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA):
            raise NotKnownHow(f"{name} is no multicopter of ArduPilot's or PX4's: the tower has no commands for it")
        plan, _ = drone.board.plan(PlanKind.MISSION)
        place = whole_place_in(drone.position_frame) if drone.position_frame is not None else None
        return cls(
            name=name,
            px4=px4,
            custom_mode=custom_mode,
            armed=drone.armed,
            airborne=drone.airborne,
            home_alt_m=drone.home.alt_amsl_m if drone.home is not None else None,
            mission_items=plan.count if plan.state == "known" else None,
            place_deg=None if place is None else (place.lat_deg, place.lon_deg),
        )

    def is_armed(self) -> bool:
        """Raises NotKnownYet: what arms is not begun where nobody knows."""
        if self.armed is None:
            raise NotKnownYet(f"whether {self.name} is armed is not known: its autopilot is silent")
        return self.armed

    def mode(self, name: str) -> ModeNumbers:
        """Upper and lower case do not count, nor whether a space or a line stands between words. Raises NoSuchMode."""
        known = "_".join(name.upper().replace("_", " ").split())
        modes = PX4_MODES if self.px4 else COPTER_MODES
        numbers = modes.get(_PX4_ALSO.get(known, known) if self.px4 else known)
        if numbers is None:
            raise NoSuchMode(f"{self.name} has no such mode; it has {', '.join(modes)}")
        return numbers

    def is_in(self, name: str) -> bool:
        """Whether its heartbeat shows this mode."""
        main, sub = self.mode(name)
        return self.custom_mode == (main << 16 | sub << 24 if self.px4 else main)

    def place(self) -> tuple[float, float]:
        """Latitude and longitude. Raises NotKnownYet."""
        if self.place_deg is None:
            raise NotKnownYet(f"where {self.name} is has not been heard yet")
        return self.place_deg

    def above_sea(self, height_m: float) -> float:
        """Of a height above home. Raises NotKnownYet."""
        if self.home_alt_m is None:
            raise NotKnownYet(f"where home is of {self.name} has not been heard yet")
        return self.home_alt_m + height_m
