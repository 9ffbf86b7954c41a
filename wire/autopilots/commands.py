"""The commands of a pilot as plain values, and the steps of MAV_CMDs that implement them. Pure.

Each autopilot's profile has a `CommandTable`. It implements each command or states why the autopilot has none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

from wire.autopilots.payload_commands import (
    CameraCommand,
    MoveGripper,
    PointGimbal,
    RecordVideo,
    SetServo,
    TakePhotos,
    ZoomCamera,
)
from wire.autopilots.pilot_command import PilotCommand
from wire.dialect import mavlink
from wire.transactions import CommandWork

FORCE_DISARM: Final = 21196.0
"""param2 of MAV_CMD_COMPONENT_ARM_DISARM that makes ArduPilot and PX4 disarm in any state."""


class CommandRefused(Exception):
    """This vehicle cannot execute the command. The message is a sentence for people that names the drone."""


class NotSupported(CommandRefused):
    """The autopilot lacks this function, or no way to request it is known."""


class NotHeardYet(CommandRefused):
    """The command needs a value that the drone has not reported yet."""


class UnknownMode(CommandRefused):
    """This autopilot has no such mode."""


class UnknownItem(CommandRefused):
    """The item is beyond the plan on board."""


class Sensor(StrEnum):
    """What a calibration calibrates."""

    ACCELEROMETER = "accelerometer"
    """In six positions."""
    LEVEL = "level"
    GYROSCOPE = "gyroscope"
    COMPASS = "compass"
    BAROMETER = "barometer"


@dataclass(frozen=True)
class Arm(PilotCommand):
    name = "arm"


@dataclass(frozen=True)
class Disarm(PilotCommand):
    """`force` disarms in the air too, where the drone falls."""

    name = "disarm"
    force: bool = False


@dataclass(frozen=True)
class ChangeMode(PilotCommand):
    name = "mode"
    mode: str


@dataclass(frozen=True)
class TakeOff(PilotCommand):
    """Enters a mode that can take off, arms if necessary, and climbs."""

    name = "takeoff"
    height_m: float


@dataclass(frozen=True)
class GoTo(PilotCommand):
    """`heading_deg`: nose direction, clockwise from north; None: the autopilot's own rule applies."""

    name = "goto"
    lat_deg: float
    lon_deg: float
    height_m: float
    speed_m_s: float | None = None
    heading_deg: float | None = None


@dataclass(frozen=True)
class Hold(PilotCommand):
    """Holds position without sticks."""

    name = "hold"


@dataclass(frozen=True)
class Pause(PilotCommand):
    name = "pause"


@dataclass(frozen=True)
class Resume(PilotCommand):
    """Resumes what was paused, else the mission."""

    name = "resume"


@dataclass(frozen=True)
class Land(PilotCommand):
    name = "land"


@dataclass(frozen=True)
class Return(PilotCommand):
    """Returns to home by the autopilot's own rule, and lands."""

    name = "rtl"


@dataclass(frozen=True)
class ChangeSpeed(PilotCommand):
    """Ground speed."""

    name = "speed"
    m_s: float


@dataclass(frozen=True)
class Turn(PilotCommand):
    """Turns to a heading, or with `relative` by an angle, clockwise."""

    name = "turn"
    deg: float
    relative: bool = False


@dataclass(frozen=True)
class SetHome(PilotCommand):
    """`place_deg`: latitude and longitude; None: the current position. `altitude_m`: above sea level; None: the
    altitude of the present home, except that a drone on the ground makes its own position home."""

    name = "set_home"
    place_deg: tuple[float, float] | None = None
    altitude_m: float | None = None


@dataclass(frozen=True)
class StartMission(PilotCommand):
    """Starts at this item, counted from 0 without home; arms if necessary."""

    name = "start"
    item: int = 0


@dataclass(frozen=True)
class Jump(PilotCommand):
    """Jumps to this item of the running mission."""

    name = "jump"
    item: int


@dataclass(frozen=True)
class Orbit(PilotCommand):
    """A negative `radius_m` orbits counter-clockwise."""

    name = "orbit"
    lat_deg: float
    lon_deg: float
    radius_m: float
    height_m: float
    m_s: float | None = None


@dataclass(frozen=True)
class LookAt(PilotCommand):
    """`place`: latitude, longitude, height above home; None: ahead again."""

    name = "roi"
    place: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Calibrate(PilotCommand):
    """Starts the calibration of a sensor, on the ground and disarmed."""

    name = "calibrate"
    sensor: Sensor


@dataclass(frozen=True)
class CalibrationPose(PilotCommand):
    """The drone lies as the calibration of its accelerometer asked: 1 level, 2 left, 3 right, 4 nose down, 5 nose up, 6
    on its back."""

    name = "calibration_pose"
    pose: int


@dataclass(frozen=True)
class EndCalibration(PilotCommand):
    """Keeps the result of a compass calibration, or cancels it."""

    name = "calibration_end"
    keep: bool


@dataclass(frozen=True)
class SpinMotor(PilotCommand):
    """Turns one motor of a disarmed drone. `motor`: from 1, in the autopilot's test order."""

    name = "motor_test"
    motor: int
    throttle_percent: float
    for_s: float


