"""ArduCopter: multicopters and helicopters of ArduPilot. Measured on 4.6 and 4.7.

ArduCopter reads heights in the frame of the message. It refuses to arm in most modes, so it is armed in GUIDED. It
ignores the speed and the heading of DO_REPOSITION, so both follow as separate commands. Item 0 of its mission is home.
"""

from __future__ import annotations

from typing import Final

from wire.autopilots import camera_steps, common, payload_steps, setup_commands
from wire.autopilots.ardupilot import ARDUPILOT, modes_in
from wire.autopilots.commands import (
    CommandStep,
    CommandTable,
    GoTo,
    Jump,
    LookAt,
    Pause,
    Resume,
    StartMission,
    Steps,
    TakeOff,
    Turn,
    Unable,
    VehicleState,
)
from wire.autopilots.profile import (
    AutopilotProfile,
    FailsafeModes,
    FlightMode,
    FlightTask,
    ModeRoles,
    Sticks,
    change_mode,
    into,
    mode_step,
)
from wire.autopilots.vehicle_types import MULTICOPTERS
from wire.dialect import mavlink

_M: Final = mavlink
_T: Final = FlightTask


def _mode(
    name: str,
    number: int,
    sticks: Sticks,
    task: FlightTask,
    *,
    place: bool = True,
    centred: bool = False,
    drifts: bool = False,
    mission: bool = False,
    offered: bool = True,
) -> FlightMode:
    return FlightMode(
        name,
        number,
        (number, 0),
        name.replace("_", " "),
        sticks=sticks,
        task=task,
        needs_position=place,
        holds_when_centred=centred,
        drifts=drifts,
        flies_mission=mission,
        offered=offered,
    )


_STABILIZE: Final = _mode("STABILIZE", 0, Sticks.FLY, _T.BY_HAND, place=False)
_ACRO: Final = _mode("ACRO", 1, Sticks.FLY, _T.BY_HAND, place=False, offered=False)
_ALT_HOLD: Final = _mode("ALT_HOLD", 2, Sticks.FLY, _T.BY_HAND, place=False, centred=True, drifts=True)
_AUTO: Final = _mode("AUTO", 3, Sticks.IGNORED, _T.MISSION, mission=True)
_GUIDED: Final = _mode("GUIDED", 4, Sticks.IGNORED, _T.BY_ITSELF)
_LOITER: Final = _mode("LOITER", 5, Sticks.FLY, _T.BY_HAND, centred=True)
_RTL: Final = _mode("RTL", 6, Sticks.IGNORED, _T.RETURN)
_CIRCLE: Final = _mode("CIRCLE", 7, Sticks.CLIMB, _T.BY_HAND, centred=True)
"""Measured: with a receiver at rest and no sticks, 40 m to the ground in 17 s."""
_LAND: Final = _mode("LAND", 9, Sticks.IGNORED, _T.LANDING, place=False)
_POSHOLD: Final = _mode("POSHOLD", 16, Sticks.FLY, _T.BY_HAND, centred=True)
_BRAKE: Final = _mode("BRAKE", 17, Sticks.IGNORED, _T.BY_ITSELF)
_GUIDED_NOGPS: Final = _mode("GUIDED_NOGPS", 20, Sticks.IGNORED, _T.BY_ITSELF, place=False, offered=False)
_SMART_RTL: Final = _mode("SMART_RTL", 21, Sticks.IGNORED, _T.RETURN)
_AUTO_RTL: Final = _mode("AUTO_RTL", 27, Sticks.IGNORED, _T.RETURN, mission=True, offered=False)
"""Flies the end of the mission."""

_KNOWN: Final = {
    mode.name: mode
    for mode in (
        *(_STABILIZE, _ACRO, _ALT_HOLD, _AUTO, _GUIDED, _LOITER, _RTL),
        *(_CIRCLE, _LAND, _POSHOLD, _BRAKE, _GUIDED_NOGPS, _SMART_RTL, _AUTO_RTL),
    )
}
_MODES: Final = modes_in("COPTER_MODE", _KNOWN)
_TURTLE: Final = next(mode.custom_mode for mode in _MODES if mode.name == "TURTLE")
"""Spins motors of a drone that lies on its back."""


def _take_off(state: VehicleState, command: TakeOff) -> Steps:
    """The tower does not repeat an unanswered step: retries are the agent's decision."""
    climb = common.command_long(_M.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, command.height_m)
    return (*_ready(state, armed=state.is_armed()), CommandStep(f"climbing to {command.height_m:g} m", climb))


