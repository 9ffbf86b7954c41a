"""What all ArduPilot vehicles have in common. Measured on ArduCopter 4.6 and 4.7 (docs/control.md). Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from wire.autopilots import ardupilot_loss
from wire.autopilots.ardupilot_plans import SINCE, ArduPilot
from wire.autopilots.own_fence import OwnFence
from wire.autopilots.profile import AutopilotFamily, FlightMode
from wire.autopilots.vehicle_types import PLANES
from wire.dialect import mavlink
from wire.firmware import Release
from wire.open_holds import AfterSticks
from wire.plan_fields import KeptFields

_R: Final = AfterSticks
_FS_OPTIONS_GO_ON: Final = {3: 1, 4: 4, 9: 8}
"""ArduCopter mode to the FS_OPTIONS bit with which it continues without a radio: AUTO, GUIDED, LAND."""
_FS_THR_ACTIONS: Final = {1: _R.RETURNS, 2: _R.RETURNS, 3: _R.LANDS, 4: _R.RETURNS, 5: _R.LANDS, 6: _R.RETURNS}
_AUTO: Final = 3
_CONTINUES_AUTO: Final = 2

_ARMING_SWITCHES: Final = frozenset({151.0, 153.0, 154.0, 165.0})
"""TURTLE, ARMDISARM, ARMDISARM_AIRMODE, ARM_EMERGENCY_STOP."""
_AUTO_SWITCH: Final = 16.0
"""AUTO, or back to the radio's mode, which may be AUTO too."""

GROUND_STATION: Final = ("SYSID_MYGCS", "MAV_GCS_SYSID")
"""Up to ArduPilot 4.6, and from 4.7 on."""


def _after_sticks(custom_mode: int, values: Mapping[str, float], without: bool) -> AfterSticks:
    action = values.get("FS_THR_ENABLE")
    if action is None:
        return _R.UNKNOWN
    if action <= 0:
        return _R.STAYS if without else _R.UNKNOWN  # the last sticks stay in force
    if int(values.get("FS_OPTIONS", 0)) & _FS_OPTIONS_GO_ON.get(custom_mode, 0):
        return _R.STAYS
    if custom_mode == _AUTO and action == _CONTINUES_AUTO:
        return _R.STAYS
    return _FS_THR_ACTIONS.get(int(action), _R.UNKNOWN)


def _keeping(vehicle_type: int, release: Release | None) -> KeptFields:
    return ArduPilot(is_plane=vehicle_type in PLANES, release=release)


_ALT_MAX, _CIRCLE, _POLYGON = 1, 2, 4
"""Bits of FENCE_TYPE."""
_INCLUSION_UNION: Final = 2
"""Bit of FENCE_OPTIONS."""


def _own_fence(values: Mapping[str, float], is_on: bool | None) -> OwnFence | None:
    """SYS_STATUS shows what DO_FENCE_ENABLE and switches did; with FENCE_ACTION 0, report only, it never shows it."""
    reports_only = values.get("FENCE_ACTION") == 0
    if not (values.get("FENCE_ENABLE", 0) > 0 if is_on is None or reports_only else is_on):
        return None
    kinds = int(values.get("FENCE_TYPE", 0))
    return OwnFence(
        max_height_m=values.get("FENCE_ALT_MAX") if kinds & _ALT_MAX else None,
        height_name="FENCE_ALT_MAX",
        radius_m=values.get("FENCE_RADIUS") if kinds & _CIRCLE else None,
        radius_name="FENCE_RADIUS",
        has_areas=bool(kinds & _POLYGON),
        one_is_enough=bool(int(values.get("FENCE_OPTIONS", 0)) & _INCLUSION_UNION),
    )


_MOTORS_OF_CLASS: Final = {1: 4, 2: 6, 3: 8, 4: 8, 5: 6, 7: 4, 12: 12, 14: 10}
"""FRAME_CLASS of ArduCopter. A tricopter's test order has four: the third turns its servo."""
_MOTOR_FUNCTIONS: Final = frozenset({*range(33, 41), *range(82, 86)})
"""SERVOn_FUNCTION of motors 1 to 12."""
_MAX_OUTPUTS: Final = 32


