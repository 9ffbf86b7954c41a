"""Commands that point the camera and take photographs."""

from __future__ import annotations

from collections.abc import Callable

from simulator.command_message import Command
from simulator.dialect import mavlink
from simulator.flight import Flight

ACCEPTED, DENIED, FAILED = 0, 2, 4


def look_at(flight: Flight, command: Command) -> int:
    """DO_SET_ROI_LOCATION and the older DO_SET_ROI, for which a zero position clears the ROI."""
    if command.lat_e7 == 0 and command.lon_e7 == 0 and command.alt_m == 0.0:
        flight.roi = None
        return ACCEPTED
    if not command.place_is_valid:
        return FAILED
    flight.roi = flight.origin.to_local(command.lat_e7 * 1e-7, command.lon_e7 * 1e-7)
    return ACCEPTED


def look_ahead_again(flight: Flight, command: Command) -> int:
    del command
    flight.roi = None
    return ACCEPTED


def trigger_by_distance(flight: Flight, command: Command) -> int:
    flight.camera.every_metres(flight, command.params[0], at_once=command.params[2] == 1.0)
    return ACCEPTED


def start_capture(flight: Flight, command: Command) -> int:
    if command.params[1] < 0.0 or command.params[2] < 0.0:
        return DENIED
    flight.camera.every_seconds(flight, command.params[1], int(command.params[2]))
    return ACCEPTED


def stop_capture(flight: Flight, command: Command) -> int:
    del command
    flight.camera.stop()
    return ACCEPTED


def control_camera(flight: Flight, command: Command) -> int:
    """DO_DIGICAM_CONTROL: a fifth parameter of 1 takes a photograph."""
    shoots = command.raw[4] == 1.0 if command.is_long else command.lat_e7 == 1
    if shoots:
        flight.camera.shoot(flight)
    return ACCEPTED


CAMERA_HANDLERS: dict[int, Callable[[Flight, Command], int]] = {
    int(mavlink.MAV_CMD_DO_SET_ROI_LOCATION): look_at,
    int(mavlink.MAV_CMD_DO_SET_ROI): look_at,
    int(mavlink.MAV_CMD_DO_SET_ROI_NONE): look_ahead_again,
    int(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST): trigger_by_distance,
    int(mavlink.MAV_CMD_IMAGE_START_CAPTURE): start_capture,
    int(mavlink.MAV_CMD_IMAGE_STOP_CAPTURE): stop_capture,
    int(mavlink.MAV_CMD_DO_DIGICAM_CONTROL): control_camera,
}
