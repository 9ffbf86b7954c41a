"""What a handler at the drone knows of an ArduCopter that stands on the ground, heard and disarmed."""

from typing import Final

from onboard_agent.transactions.handler import Around

GROUND: Final = Around(
    system_id=1,
    autopilot_kind=3,
    vehicle_type=2,
    heard=True,
    armed=False,
    airborne=False,
    custom_mode=0,
    starting=False,
    flown_by_hand=False,
    holding=False,
    commanded=0,
    narrow_line=False,
)
