"""Vehicles that can be watched, and returned or held if their modes for it are known. Pure."""

from __future__ import annotations

from typing import Any, Final

from wire.autopilots.commands import CommandTable, Unable
from wire.autopilots.profile import FlightMode, into

_WATCHED: Final = "is watched only: fly it with its own ground station"
_RETURNED: Final = "is watched and returned only: fly it with its own ground station"


def watched_only(*, returns: FlightMode | None = None, hold: FlightMode | None = None) -> CommandTable:
    """Return and hold are mode changes; every other command has a reason for its refusal."""
    unable: Unable[Any] = Unable(_WATCHED if returns is None else _RETURNED)
    return CommandTable(
        arm=unable,
        disarm=unable,
        mode=unable,
        takeoff=unable,
        goto=unable,
        hold=unable if hold is None else into(hold),
        pause=unable,
        resume=unable,
        land=unable,
        rtl=unable if returns is None else into(returns),
        speed=unable,
        turn=unable,
        set_home=unable,
        start=unable,
        jump=unable,
        orbit=unable,
        roi=unable,
        servo=unable,
        gripper=unable,
        gimbal=unable,
        zoom=unable,
        photo=unable,
        record=unable,
        calibrate=unable,
        calibration_pose=unable,
        calibration_end=unable,
        motor_test=unable,
        reboot=unable,
    )
