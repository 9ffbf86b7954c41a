"""ArduPilot's submarines: watched only."""

from typing import Final

from wire.autopilots.ardupilot import ARDUPILOT, modes_in
from wire.autopilots.profile import AutopilotProfile, FlightMode, FlightTask, ModeRoles, Sticks
from wire.autopilots.vehicle_types import SUBMARINES
from wire.autopilots.watched import watched_only

_AUTO: Final = FlightMode("AUTO", 3, (3, 0), "AUTO", sticks=Sticks.IGNORED, task=FlightTask.MISSION, flies_mission=True)

PROFILE: Final = AutopilotProfile(
    key="ardusub",
    label="ArduSub",
    family=ARDUPILOT,
    vehicle_types=SUBMARINES,
    modes=modes_in("SUB_MODE", {_AUTO.name: _AUTO}),
    roles=ModeRoles(mission=_AUTO),
    commands=watched_only(),
)
