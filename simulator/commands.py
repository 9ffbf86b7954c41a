"""What each MAV_CMD does, and how ArduCopter answers it.

Commands are accepted from any sender (sticks are not). The vehicle sends the acknowledgement, always before the effects
of the command.
"""

from __future__ import annotations

from collections.abc import Callable

from simulator import commands_flight as fly
from simulator import vehicle_setup as setup
from simulator.command_message import ACCEPTED, FAILED, Command
from simulator.commands_camera import CAMERA_HANDLERS
from simulator.dialect import mavlink
from simulator.fence_rules import enable_fence
from simulator.flight import Flight
from simulator.modes import Mode
from simulator.payload_drop import PAYLOAD_HANDLERS

Handler = Callable[[Flight, Command], int]


def result(done: bool) -> int:
    return ACCEPTED if done else FAILED


HANDLERS: dict[int, Handler] = {
    **CAMERA_HANDLERS,
    **PAYLOAD_HANDLERS,
    int(mavlink.MAV_CMD_DO_SET_MODE): fly.set_mode,
    int(mavlink.MAV_CMD_COMPONENT_ARM_DISARM): fly.arm_or_disarm,
    int(mavlink.MAV_CMD_NAV_TAKEOFF): fly.take_off,
    int(mavlink.MAV_CMD_NAV_LAND): lambda f, _: result(f.set_mode(Mode.LAND)),
    int(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH): lambda f, _: result(f.set_mode(Mode.RTL)),
    int(mavlink.MAV_CMD_NAV_LOITER_UNLIM): lambda f, _: result(f.set_mode(Mode.LOITER)),
    int(mavlink.MAV_CMD_DO_REPOSITION): fly.reposition,
    int(mavlink.MAV_CMD_DO_CHANGE_SPEED): fly.change_speed,
    int(mavlink.MAV_CMD_CONDITION_YAW): fly.turn,
    int(mavlink.MAV_CMD_DO_PAUSE_CONTINUE): fly.pause_or_continue,
    int(mavlink.MAV_CMD_DO_SET_HOME): fly.set_home,
    int(mavlink.MAV_CMD_MISSION_START): fly.start_mission,
    int(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT): fly.set_current_item,
    int(mavlink.MAV_CMD_DO_FLIGHTTERMINATION): fly.terminate,
    int(mavlink.MAV_CMD_DO_FENCE_ENABLE): enable_fence,
    int(mavlink.MAV_CMD_RUN_PREARM_CHECKS): fly.run_checks,
    int(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION): setup.calibrate,
    int(mavlink.MAV_CMD_ACCELCAL_VEHICLE_POS): setup.take_pose,
    int(mavlink.MAV_CMD_DO_START_MAG_CAL): setup.start_compass,
    int(mavlink.MAV_CMD_DO_ACCEPT_MAG_CAL): setup.keep_compass,
    int(mavlink.MAV_CMD_DO_CANCEL_MAG_CAL): setup.cancel_compass,
    int(mavlink.MAV_CMD_DO_MOTOR_TEST): setup.spin_motor,
}
