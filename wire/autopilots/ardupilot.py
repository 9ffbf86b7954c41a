"""What all ArduPilot vehicles have in common. Measured on ArduCopter 4.6 and 4.7 (docs/control.md). Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from wire.autopilots import ardupilot_loss
from wire.autopilots.ardupilot_plans import SINCE, ArduPilot
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