def _motor_count(values: Mapping[str, float]) -> int | None:
    count = _MOTORS_OF_CLASS.get(int(values.get("FRAME_CLASS", 0)))
    if count is not None:
        return count
    functions = [values.get(f"SERVO{number}_FUNCTION") for number in range(1, _MAX_OUTPUTS + 1)]
    return len({one for one in functions if one in _MOTOR_FUNCTIONS}) or None


def _main_of(custom_mode: int) -> int:
    return custom_mode


def _custom_mode(main: float, sub: float) -> int:
    return int(main)  # `sub` is not read: it may be NaN


ARDUPILOT: Final = AutopilotFamily(
    autopilot=int(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA),
    name="ardupilot",
    label="ArduPilot",
    main_of=_main_of,
    custom_mode=_custom_mode,
    reads_frames=True,
    zero_is_here=True,
    has_home_slot=True,
    targets_by_command=False,
    bytes_in_parameters=False,
    packs_parameters=True,
    log_folders=(b"/APM/LOGS", b"logs", b"APM/logs"),  # on boards, in its simulator, on Qualcomm's
    arms_with_throttle_down=True,
    silent_without_receiver=False,
    answers_timesync=True,
    sticks_hide_receiver=True,
    station_parameters=GROUND_STATION,
    stick_parameters=("RC1_TRIM", "RC2_TRIM", "RC3_MIN", "RC3_MAX", "RC4_TRIM"),
    loss_parameters=(
        *GROUND_STATION,
        "RC3_MIN",
        "RC3_MAX",
        "RC3_TRIM",
        "FS_GCS_ENABLE",
        "FS_GCS_TIMEOUT",
        "FS_THR_ENABLE",
        "FS_OPTIONS",
        "RC_OVERRIDE_TIME",
        "RC_FS_TIMEOUT",
        "RC_OPTIONS",
        "SIM_SPEEDUP",  # only in ArduPilot's own simulator; last, because a real autopilot never answers
    ),
    deciding_parameters=("FS_THR_ENABLE", "FS_GCS_ENABLE", "RC_OVERRIDE_TIME"),
    after_sticks=_after_sticks,
    keeping=_keeping,
    loss_sentences=ardupilot_loss.loss_sentences,
    without_receiver=ardupilot_loss.WITHOUT_RECEIVER,
    with_receiver=ardupilot_loss.WITH_RECEIVER,
    is_simulated=ardupilot_loss.is_simulated,
    own_fence=_own_fence,
    motor_count=_motor_count,
    mission_lacks=frozenset({int(mavlink.MAV_CMD_DO_VTOL_TRANSITION)}),
    mission_requires={
        int(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST): (2, 4),
        int(mavlink.MAV_CMD_IMAGE_START_CAPTURE): (4,),
        int(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW): (1, 2, 3, 4),
    },
    mission_since=SINCE,
    looks_by_legacy_roi=True,
    return_heights={"RTL_ALT_M": 1.0, "RTL_ALT": 0.01},
    arming_switches=_ARMING_SWITCHES,
    # MOTOR_ESTOP, MOTOR_INTERLOCK and DISARM besides.
    stopping_switches=_ARMING_SWITCHES | {31.0, 32.0, 81.0},
    mission_switches=frozenset({_AUTO_SWITCH}),
    arming_commands=frozenset({int(mavlink.MAV_CMD_SOLO_BTN_FLY_CLICK), int(mavlink.MAV_CMD_SOLO_BTN_FLY_HOLD)}),
)


def modes_in(enum: str, known: Mapping[str, FlightMode]) -> tuple[FlightMode, ...]:
    """Returns every mode of a dialect enum in its order: `known` modes by their numbers, the others by name only."""
    found = []
    for number, entry in sorted(mavlink.enums[enum].items()):
        name = str(entry.name).removeprefix(f"{enum}_")
        if name != "ENUM_END":
            found.append(known.get(name) or named(name, int(number)))
    return tuple(found)


def named(name: str, number: int) -> FlightMode:
    """Returns a mode known by name only."""
    return FlightMode(name, number, (number, 0), name.replace("_", " "))
