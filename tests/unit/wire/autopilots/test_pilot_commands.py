"""Every profile and every pilot command: the handwritten MAVLink commands, or a reason for their absence."""

import math
from dataclasses import fields, replace

import msgspec
import pytest

from wire.autopilots import arducopter, px4_multicopter
from wire.autopilots.commands import (
    Arm,
    Calibrate,
    CalibrationPose,
    ChangeMode,
    ChangeSpeed,
    CommandRefused,
    CommandTable,
    Disarm,
    EndCalibration,
    GoTo,
    Hold,
    Jump,
    Land,
    LookAt,
    NotSupported,
    Orbit,
    Pause,
    Reboot,
    Resume,
    Return,
    Sensor,
    SetHome,
    SpinMotor,
    StartMission,
    TakeOff,
    Turn,
    VehicleState,
    overrules,
)
from wire.autopilots.payload_commands import (
    MoveGripper,
    PointGimbal,
    RecordVideo,
    SetServo,
    TakePhotos,
    ZoomCamera,
)
from wire.autopilots.pilot_command import PilotCommand
from wire.autopilots.profile import AutopilotProfile
from wire.autopilots.registry import PROFILES
from wire.transactions import CommandWork

NAN = None
COMMANDS: dict[str, PilotCommand] = {
    "arm": Arm(),
    "disarm": Disarm(force=True),
    "mode": ChangeMode("rtl"),
    "takeoff": TakeOff(20),
    "goto": GoTo(47.1, 8.2, 30, heading_deg=90),
    "hold": Hold(),
    "pause": Pause(),
    "resume": Resume(),
    "land": Land(),
    "rtl": Return(),
    "speed": ChangeSpeed(4),
    "turn": Turn(90),
    "set_home": SetHome((47.1, 8.2)),
    "start": StartMission(2),
    "jump": Jump(2),
    "orbit": Orbit(47.1, 8.2, 25, 30, 3),
    "roi": LookAt((47.1, 8.2, 2)),
    "servo": SetServo(5, 1750),
    "gripper": MoveGripper(grab=True, gripper=2),
    "gimbal": PointGimbal(-90, 45, locked=True),
    "zoom": ZoomCamera(percent=30),
    "photo": TakePhotos(count=3, every_s=2),
    "record": RecordVideo(101, on=True),
    "calibrate": Calibrate(Sensor.COMPASS),
    "calibration_pose": CalibrationPose(3),
    "calibration_end": EndCalibration(keep=False),
    "motor_test": SpinMotor(2, 5, 1.5),
    "reboot": Reboot(),
}
"""One of each, by the name of its field in `CommandTable`."""
FLYING_MISSION = VehicleState(
    "hawk", 3, armed=True, airborne=True, home_alt_m=500.0, place_deg=(47.3, 8.4), height_m=12.0, mission_items=9
)


def long(command: int, *params: float | None) -> CommandWork:
    return CommandWork(command, (*params, *[0.0] * (7 - len(params))))  # type: ignore[arg-type]


def at(command: int, frame: int, alt_m: float, *params: float | None) -> CommandWork:
    return CommandWork(command, (*params, 0.0, 0.0, alt_m), 471000000, 82000000, frame)  # type: ignore[arg-type]


def camera(command: int, component: int, *params: float | None) -> CommandWork:
    return msgspec.structs.replace(long(command, *params), component=component)


HERE_E7 = (473000000, 84000000)
EAST = math.pi / 2
CAMERA: dict[str, list[CommandWork]] = {
    "gimbal": [long(1001, -2, -2, -1, -1), long(1000, -90, 45, NAN, NAN, 28, 0, 0)],
    "zoom": [camera(531, 100, 2, 30)],
    "photo": [camera(2000, 100, 0, 2, 3)],
    "record": [camera(2500, 101)],
}
GOLDEN: dict[str, dict[str, list[CommandWork]]] = {
    "arducopter": {
        "arm": [long(400, 1)],
        "disarm": [long(400, 0, 21196)],
        "mode": [long(176, 1, 6)],
        "takeoff": [long(176, 1, 4), long(22, 0, 0, 0, 0, 0, 0, 20)],
        "goto": [at(192, 3, 30, -1, 1, 0, EAST), long(115, 90, 0, 0, 0)],
        "hold": [long(176, 1, 17)],
        "pause": [long(193, 0)],
        "resume": [long(193, 1)],
        "land": [long(176, 1, 9)],
        "rtl": [long(176, 1, 6)],
        "speed": [long(178, 1, 4, -1)],
        "turn": [long(115, 90, 0, 0, 0)],
        "set_home": [at(179, 0, 500, 0, 0, 0, 0)],
        "start": [long(224, 3, 1), long(300)],
        "jump": [long(224, 3, 0)],
        "roi": [at(195, 3, 2, 0, 0, 0, 0)],
        "servo": [long(183, 5, 1750)],
        "gripper": [long(211, 2, 1)],
        **CAMERA,
        "calibrate": [long(42424, 0, 1)],
        "calibration_pose": [long(42429, 3)],
        "calibration_end": [long(42426)],
        "motor_test": [long(209, 2, 0, 5, 1.5, 1)],
        "reboot": [long(246, 1)],
    },
    "px4_multicopter": {
        "arm": [long(400, 1)],
        "disarm": [long(400, 0, 21196)],
        "mode": [long(176, 1, 4, 5)],
        "takeoff": [long(22, NAN, 0, 0, NAN, NAN, NAN, 520)],
        "goto": [at(192, 0, 530, -1, 1, 0, EAST)],
        "hold": [long(176, 1, 4, 3)],
        "pause": [long(176, 1, 4, 3)],
        "resume": [long(176, 1, 4, 4)],
        "land": [long(176, 1, 4, 6)],
        "rtl": [long(176, 1, 4, 5)],
        "speed": [long(178, 1, 4, -1)],
        "turn": [CommandWork(192, (-1, 1, 0, EAST, 0, 0, 512), *HERE_E7, 0)],
        "set_home": [at(179, 0, 500, 0, 0, 0, 0)],
        "start": [long(300, 2)],
        "jump": [long(300, 2)],
        "orbit": [at(34, 0, 530, 25, 3, 0, NAN)],
        "roi": [at(195, 0, 502, 0, 0, 0, 0)],
        "servo": [long(187, NAN, NAN, NAN, NAN, 0.5, NAN, 0)],
        "gripper": [long(211, 2, 1)],
        **CAMERA,
        "calibrate": [long(241, 0, 1)],
        "calibration_end": [long(241)],
        "motor_test": [long(310, 0.05, 1.5, 0, 0, 2)],
        "reboot": [long(246, 1)],
    },
    "arduplane": {"hold": [long(176, 1, 12)], "rtl": [long(176, 1, 11)]},
    "ardurover": {},
    "ardusub": {},
    "msp_multicopter": {
        "arm": [long(400, 1)],
        "disarm": [long(400, 0)],
        "mode": [long(176, 1, 3)],
        "rtl": [long(176, 1, 3)],
        "servo": [long(183, 5, 1750)],
    },
}
"""A missing command has a reason."""


