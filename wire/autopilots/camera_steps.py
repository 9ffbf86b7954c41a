"""The steps of commands for gimbals and cameras: MAVLink's gimbal protocol v2 and camera protocol v2. Pure.

The gimbal's manager is in the autopilot. It obeys only who has the gimbal, so each pointing takes it first. A camera is
a component of its own, and answers for itself.
"""

from __future__ import annotations

from typing import Final

import msgspec

from wire.autopilots.commands import CommandStep, Steps, VehicleState
from wire.autopilots.common import command_long
from wire.autopilots.payload_commands import CameraCommand, PointGimbal, RecordVideo, TakePhotos, ZoomCamera
from wire.dialect import mavlink

_M: Final = mavlink
_MYSELF: Final = -2.0
_AS_IT_IS: Final = -1.0
_NO_RATE: Final = None
_LEVEL: Final = int(_M.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | _M.GIMBAL_MANAGER_FLAGS_PITCH_LOCK)
_LOCKED: Final = _LEVEL | int(_M.GIMBAL_MANAGER_FLAGS_YAW_LOCK)
_ALL: Final = 0.0
_CONTINUOUS: Final = float(_M.ZOOM_TYPE_CONTINUOUS)
_RANGE: Final = float(_M.ZOOM_TYPE_RANGE)


def point_gimbal(state: VehicleState, command: PointGimbal) -> Steps:
    """Pitch against the horizon."""
    take = command_long(_M.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, _MYSELF, _MYSELF, _AS_IT_IS, _AS_IT_IS)
    flags = float(_LOCKED if command.locked else _LEVEL)
    to = (command.pitch_deg, command.yaw_deg, _NO_RATE, _NO_RATE, flags, 0.0, _ALL)
    where = f"{command.pitch_deg:g}\u00b0, {command.yaw_deg:g}\u00b0"
    return (
        CommandStep("taking the gimbal", take),
        CommandStep(f"pointing the camera to {where}", command_long(_M.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, *to)),
    )


def zoom(state: VehicleState, command: ZoomCamera) -> Steps:
    if command.percent is not None:
        return _at(command, f"zooming to {command.percent:g} %", _M.MAV_CMD_SET_CAMERA_ZOOM, _RANGE, command.percent)
    phase = {1: "zooming in", -1: "zooming out"}.get(command.direction, "stopping the zoom")
    return _at(command, phase, _M.MAV_CMD_SET_CAMERA_ZOOM, _CONTINUOUS, float(command.direction))


def photo(state: VehicleState, command: TakePhotos) -> Steps:
    if command.stop:
        return _at(command, "ending the photographs", _M.MAV_CMD_IMAGE_STOP_CAPTURE, _ALL)
    words = "a photograph" if command.count == 1 else f"{command.count or 'many'} photographs"
    params = (_ALL, command.every_s, float(command.count))
    return _at(command, f"taking {words}", _M.MAV_CMD_IMAGE_START_CAPTURE, *params)


def record(state: VehicleState, command: RecordVideo) -> Steps:
    if command.on:
        return _at(command, "starting the recording", _M.MAV_CMD_VIDEO_START_CAPTURE, _ALL, 0.0)
    return _at(command, "ending the recording", _M.MAV_CMD_VIDEO_STOP_CAPTURE, _ALL)


def _at(command: CameraCommand, phase: str, number: int, *params: float) -> Steps:
    work = msgspec.structs.replace(command_long(number, *params), component=command.component)
    return (CommandStep(phase, work),)
