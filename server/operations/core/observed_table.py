"""Which frames are commands of a pilot, what to call them in the audit trail, and which message answers them. Pure.

What only asks for telemetry is not here: a ground station sends it by the hundred, and it moves nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from struct import Struct
from typing import Final

from wire.dialect import mavlink
from wire.frames import message_id, payload

_M: Final = mavlink

NOT_COMMANDS: Final = frozenset(
    {
        *(_M.MAV_CMD_SET_MESSAGE_INTERVAL, _M.MAV_CMD_GET_MESSAGE_INTERVAL, _M.MAV_CMD_REQUEST_MESSAGE),
        *(_M.MAV_CMD_GET_HOME_POSITION, _M.MAV_CMD_REQUEST_PROTOCOL_VERSION),
        *(_M.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, _M.MAV_CMD_REQUEST_CAMERA_INFORMATION),
        *(_M.MAV_CMD_REQUEST_CAMERA_SETTINGS, _M.MAV_CMD_REQUEST_STORAGE_INFORMATION),
        *(_M.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS, _M.MAV_CMD_REQUEST_FLIGHT_INFORMATION),
        *(_M.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION, _M.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS),
    }
)
"""MAV_CMDs that only ask for something."""


@dataclass(frozen=True)
class SeenCommand:
    """A frame that is a command. `same`: two with equal ones, soon after each other, are one command sent again."""

    name: str
    """As operations call it, where they know it; else as MAVLink does."""
    same: tuple[object, ...]
    answer_id: int | None
    """The message that answers it; None: nothing does."""
    answer: object = None
    """The subject in the answer: MAV_CMD, kind of plan, or parameter name."""
    repeat: bool = False
    """The message marks itself as a repetition."""
    modes: frozenset[int] = frozenset()
    """Of a mode change: without another answer, a HEARTBEAT with one of these custom modes is one."""
    detail: Mapping[str, object] = field(default_factory=dict)
    """For the trail."""


_LONG: Final = Struct("<fffffffHBBB")
_INT: Final = Struct("<ffffiifHBBBBB")
_ACK: Final = Struct("<HBBiBB")
_SET_MODE: Final = Struct("<IBB")
_PARAM_SET: Final = Struct("<fBB16sB")
_PARAM_VALUE: Final = Struct("<fHH16sB")
_PLAN_KIND: Final[Mapping[int, tuple[int, int]]] = {
    _M.MAVLINK_MSG_ID_MISSION_COUNT: (4, 0),
    _M.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: (2, -1),
    _M.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST: (6, -1),
}
"""Offsets of the kind of plan and the number of items, if the message has them."""
_MISSION_KINDS: Final = {0: "mission", 1: "fence", 2: "rally"}

_NAMES: Final[Mapping[int, str]] = {
    _M.MAV_CMD_NAV_TAKEOFF: "takeoff",
    _M.MAV_CMD_NAV_LAND: "land",
    _M.MAV_CMD_NAV_RETURN_TO_LAUNCH: "rtl",
    _M.MAV_CMD_DO_REPOSITION: "goto",
    _M.MAV_CMD_DO_SET_MODE: "mode",
    _M.MAV_CMD_DO_CHANGE_SPEED: "speed",
    _M.MAV_CMD_CONDITION_YAW: "turn",
    _M.MAV_CMD_DO_SET_HOME: "set_home",
    _M.MAV_CMD_MISSION_START: "start",
    _M.MAV_CMD_DO_SET_MISSION_CURRENT: "jump",
    _M.MAV_CMD_DO_ORBIT: "orbit",
    _M.MAV_CMD_DO_SET_ROI_LOCATION: "roi",
    _M.MAV_CMD_DO_SET_ROI_NONE: "roi",
    _M.MAV_CMD_DO_SET_SERVO: "servo",
    _M.MAV_CMD_DO_SET_ACTUATOR: "servo",
    _M.MAV_CMD_DO_GRIPPER: "gripper",
    _M.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: "gimbal",
    _M.MAV_CMD_SET_CAMERA_ZOOM: "zoom",
    _M.MAV_CMD_IMAGE_START_CAPTURE: "photo",
    _M.MAV_CMD_IMAGE_STOP_CAPTURE: "photo",
    _M.MAV_CMD_VIDEO_START_CAPTURE: "record",
    _M.MAV_CMD_VIDEO_STOP_CAPTURE: "record",
    _M.MAV_CMD_PREFLIGHT_CALIBRATION: "calibrate",
    _M.MAV_CMD_DO_START_MAG_CAL: "calibrate",
    _M.MAV_CMD_ACCELCAL_VEHICLE_POS: "calibration_pose",
    _M.MAV_CMD_DO_ACCEPT_MAG_CAL: "calibration_end",
    _M.MAV_CMD_DO_CANCEL_MAG_CAL: "calibration_end",
    _M.MAV_CMD_DO_MOTOR_TEST: "motor_test",
    _M.MAV_CMD_ACTUATOR_TEST: "motor_test",
    _M.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: "reboot",
}
"""Names of MAV_CMDs, as in `POST /drones/{id}/commands`."""

_DISTINGUISHING_PARAMS: Final[Mapping[int, int]] = {
    _M.MAV_CMD_COMPONENT_ARM_DISARM: 2,
    _M.MAV_CMD_DO_SET_MODE: 3,
    _M.MAV_CMD_DO_PAUSE_CONTINUE: 1,
    _M.MAV_CMD_DO_AUX_FUNCTION: 2,
    _M.MAV_CMD_DO_FLIGHTTERMINATION: 1,
    _M.MAV_CMD_PREFLIGHT_CALIBRATION: 5,
    _M.MAV_CMD_ACCELCAL_VEHICLE_POS: 1,
    _M.MAV_CMD_DO_SET_SERVO: 2,
    _M.MAV_CMD_DO_SET_ACTUATOR: 6,
    _M.MAV_CMD_DO_GRIPPER: 2,
}
"""How many parameters distinguish commands of one MAV_CMD: arming is not disarming. For all others the newest
counts."""

_STREAMS: Final[Mapping[int, str]] = {
    _M.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: "SET_POSITION_TARGET_LOCAL_NED",
    _M.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: "SET_POSITION_TARGET_GLOBAL_INT",
    _M.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: "SET_ATTITUDE_TARGET",
    _M.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET: "SET_ACTUATOR_CONTROL_TARGET",
    _M.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN: "SET_GPS_GLOBAL_ORIGIN",
    _M.MAVLINK_MSG_ID_SET_HOME_POSITION: "SET_HOME_POSITION",
    _M.MAVLINK_MSG_ID_LOG_ERASE: "LOG_ERASE",
}
"""Messages that nothing answers."""


def command_of(frame: bytes) -> SeenCommand | None:
    """What a whole frame commands; None: it commands nothing, or sticks."""
    msgid = message_id(frame)
    reader = _READERS.get(msgid)
    return None if reader is None else reader(msgid, payload(frame))


def answer_in(frame: bytes) -> tuple[int, object, str, int] | None:
    """(message id, what it answers, the result in words, the system that it is for; 0: for all), or None."""
    msgid = message_id(frame)
    body = payload(frame)
    if msgid == _M.MAVLINK_MSG_ID_COMMAND_ACK:
        command, result, _, _, system, _ = _ACK.unpack_from(body.ljust(_ACK.size, b"\0"))
        return msgid, command, _named("MAV_RESULT", result), system
    if msgid == _M.MAVLINK_MSG_ID_MISSION_ACK:
        system, _, result, kind = body.ljust(4, b"\0")[:4]
        return msgid, kind, _named("MAV_MISSION_RESULT", result, "MAV_MISSION_"), system
    if msgid == _M.MAVLINK_MSG_ID_PARAM_VALUE:
        value, _, _, name, _ = _PARAM_VALUE.unpack_from(body.ljust(_PARAM_VALUE.size, b"\0"))
        return msgid, name.rstrip(b"\0"), f"it is {value:g}", 0
    return None


def _named(enum: str, number: int, prefix: str = "") -> str:
    entry = mavlink.enums[enum].get(number)
    name = str(number) if entry is None else entry.name.removeprefix(prefix or f"{enum}_")
    return name.replace("_", " ").lower()


IN_PROGRESS: Final = "in progress"
NO_ANSWER: Final = "no answer"


def _command_long(msgid: int, body: bytes) -> SeenCommand | None:
    fields = _LONG.unpack_from(body.ljust(_LONG.size, b"\0"))
    return _command(fields[7], fields[:7], repeat=fields[10] > 0)


def _command_int(msgid: int, body: bytes) -> SeenCommand | None:
    fields = _INT.unpack_from(body.ljust(_INT.size, b"\0"))
    return _command(fields[7], fields[:7], repeat=False)


def _command(number: int, params: tuple[float, ...], *, repeat: bool) -> SeenCommand | None:
    if number in NOT_COMMANDS:
        return None
    name = _NAMES.get(number)
    if number == _M.MAV_CMD_COMPONENT_ARM_DISARM:
        name = "arm" if params[0] >= 0.5 else "disarm"
    elif number == _M.MAV_CMD_DO_PAUSE_CONTINUE:
        name = "resume" if params[0] >= 0.5 else "pause"
    entry = mavlink.enums["MAV_CMD"].get(number)
    mav_cmd = f"MAV_CMD {number}" if entry is None else entry.name
    plain = [None if not math.isfinite(one) else round(one, 3) for one in params]
    while plain and plain[-1] == 0:
        plain.pop()
    # What is no number equals nothing, itself neither: a repeat would look like another command.
    apart = tuple(None if not math.isfinite(one) else one for one in params[: _DISTINGUISHING_PARAMS.get(number, 0)])
    return SeenCommand(
        name=name or mav_cmd,
        same=(number, *apart),
        answer_id=_M.MAVLINK_MSG_ID_COMMAND_ACK,
        answer=number,
        repeat=repeat,
        modes=_modes(params) if number == _M.MAV_CMD_DO_SET_MODE else frozenset(),
        detail={"message": mav_cmd, "params": plain},
    )


def _modes(params: tuple[float, ...]) -> frozenset[int]:
    """Returns the custom mode as ArduPilot and as PX4 read it: their numbers have no value in common but 0."""
    main, sub = params[1], params[2]
    if not (0 <= main <= 255 and 0 <= sub <= 255):
        return frozenset()
    return frozenset({int(main), int(main) << 16 | int(sub) << 24})


def _set_mode(msgid: int, body: bytes) -> SeenCommand:
    mode, _, _ = _SET_MODE.unpack_from(body.ljust(_SET_MODE.size, b"\0"))
    detail = {"message": "SET_MODE", "params": [mode]}
    return SeenCommand("mode", (msgid, mode), None, modes=frozenset({mode}), detail=detail)


def _plan(msgid: int, body: bytes) -> SeenCommand:
    kind_at, count_at = _PLAN_KIND[msgid]
    whole = body.ljust(8, b"\0")
    kind = whole[kind_at]
    words = _MISSION_KINDS.get(kind, str(kind))
    detail: dict[str, object] = {"message": mavlink.mavlink_map[msgid].msgname, "kind": words}
    if count_at >= 0:
        detail["items"] = int.from_bytes(whole[count_at : count_at + 2], "little")
    name = "plan_clear" if msgid == _M.MAVLINK_MSG_ID_MISSION_CLEAR_ALL else "plan_upload"
    return SeenCommand(name, (msgid, kind), _M.MAVLINK_MSG_ID_MISSION_ACK, kind, detail=detail)


def _set_current(msgid: int, body: bytes) -> SeenCommand:
    item = int.from_bytes(body.ljust(2, b"\0")[:2], "little")
    return SeenCommand("jump", (msgid,), None, detail={"message": "MISSION_SET_CURRENT", "params": [item]})


def _parameter(msgid: int, body: bytes) -> SeenCommand:
    value, _, _, name, _ = _PARAM_SET.unpack_from(body.ljust(_PARAM_SET.size, b"\0"))
    name = name.rstrip(b"\0")
    text = name.decode("ascii", "replace")
    detail = {"message": "PARAM_SET", "parameter": text, "value": value if math.isfinite(value) else None}
    return SeenCommand("parameters_write", (msgid, name), _M.MAVLINK_MSG_ID_PARAM_VALUE, name, detail=detail)


def _stream(msgid: int, body: bytes) -> SeenCommand:
    return SeenCommand(_STREAMS[msgid], (msgid,), None, detail={"message": _STREAMS[msgid]})


_READERS: Final[Mapping[int, Callable[[int, bytes], SeenCommand | None]]] = {
    _M.MAVLINK_MSG_ID_COMMAND_LONG: _command_long,
    _M.MAVLINK_MSG_ID_COMMAND_INT: _command_int,
    _M.MAVLINK_MSG_ID_SET_MODE: _set_mode,
    _M.MAVLINK_MSG_ID_MISSION_SET_CURRENT: _set_current,
    _M.MAVLINK_MSG_ID_PARAM_SET: _parameter,
    **dict.fromkeys(_PLAN_KIND, _plan),
    **dict.fromkeys(_STREAMS, _stream),
}

ANSWERS: Final = frozenset(
    {_M.MAVLINK_MSG_ID_COMMAND_ACK, _M.MAVLINK_MSG_ID_MISSION_ACK, _M.MAVLINK_MSG_ID_PARAM_VALUE}
)
"""Message ids that may answer a command."""
