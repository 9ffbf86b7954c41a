"""What the items of a mission have set by the time it comes to a given item, and how to set it again. Pure.

A mission that starts in the middle flies as nobody planned it: at the autopilot's own speed, with the camera off.
ArduPilot forgets the speed in each mode change. So whoever starts in the middle sets it again.

Only what lasts counts: speeds, a camera that goes on taking photographs, a video, where the camera looks; a heading
only since the last item that flies, because the next one ends it. What moves or switches something (servos, relays,
grippers, engines, the fence) is never done again: it could let a load go. It is named instead, as is what no command
can set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import msgspec

from wire.autopilots.commands import CommandStep, NotHeardYet, Steps, VehicleState
from wire.autopilots.common import ABOVE_HOME, ABOVE_SEA, altitude_for
from wire.autopilots.payload_commands import AUTOPILOT, CAMERA
from wire.autopilots.profile import AutopilotFamily
from wire.dialect import mavlink
from wire.plans import PlanItem
from wire.transactions import CommandWork

_M: Final = mavlink
_SPEED: Final = int(_M.MAV_CMD_DO_CHANGE_SPEED)
_YAW: Final = int(_M.MAV_CMD_CONDITION_YAW)
_DISTANCE: Final = int(_M.MAV_CMD_DO_SET_CAM_TRIGG_DIST)
_INTERVAL: Final = int(_M.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL)
_PHOTOS: Final = int(_M.MAV_CMD_IMAGE_START_CAPTURE)
_NO_PHOTOS: Final = int(_M.MAV_CMD_IMAGE_STOP_CAPTURE)
_VIDEO: Final = int(_M.MAV_CMD_VIDEO_START_CAPTURE)
_NO_VIDEO: Final = int(_M.MAV_CMD_VIDEO_STOP_CAPTURE)
_ROI: Final = int(_M.MAV_CMD_DO_SET_ROI)
_ROI_PLACE: Final = int(_M.MAV_CMD_DO_SET_ROI_LOCATION)
_ROI_NEXT: Final = int(_M.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET)
_ROI_NONE: Final = int(_M.MAV_CMD_DO_SET_ROI_NONE)
_MOUNT: Final = int(_M.MAV_CMD_DO_MOUNT_CONTROL)
_GIMBAL: Final = int(_M.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW)
_SERVO: Final = int(_M.MAV_CMD_DO_SET_SERVO)
_RELAY: Final = int(_M.MAV_CMD_DO_SET_RELAY)
_GRIPPER: Final = int(_M.MAV_CMD_DO_GRIPPER)
_WINCH: Final = int(_M.MAV_CMD_DO_WINCH)
_AUX: Final = int(_M.MAV_CMD_DO_AUX_FUNCTION)
_LAST_NAV: Final = int(_M.MAV_CMD_NAV_LAST)
_AS_DEFAULT: Final = -2.0
_GROUND_SPEED, _CLIMB, _DESCENT = 1, 2, 3
_AHEAD: Final = "camera ahead as planned"
_RELATIVE: Final = 1.0
_ABOVE_HOME: Final = (ABOVE_HOME, int(_M.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT))
_ABOVE_SEA: Final = (ABOVE_SEA, int(_M.MAV_FRAME_GLOBAL_INT))

_KEYS: Final[dict[int, int]] = {
    _DISTANCE: _DISTANCE,
    _INTERVAL: _INTERVAL,
    **dict.fromkeys((_PHOTOS, _NO_PHOTOS), _PHOTOS),
    **dict.fromkeys((_VIDEO, _NO_VIDEO), _VIDEO),
    **dict.fromkeys((_ROI, _ROI_PLACE, _ROI_NEXT, _ROI_NONE, _MOUNT, _GIMBAL), _ROI),
}
"""Commands of one key replace each other."""

_NUMBERED: Final = frozenset({_SERVO, _RELAY, _GRIPPER, _WINCH, _AUX})
"""Their first parameter says which one."""
_MOVING: Final[dict[int, str]] = {
    int(_M.MAV_CMD_DO_SET_ACTUATOR): "the actuators",
    int(_M.MAV_CMD_DO_SPRAYER): "the sprayer",
    int(_M.MAV_CMD_DO_PARACHUTE): "the parachute",
    int(_M.MAV_CMD_DO_FENCE_ENABLE): "the fence",
    int(_M.MAV_CMD_DO_SET_REVERSE): "the direction of travel",
    int(_M.MAV_CMD_DO_ENGINE_CONTROL): "the engine",
    int(_M.MAV_CMD_DO_VTOL_TRANSITION): "the transition",
    int(_M.MAV_CMD_DO_AUTOTUNE_ENABLE): "autotune",
    int(_M.MAV_CMD_DO_SET_HOME): "the home",
    int(_M.MAV_CMD_SET_CAMERA_ZOOM): "the camera's zoom",
    int(_M.MAV_CMD_SET_CAMERA_FOCUS): "the camera's focus",
}
"""Never done again, as are those in `_NUMBERED`."""
_SWITCHING: Final[dict[int, str]] = {
    _PHOTOS: "photographs by time as planned",
    _NO_PHOTOS: "no photographs as planned",
    _VIDEO: "recording as planned",
    _NO_VIDEO: "no recording as planned",
}


@dataclass(frozen=True)
class MissionState:
    """`before`: to send before the mission flies. `after`: once it does, for a change of mode forgets it. `lacking`:
    what is not set again, in words."""

    before: Steps = ()
    after: Steps = ()
    lacking: tuple[str, ...] = ()


def state_before(
    items: Sequence[PlanItem], number: int, family: AutopilotFamily, vehicle: VehicleState
) -> MissionState:
    """What the items before `number`, from 0, have set. Jumps change nothing: they lead back to what was flown."""
    lasting: dict[object, tuple[int, PlanItem]] = {}
    for index, item in enumerate(items[:number]):
        if item.command <= _LAST_NAV:
            lasting.pop(_YAW, None)
        key = _key(item)
        if key is None:
            continue
        lasting.pop(key, None)  # in the order in which they were set last
        if not (item.command == _SPEED and item.params[1] == _AS_DEFAULT):
            lasting[key] = index, item
    before: list[CommandStep] = []
    after: list[CommandStep] = []
    lacking: list[str] = []
    for index, item in lasting.values():
        words = _moves(item)
        step = None if words else _step(item, family, vehicle)
        if step is None:
            lacking.append(words or ("a heading" if item.command == _YAW else "the camera's direction"))
        else:
            (after if item.command in (_SPEED, _YAW) else before).append(replace(step, item=index))
    return MissionState(tuple(before), tuple(after), tuple(lacking))


def _key(item: PlanItem) -> object:
    """None: it sets nothing that lasts."""
    first, second = item.params[0] or 0.0, item.params[1] or 0.0
    if item.command == _SPEED:
        kind = max(int(first), _GROUND_SPEED)  # a multicopter's airspeed is its ground speed
        return (_SPEED, kind) if second > 0 or second == _AS_DEFAULT else None
    if item.command in _NUMBERED:
        return item.command, first
    if item.command in _MOVING or item.command == _YAW:
        return item.command
    return _KEYS.get(item.command)


def _moves(item: PlanItem) -> str:
    """Names what is never done again; empty: it may be."""
    first, second = item.params[0] or 0.0, item.params[1] or 0.0
    if item.command == _SERVO:
        return f"servo {first:g} at {second:g} \u00b5s"
    if item.command == _RELAY:
        return f"relay {first:g} on" if second else f"relay {first:g} off"
    if item.command == _GRIPPER:
        return f"gripper {first:g}"
    if item.command == _WINCH:
        return f"winch {first:g}"
    if item.command == _AUX:
        return f"auxiliary function {first:g}"
    return _MOVING.get(item.command, "")


def _step(item: PlanItem, family: AutopilotFamily, vehicle: VehicleState) -> CommandStep | None:
    """None: no command of this autopilot sets it."""
    first, second = item.params[0] or 0.0, item.params[1] or 0.0
    ardupilot = family.autopilot == _M.MAV_AUTOPILOT_ARDUPILOTMEGA
    work = CommandWork(item.command, (*item.params, float(item.x), float(item.y), item.z))
    if item.command == _SPEED:
        return CommandStep(_speed_words(int(first), second), work)
    if item.command == _YAW:
        is_fixed = ardupilot and item.params[3] != _RELATIVE
        return CommandStep(f"turning to {first:g}\u00b0 as planned", work) if is_fixed else None
    if item.command == _DISTANCE:
        words = f"a photograph every {first:g} m as planned" if first > 0 else "camera off as planned"
        return CommandStep(words, work)
    if item.command == _INTERVAL:
        return CommandStep(_SWITCHING[_PHOTOS], work)
    if item.command in _SWITCHING:
        component = AUTOPILOT if ardupilot else CAMERA
        return CommandStep(_SWITCHING[item.command], msgspec.structs.replace(work, component=component))
    if item.command in (_ROI, _ROI_PLACE):
        return _look(item, family, vehicle)
    if item.command == _ROI_NEXT:
        return None
    return CommandStep(_AHEAD if item.command == _ROI_NONE else "pointing the camera as planned", work)


def _speed_words(kind: int, m_s: float) -> str:
    if kind == _CLIMB:
        return f"climbing at {m_s:g} m/s as planned"
    return f"descending at {m_s:g} m/s as planned" if kind == _DESCENT else f"flying at {m_s:g} m/s as planned"


def _look(item: PlanItem, family: AutopilotFamily, vehicle: VehicleState) -> CommandStep | None:
    if not (item.x or item.y):
        return CommandStep(_AHEAD, CommandWork(_ROI_NONE))
    altitude: tuple[float, int] | None = None
    if item.frame in _ABOVE_SEA:
        altitude = item.z, ABOVE_SEA
    elif item.frame in _ABOVE_HOME:
        try:
            altitude = altitude_for(family, vehicle, item.z)
        except NotHeardYet:
            altitude = None
    if altitude is None:
        return None
    params = (*item.params, 0.0, 0.0, altitude[0])
    work = CommandWork(item.command, params, item.x, item.y, altitude[1])
    return CommandStep("pointing the camera at its place as planned", work)