def _ready(state: VehicleState, *, armed: bool) -> Steps:
    return (mode_step(_GUIDED, state), common.arming(needless=armed))


def _go_to(state: VehicleState, command: GoTo) -> Steps:
    steps = [common.reposition(ARDUPILOT, state, command)]
    if command.speed_m_s is not None:
        steps.append(common.speed_step(command.speed_m_s))
    if command.heading_deg is not None:
        steps += _turn(state, Turn(command.heading_deg))
    return tuple(steps)


def _pause(state: VehicleState, command: Pause) -> Steps:
    return (CommandStep("pausing", common.command_long(_M.MAV_CMD_DO_PAUSE_CONTINUE, 0.0)),)


def _resume(state: VehicleState, command: Resume) -> Steps:
    if state.custom_mode in (_AUTO.custom_mode, _GUIDED.custom_mode):
        return (CommandStep("going on", common.command_long(_M.MAV_CMD_DO_PAUSE_CONTINUE, 1.0)),)
    return (mode_step(_AUTO),)


def _turn(state: VehicleState, command: Turn) -> Steps:
    """Turns the short way to a heading. A relative turn follows the sign of its angle."""
    relative = command.relative
    deg = command.deg if relative else command.deg % 360.0
    direction = (-1.0 if deg < 0 else 1.0) if relative else 0.0
    work = common.command_long(_M.MAV_CMD_CONDITION_YAW, abs(deg), 0.0, direction, 1.0 if relative else 0.0)
    return (CommandStep(f"turning {'by' if relative else 'to'} {deg:g}\u00b0", work),)


def _set_item(item: int, *, anew: bool) -> CommandStep:
    """Home is item 0. `anew` restarts the jump counters."""
    work = common.command_long(_M.MAV_CMD_DO_SET_MISSION_CURRENT, item + 1.0, 1.0 if anew else 0.0)
    return CommandStep(f"going to item {item + 1}", work)


def _start(state: VehicleState, command: StartMission) -> Steps:
    state.check_item(command.item)
    ready = () if state.is_armed() else _ready(state, armed=False)
    start = CommandStep(
        f"flying the mission from item {command.item + 1}", common.command_long(_M.MAV_CMD_MISSION_START)
    )
    return (*ready, _set_item(command.item, anew=True), start)


def _jump(state: VehicleState, command: Jump) -> Steps:
    state.check_item(command.item)
    return (_set_item(command.item, anew=False),)


def _look_at(state: VehicleState, command: LookAt) -> Steps:
    return common.look_at(ARDUPILOT, state, command)


PROFILE: Final = AutopilotProfile(
    key="arducopter",
    label="ArduCopter",
    family=ARDUPILOT,
    vehicle_types=MULTICOPTERS,
    modes=_MODES,
    arming_modes=frozenset({_TURTLE}),
    roles=ModeRoles(
        hold=_BRAKE,
        returns=_RTL,
        land=_LAND,
        mission=_AUTO,
        guided=_GUIDED,
        targets=_GUIDED,
        setpoints=_GUIDED,
        by_hand=_LOITER,
    ),
    failsafe=FailsafeModes(
        position_holds=(_LOITER, _POSHOLD, _BRAKE),
        altitude_hold=_ALT_HOLD,
        going_home=(_RTL, _LAND, _SMART_RTL, _AUTO_RTL),
        return_=_RTL,
        land=_LAND,
        mission=_AUTO,
        pauses=(_BRAKE, _GUIDED),
    ),
    commands=CommandTable(
        arm=common.arm,
        disarm=common.disarm,
        mode=change_mode(_MODES),
        takeoff=_take_off,
        goto=_go_to,
        hold=into(_BRAKE),
        pause=_pause,
        resume=_resume,
        land=into(_LAND),
        rtl=into(_RTL),
        speed=common.change_speed,
        turn=_turn,
        set_home=common.set_home,
        start=_start,
        jump=_jump,
        orbit=Unable("circles a place in missions only: plan it"),
        roi=_look_at,
        servo=payload_steps.set_servo,
        gripper=payload_steps.move_gripper,
        gimbal=camera_steps.point_gimbal,
        zoom=camera_steps.zoom,
        photo=camera_steps.photo,
        record=camera_steps.record,
        calibrate=setup_commands.ardupilot_calibrate,
        calibration_pose=setup_commands.ardupilot_pose,
        calibration_end=setup_commands.ardupilot_end,
        motor_test=setup_commands.ardupilot_test_motor,
        reboot=setup_commands.reboot,
    ),
)