@dataclass(frozen=True)
class Reboot(PilotCommand):
    """Restarts the autopilot."""

    name = "reboot"


@dataclass(frozen=True)
class CommandStep:
    """One MAV_CMD. `phase`: description for people. `needless`: the drone is already in the requested state. `item`:
    of the mission, from 0, whose effect it sets again."""

    phase: str
    work: CommandWork
    needless: bool = False
    item: int | None = None


@dataclass(frozen=True)
class VehicleState:
    """What is known of the commanded vehicle at this moment. None: not known."""

    name: str
    """The drone's name, for sentences."""
    custom_mode: int
    """From its heartbeat."""
    armed: bool | None = None
    airborne: bool | None = None
    home_alt_m: float | None = None
    """Above sea level."""
    place_deg: tuple[float, float] | None = None
    """Latitude and longitude."""
    height_m: float | None = None
    """Above home."""
    heading_deg: float | None = None
    mission_items: int | None = None
    """None: the plan on board is not known."""

    def is_armed(self) -> bool:
        """Raises NotHeardYet if unknown: no command that arms starts without this."""
        if self.armed is None:
            raise NotHeardYet(f"it is not known whether {self.name} is armed: its autopilot is silent")
        return self.armed

    def here(self) -> tuple[float, float]:
        """Returns latitude and longitude. Raises NotHeardYet."""
        if self.place_deg is None:
            raise NotHeardYet(f"the position of {self.name} is not known yet")
        return self.place_deg

    def height(self) -> float:
        """Returns the height above home. Raises NotHeardYet."""
        if self.height_m is None:
            raise NotHeardYet(f"the height of {self.name} is not known yet")
        return self.height_m

    def heading(self) -> float:
        """Returns the heading, clockwise from north. Raises NotHeardYet."""
        if self.heading_deg is None:
            raise NotHeardYet(f"the heading of {self.name} is not known yet")
        return self.heading_deg

    def above_sea(self, height_m: float) -> float:
        """Converts a height above home to an altitude above sea level. Raises NotHeardYet."""
        if self.home_alt_m is None:
            raise NotHeardYet(f"the home of {self.name} is not known yet")
        return self.home_alt_m + height_m

    def check_item(self, item: int) -> None:
        """Raises UnknownItem for an item beyond the mission on board, if that mission is known."""
        if self.mission_items is not None and item >= self.mission_items:
            count = self.mission_items
            there = f"the mission on board has {count} items" if count else "no mission is on board"
            raise UnknownItem(f"{self.name} has no item {item + 1}: {there}")


Steps = tuple[CommandStep, ...]
"""Executed in order, up to the first step that is not accepted. At least one; the last is never needless."""

C_contra = TypeVar("C_contra", bound=PilotCommand, contravariant=True)


@dataclass(frozen=True)
class Unable(Generic[C_contra]):
    """Why the autopilot cannot do it: the words that follow "ArduCopter, which"."""

    which: str


Said = Callable[[VehicleState, C_contra], Steps] | Unable[C_contra]
"""Translates a command into steps. Raises CommandRefused if this vehicle cannot execute it now."""


@dataclass(frozen=True, kw_only=True)
class CommandTable:
    """One field for each command, named as the command is."""

    arm: Said[Arm]
    disarm: Said[Disarm]
    mode: Said[ChangeMode]
    takeoff: Said[TakeOff]
    goto: Said[GoTo]
    hold: Said[Hold]
    pause: Said[Pause]
    resume: Said[Resume]
    land: Said[Land]
    rtl: Said[Return]
    speed: Said[ChangeSpeed]
    turn: Said[Turn]
    set_home: Said[SetHome]
    start: Said[StartMission]
    jump: Said[Jump]
    orbit: Said[Orbit]
    roi: Said[LookAt]
    servo: Said[SetServo]
    gripper: Said[MoveGripper]
    gimbal: Said[PointGimbal]
    zoom: Said[ZoomCamera]
    photo: Said[TakePhotos]
    record: Said[RecordVideo]
    calibrate: Said[Calibrate]
    calibration_pose: Said[CalibrationPose]
    calibration_end: Said[EndCalibration]
    motor_test: Said[SpinMotor]
    reboot: Said[Reboot]


SETUP: Final = (Calibrate, CalibrationPose, EndCalibration, SpinMotor, Reboot)
"""Only on the ground and disarmed."""
_PAYLOAD: Final = (CameraCommand, LookAt, MoveGripper, PointGimbal, SetServo)
_BESIDE: Final = (Arm, ChangeSpeed, SetHome, Turn, *_PAYLOAD, *SETUP)
"""These commands do not change the flight, unless one of their steps is a command that does."""
_FLIES: Final = frozenset({int(mavlink.MAV_CMD_DO_REPOSITION), int(mavlink.MAV_CMD_DO_SET_MODE)})


def overrules(command: PilotCommand, steps: Steps) -> bool:
    """Returns whether the command sets how the drone flies: earlier requests must not run after it."""
    return not isinstance(command, _BESIDE) or any(step.work.command in _FLIES for step in steps)
