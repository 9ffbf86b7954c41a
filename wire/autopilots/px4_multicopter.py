"""PX4 on multicopters. Sources: PX4 1.15 and 1.16, its documentation and its own simulator.

PX4 reads altitudes above sea level, whatever the frame of the message. It takes off when armed, and arms on a mission
start. A turn is a flight to the current position with a heading.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from wire.autopilots import (
    camera_steps,
    common,
    payload_steps,
    px4_checks,
    px4_events,
    px4_loss,
    px4_sticks,
    setup_commands,
)
from wire.autopilots.commands import (
    CommandStep,
    CommandTable,
    GoTo,
    Jump,
    LookAt,
    NotSupported,
    Orbit,
    StartMission,
    Steps,
    TakeOff,
    Turn,
    Unable,
    VehicleState,
)
from wire.autopilots.own_fence import OwnFence
from wire.autopilots.profile import (
    AutopilotFamily,
    AutopilotProfile,
    FailsafeModes,
    FlightMode,
    FlightTask,
    ModeRoles,
    Sticks,
    change_mode,
    into,
)
from wire.autopilots.px4_plans import Px4
from wire.autopilots.vehicle_types import MULTICOPTERS
from wire.dialect import mavlink
from wire.firmware import Release
from wire.open_holds import AfterSticks, LostAction
from wire.plan_fields import KeptFields

_M: Final = mavlink
_T: Final = FlightTask
_R: Final = AfterSticks

_MAIN_SHIFT: Final = 16
_SUB_SHIFT: Final = 24
_AUTO: Final = 4


def custom_mode(main: float, sub: float = 0) -> int:
    """Packs the two separate numbers of DO_SET_MODE as the heartbeat does."""
    return int(main) << _MAIN_SHIFT | int(sub) << _SUB_SHIFT


def _main_of(number: int) -> int:
    return number >> _MAIN_SHIFT & 0xFF


def _mode(
    name: str,
    main: int,
    sub: int,
    label: str,
    task: FlightTask | None,
    *aliases: str,
    place: bool = True,
    centred: bool = False,
    drifts: bool = False,
    mission: bool = False,
    settable: bool = True,
    offered: bool = True,
) -> FlightMode:
    """AUTO and OFFBOARD ignore the sticks."""
    return FlightMode(
        name,
        custom_mode(main, sub),
        (main, sub),
        label,
        aliases,
        sticks=Sticks.IGNORED if main in (_AUTO, 6) else Sticks.FLY,
        task=task,
        needs_position=place,
        holds_when_centred=centred,
        drifts=drifts,
        flies_mission=mission,
        settable=settable,
        offered=offered and settable,
    )


_FENCE_REFUSES: Final = 2
"""GF_ACTION from which on it refuses a place; 1 only warns of a breach."""


def _own_fence(values: Mapping[str, float], is_on: bool | None) -> OwnFence | None:
    """SYS_STATUS never shows it."""
    if values.get("GF_ACTION", 0) < _FENCE_REFUSES:
        return None
    return OwnFence(
        max_height_m=values.get("GF_MAX_VER_DIST") or None,
        height_name="GF_MAX_VER_DIST",
        radius_m=values.get("GF_MAX_HOR_DIST") or None,
        radius_name="GF_MAX_HOR_DIST",
        has_areas=True,
    )


def _motor_count(values: Mapping[str, float]) -> int | None:
    return int(values.get("CA_ROTOR_COUNT", 0)) or None


_MANUAL: Final = _mode("MANUAL", 1, 0, "MANUAL", _T.BY_HAND, place=False)
_ALTCTL: Final = _mode("ALTCTL", 2, 0, "ALTITUDE", _T.BY_HAND, "ALTITUDE", place=False, centred=True, drifts=True)
_POSCTL: Final = _mode("POSCTL", 3, 0, "POSITION", _T.BY_HAND, "POSITION", centred=True)
_TAKEOFF: Final = _mode("AUTO.TAKEOFF", _AUTO, 2, "TAKEOFF", _T.BY_ITSELF, "TAKEOFF")
_LOITER: Final = _mode("AUTO.LOITER", _AUTO, 3, "LOITER", _T.BY_ITSELF, "LOITER", "HOLD")
_MISSION: Final = _mode("AUTO.MISSION", _AUTO, 4, "MISSION", _T.MISSION, "MISSION", mission=True)
_RTL: Final = _mode("AUTO.RTL", _AUTO, 5, "RETURN", _T.RETURN, "RTL", "RETURN")
_LAND: Final = _mode("AUTO.LAND", _AUTO, 6, "LAND", _T.LANDING, "LAND", place=False)
_PRECLAND: Final = _mode("AUTO.PRECLAND", _AUTO, 9, "PRECISION LAND", _T.LANDING, settable=False)
"""Entered by missions and returns; the mode that a pilot requests is LAND."""
_OFFBOARD: Final = _mode("OFFBOARD", 6, 0, "OFFBOARD", _T.BY_ITSELF, offered=False)

_MODES: Final = (
    _MANUAL,
    _ALTCTL,
    _POSCTL,
    _TAKEOFF,
    _LOITER,
    _MISSION,
    _RTL,
    _LAND,
    _mode("ACRO", 5, 0, "ACRO", _T.BY_HAND, place=False, offered=False),
    _OFFBOARD,
    _mode("STABILIZED", 7, 0, "STABILIZED", _T.BY_HAND, place=False),
    _PRECLAND,
    # Reported as a sub mode of POSCTL. It circles without sticks; sticks change the circle, centred sticks do not stop
    # it.
    replace(_mode("ORBIT", 3, 1, "ORBIT", None, settable=False), sticks=Sticks.ADJUST),
    _mode("POSCTL_SLOW", 3, 2, "POSITION SLOW", _T.BY_HAND, centred=True, offered=False),
    _mode("AUTO.READY", _AUTO, 1, "READY", None, settable=False),
    _mode("AUTO.FOLLOW", _AUTO, 8, "FOLLOW", None, settable=False),
    # AUTO without a sub mode is the mission.
    _mode("AUTO", _AUTO, 0, "AUTO", _T.MISSION, mission=True, settable=False),
)

_RCL_ACTIONS: Final = {1: _R.STAYS, 2: _R.RETURNS, 3: _R.LANDS}
_RCL_EXCEPTIONS: Final = {
    _MISSION.custom_mode: 1,
    _LOITER.custom_mode: 2,
    _TAKEOFF.custom_mode: 2,
    _OFFBOARD.custom_mode: 4,
}
"""COM_RCL_EXCEPT: mission, hold and take-off, off-board."""
_LANDINGS: Final = (_LAND.custom_mode, _PRECLAND.custom_mode)
_GOES_ON_WITHOUT_STICKS: Final = {2: (_RTL.custom_mode, *_LANDINGS), 3: _LANDINGS}
"""By NAV_RCL_ACT: who already returns or lands goes on with it."""


def _after_sticks(number: int, values: Mapping[str, float], without: bool) -> AfterSticks:
    action = values.get("NAV_RCL_ACT")
    if action is None:
        return _R.UNKNOWN
    if without and values.get("COM_RC_IN_MODE") == px4_sticks.NOBODYS:
        return _R.STAYS
    if int(values.get("COM_RCL_EXCEPT", 0)) & _RCL_EXCEPTIONS.get(number, 0):
        return _R.STAYS
    if number in _GOES_ON_WITHOUT_STICKS.get(int(action), ()):
        return _R.STAYS
    if action <= 0:
        return _R.STAYS if without else _R.UNKNOWN
    return _RCL_ACTIONS.get(int(action), _R.UNKNOWN)


def _station_lost(values: Mapping[str, float], number: int, mission_is_over: bool) -> tuple[LostAction, float] | None:
    if number in (_RTL.custom_mode, *_LANDINGS):
        return None
    over = mission_is_over and number == _MISSION.custom_mode
    return px4_loss.station_lost(values, _RCL_EXCEPTIONS.get(number, 0), mission_is_over=over)


def _keeping(vehicle_type: int, release: Release | None) -> KeptFields:
    return Px4()


_NOT_IN_MISSIONS: Final = frozenset(
    {
        int(_M.MAV_CMD_NAV_SPLINE_WAYPOINT),
        int(_M.MAV_CMD_NAV_LOITER_TURNS),
        int(_M.MAV_CMD_CONDITION_DELAY),
        int(_M.MAV_CMD_CONDITION_DISTANCE),
        int(_M.MAV_CMD_CONDITION_YAW),
        int(_M.MAV_CMD_DO_SET_RELAY),
        int(_M.MAV_CMD_DO_SET_SERVO),
    }
)

PX4: Final = AutopilotFamily(
    autopilot=int(_M.MAV_AUTOPILOT_PX4),
    name="px4",
    label="PX4",
    main_of=_main_of,
    custom_mode=custom_mode,
    reads_frames=False,
    zero_is_here=False,
    has_home_slot=False,
    targets_by_command=True,
    bytes_in_parameters=True,
    packs_parameters=False,
    log_folders=(b"/fs/microsd/log",),
    arms_with_throttle_down=False,
    return_heights={"RTL_RETURN_ALT": 1.0},
    silent_without_receiver=True,
    ignores_sticks=px4_sticks.ignores_tower,
    uses_receiver=px4_sticks.uses_receiver,
    sticks_settle_s=px4_sticks.settles_after_s,
    read_failsafe=px4_events.read_failsafe,
    make_checks=px4_checks.Px4Checks,
    prearm_by_health=True,
    shows_failsafe=True,
    answers_timesync=True,
    accepts_modes_it_does_not_enter=True,
    flies_on_in=frozenset({_LOITER.custom_mode}),
    decides_later=True,
    counts_from_last_release=True,
    loss_parameters=(
        "COM_RC_IN_MODE",
        "COM_RC_LOSS_T",
        "COM_DL_LOSS_T",
        "NAV_DLL_ACT",
        "COM_DLL_EXCEPT",
        "NAV_RCL_ACT",
        "COM_RCL_EXCEPT",
        "COM_OBL_RC_ACT",
        "COM_RC_OVERRIDE",
        "COM_RC_STICK_OV",
        "COM_FAIL_ACT_T",
        "SYS_HITL",
        "SIM_GZ_EN",
        "SENS_EN_GPSSIM",
    ),
    deciding_parameters=("COM_RC_IN_MODE", "NAV_RCL_ACT", "NAV_DLL_ACT"),
    after_sticks=_after_sticks,
    station_lost=_station_lost,
    keeping=_keeping,
    mission_lacks=_NOT_IN_MISSIONS,
    mission_hides=frozenset({int(_M.MAV_CMD_DO_SET_HOME), int(_M.MAV_CMD_DO_LAND_START)}),
    # It makes a mission start of the second one.
    arming_commands=frozenset({int(_M.MAV_CMD_MISSION_START), int(_M.MAV_CMD_DO_LAND_START)}),
    loss_sentences=px4_loss.loss_sentences,
    without_receiver=px4_loss.WITHOUT_RECEIVER,
    is_simulated=px4_loss.is_simulated,
    own_fence=_own_fence,
    motor_count=_motor_count,
)


def _take_off(state: VehicleState, command: TakeOff) -> Steps:
    phase = f"climbing to {command.height_m:g} m"
    is_armed = state.is_armed()
    altitude_m = state.above_sea(command.height_m)
    climb = common.command_long(_M.MAV_CMD_NAV_TAKEOFF, None, 0.0, 0.0, None, None, None, altitude_m)
    if is_armed:
        return (CommandStep(phase, climb),)
    return (CommandStep("getting ready to climb", climb), common.arming(phase=f"arming, {phase}"))


def _go_to(state: VehicleState, command: GoTo) -> Steps:
    return (common.reposition(PX4, state, command),)


def _turn(state: VehicleState, command: Turn) -> Steps:
    """Flies to the current position with the requested heading. This ends a mission or a return."""
    lat, lon = state.here()
    heading = (state.heading() + command.deg if command.relative else command.deg) % 360.0
    step = common.reposition(PX4, state, GoTo(lat, lon, state.height(), heading_deg=heading))
    return (CommandStep(f"turning to {heading:g}\u00b0", step.work),)


def _mission_from(state: VehicleState, item: int, phase: str) -> Steps:
    return (CommandStep(phase, common.command_long(_M.MAV_CMD_MISSION_START, float(item))),)


def _start(state: VehicleState, command: StartMission) -> Steps:
    state.check_item(command.item)
    state.is_armed()
    return _mission_from(state, command.item, f"flying the mission from item {command.item + 1}")


def _jump(state: VehicleState, command: Jump) -> Steps:
    state.check_item(command.item)
    if state.custom_mode != _MISSION.custom_mode or not state.armed:
        raise NotSupported(f"{state.name} flies PX4, which jumps only while it flies a mission: use `start` with item")
    return _mission_from(state, command.item, f"going to item {command.item + 1}")


def _orbit(state: VehicleState, command: Orbit) -> Steps:
    altitude = common.altitude_for(PX4, state, command.height_m)
    params = (command.radius_m, command.m_s, 0.0, None)
    work = common.command_at(_M.MAV_CMD_DO_ORBIT, (command.lat_deg, command.lon_deg), altitude, *params)
    return (CommandStep(f"circling at {abs(command.radius_m):g} m", work),)


def _look_at(state: VehicleState, command: LookAt) -> Steps:
    return common.look_at(PX4, state, command)


PROFILE: Final = AutopilotProfile(
    key="px4_multicopter",
    label="PX4",
    family=PX4,
    vehicle_types=MULTICOPTERS,
    modes=_MODES,
    roles=ModeRoles(
        hold=_LOITER,
        returns=_RTL,
        land=_LAND,
        mission=_MISSION,
        targets=_LOITER,
        setpoints=_OFFBOARD,
        by_hand=_POSCTL,
    ),
    failsafe=FailsafeModes(
        position_holds=(_LOITER, _POSCTL),
        altitude_hold=_ALTCTL,
        going_home=(_RTL, _LAND, _PRECLAND),
        return_=_RTL,
        land=_LAND,
        mission=_MISSION,
        pauses=(_LOITER,),
    ),
    commands=CommandTable(
        arm=common.arm,
        disarm=common.disarm,
        mode=change_mode(_MODES),
        takeoff=_take_off,
        goto=_go_to,
        hold=into(_LOITER),
        pause=into(_LOITER),
        resume=into(_MISSION),
        land=into(_LAND),
        rtl=into(_RTL),
        speed=common.change_speed,
        turn=_turn,
        set_home=common.set_home,
        start=_start,
        jump=_jump,
        orbit=_orbit,
        roi=_look_at,
        servo=payload_steps.px4_set_servo,
        gripper=payload_steps.move_gripper,
        gimbal=camera_steps.point_gimbal,
        zoom=camera_steps.zoom,
        photo=camera_steps.photo,
        record=camera_steps.record,
        calibrate=setup_commands.px4_calibrate,
        calibration_pose=Unable("sees by itself how the drone lies"),
        calibration_end=setup_commands.px4_end,
        motor_test=setup_commands.px4_test_motor,
        reboot=setup_commands.reboot,
    ),
    stands_in=True,
)
