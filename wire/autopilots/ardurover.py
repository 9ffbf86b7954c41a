"""ArduPilot's rovers and boats: watched only."""

from typing import Final

from wire.autopilots.ardupilot import ARDUPILOT, modes_in
from wire.autopilots.profile import AutopilotProfile, FlightMode, FlightTask, ModeRoles, Sticks
from wire.autopilots.vehicle_types import ROVERS
from wire.autopilots.watched import watched_only

_AUTO: Final = FlightMode(
    "AUTO", 10, (10, 0), "AUTO", sticks=Sticks.IGNORED, task=FlightTask.MISSION, flies_mission=True
)

PROFILE: Final = AutopilotProfile(
    key="ardurover",
    label="ArduRover",
    family=ARDUPILOT,
    vehicle_types=ROVERS,
    modes=modes_in("ROVER_MODE", {_AUTO.name: _AUTO}),
    roles=ModeRoles(mission=_AUTO),
    commands=watched_only(),
)