def flying_mission(profile: AutopilotProfile) -> VehicleState:
    assert profile.roles.mission is not None
    return replace(FLYING_MISSION, custom_mode=profile.roles.mission.custom_mode)


def test_nothing_is_left_out() -> None:
    names = {field.name for field in fields(CommandTable)}
    assert set(COMMANDS) == names
    assert all(command.name == name for name, command in COMMANDS.items())
    assert set(GOLDEN) == {profile.key for profile in PROFILES}
    assert all(set(said) <= names for said in GOLDEN.values())


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("profile", PROFILES, ids=lambda one: one.key)
def test_each_command_becomes_these_or_has_a_reason(profile: AutopilotProfile, name: str) -> None:
    golden = GOLDEN[profile.key].get(name)
    if golden is None:
        reason = profile.why_not(name)
        assert reason is not None and reason.startswith(f"{profile.label} ")
        with pytest.raises(NotSupported, match=f"hawk flies {profile.label}, which "):
            profile.steps(flying_mission(profile), COMMANDS[name])
        return
    assert profile.why_not(name) is None
    steps = profile.steps(flying_mission(profile), COMMANDS[name])
    assert [step.work for step in steps if not step.needless] == golden
    assert all(step.phase for step in steps)
    assert not steps[-1].needless


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("profile", PROFILES, ids=lambda one: one.key)
def test_what_is_not_known_is_a_reason_and_no_error(profile: AutopilotProfile, name: str) -> None:
    try:
        assert profile.steps(VehicleState("hawk", 0), COMMANDS[name])
    except CommandRefused as refused:
        assert "hawk" in str(refused)


def test_a_servo_of_the_companion_computer_is_named_by_a_number_that_px4_has_not() -> None:
    assert [step.work for step in px4_multicopter.PROFILE.steps(FLYING_MISSION, SetServo(15, 600))] == [
        long(183, 15, 600)
    ]


@pytest.mark.parametrize(("pulse_us", "value"), [(1000, -1), (1500, 0), (2000, 1)])
def test_px4_moves_an_actuator_between_its_ends(pulse_us: int, value: float) -> None:
    (step,) = px4_multicopter.PROFILE.steps(FLYING_MISSION, SetServo(1, pulse_us))
    assert step.work == long(187, value, NAN, NAN, NAN, NAN, NAN, 0)


@pytest.mark.parametrize("pulse_us", [999, 2001])
def test_px4_refuses_a_pulse_beyond_them_with_words(pulse_us: int) -> None:
    with pytest.raises(NotSupported, match=f"hawk flies PX4, .* 1000 to 2000 .*, not {pulse_us}"):
        px4_multicopter.PROFILE.steps(FLYING_MISSION, SetServo(1, pulse_us))


@pytest.mark.parametrize("command", [SetServo(9, 1100), MoveGripper(grab=False), PointGimbal(-90), TakePhotos()])
def test_what_moves_the_payload_does_not_end_the_flight_it_is_on(command: PilotCommand) -> None:
    for profile in (arducopter.PROFILE, px4_multicopter.PROFILE):
        assert not overrules(command, profile.steps(FLYING_MISSION, command))


@pytest.mark.parametrize(
    ("command", "work"),
    [
        (ZoomCamera(direction=1), camera(531, 100, 1, 1)),
        (ZoomCamera(direction=-1), camera(531, 100, 1, -1)),
        (ZoomCamera(), camera(531, 100, 1, 0)),
        (TakePhotos(component=1), long(2000, 0, 0, 1)),
        (TakePhotos(stop=True), camera(2001, 100, 0)),
        (RecordVideo(on=False), camera(2501, 100, 0)),
    ],
)
def test_a_camera_is_asked_in_its_own_protocol(command: PilotCommand, work: CommandWork) -> None:
    (step,) = arducopter.PROFILE.steps(FLYING_MISSION, command)
    assert step.work == work
