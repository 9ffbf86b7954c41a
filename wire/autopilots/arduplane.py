"""ArduPlane: watching, return (RTL) and circling in place (LOITER). Nothing is measured on it, so the agent changes
none of its modes by itself."""

from __future__ import annotations

from typing import Final

from wire.autopilots.ardupilot import ARDUPILOT, modes_in
from wire.autopilots.profile import AutopilotProfile, FlightMode, FlightTask, ModeRoles, Sticks
from wire.autopilots.vehicle_types import PLANES
from wire.autopilots.watched import watched_only


def _mode(name: str, number: int, task: FlightTask, *, mission: bool = False) -> FlightMode:
    return FlightMode(name, number, (number, 0), name, sticks=Sticks.IGNORED, task=task, flies_mission=mission)


_AUTO: Final = _mode("AUTO", 10, FlightTask.MISSION, mission=True)
_RTL: Final = _mode("RTL", 11, FlightTask.RETURN)
_LOITER: Final = _mode("LOITER", 12, FlightTask.BY_ITSELF)

PROFILE: Final = AutopilotProfile(
    key="arduplane",
    label="ArduPlane",
    family=ARDUPILOT,
    vehicle_types=PLANES,
    modes=modes_in("PLANE_MODE", {mode.name: mode for mode in (_AUTO, _RTL, _LOITER)}),
    roles=ModeRoles(hold=_LOITER, returns=_RTL, mission=_AUTO),
    commands=watched_only(returns=_RTL, hold=_LOITER),
    stands_in=True,
)
