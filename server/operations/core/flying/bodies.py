"""The commands of the API, as request bodies. Degrees, metres above home, metres a second."""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from server.kernel.bad_field import BadField
from server.operations.core.person import MAX_M, MIN_M, USUAL_M
from wire.autopilots.commands import Sensor
from wire.autopilots.payload_commands import (
    AUTOPILOT,
    CAMERA,
    MAX_CAMERAS,
    MAX_GRIPPER,
    MAX_PULSE_US,
    MAX_SERVO,
    MIN_PULSE_US,
)
from wire.following import MAX_OFFSET_M
from wire.plans import MAX_ITEMS_ANY

MAX_TEST_PERCENT: Final = 30
"""More than a motor without a propeller needs to show which one it is, and which way it turns."""
MAX_TEST_S: Final = 5

Latitude = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
Longitude = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Height = Annotated[float, Field(ge=-1000, le=10_000, allow_inf_nan=False, description="Above home")]
Speed = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
Heading = Annotated[float, Field(ge=-360, le=360, allow_inf_nan=False)]
Offset = Annotated[float, Field(ge=-MAX_OFFSET_M, le=MAX_OFFSET_M, allow_inf_nan=False)]
ItemNumber = Annotated[int, Field(ge=0, lt=MAX_ITEMS_ANY, description="Index in the plan, from 0")]


class _Command(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Arm(_Command):
    command: Literal["arm"]


class Disarm(_Command):
    """`force`: also in the air, where the drone falls."""

    command: Literal["disarm"]
    force: bool = False


class ChangeMode(_Command):
    command: Literal["mode"]
    mode: Annotated[str, Field(min_length=1, max_length=32, description="In the autopilot's own terms")]


class TakeOff(_Command):
    """Changes to a suitable mode, arms if necessary, and takes off."""

    command: Literal["takeoff"]
    height_m: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False, description="Above home")]


class GoTo(_Command):
    """`heading_deg`: clockwise from north; omitted: the autopilot decides."""

    command: Literal["goto"]
    lat: Latitude
    lon: Longitude
    height_m: Height
    speed_m_s: Speed | None = None
    heading_deg: Heading | None = None


class LandAt(_Command):
    """Flies there as `goto` does, and lands there once it has arrived."""

    command: Literal["land_at"]
    lat: Latitude
    lon: Longitude
    height_m: Height
    speed_m_s: Speed | None = None


class Simple(_Command):
    """`hold`: stays in place without sticks. `resume`: continues what was paused, else the mission."""

    command: Literal["land", "rtl", "hold", "pause", "resume"]


class SetHome(_Command):
    """Moves home to a position, or `here`. `altitude_m` is above sea level; omitted: home's present altitude. In the
    air this changes all heights above home, so `here` keeps home's altitude, and `while_flying` must confirm."""

    command: Literal["set_home"]
    here: bool = False
    while_flying: bool = False
    lat: Latitude | None = None
    lon: Longitude | None = None
    altitude_m: Annotated[float, Field(ge=-1000, le=10_000, allow_inf_nan=False)] | None = None

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Self:
        place = (self.lat, self.lon, self.altitude_m)
        if self.here and place != (None, None, None):
            raise BadField("either here, or a place")
        if not self.here and None in place[:2]:
            raise BadField("lat and lon are needed, or here")
        return self


class ChangeSpeed(_Command):
    command: Literal["speed"]
    m_s: Speed


class Turn(_Command):
    """Turns to this heading; `relative`: by this angle, clockwise. `yaw` is the older name of `turn`."""

    command: Literal["turn", "yaw"]
    deg: Heading
    relative: bool = False


class Start(_Command):
    """Flies the mission from this item on; arms first if necessary. What earlier items have set (speeds, the camera,
    where it looks) is set again. `as_it_is`: it is not, and what cannot be set again is no reason to refuse."""

    command: Literal["start"]
    item: ItemNumber = 0
    as_it_is: bool = False


class Jump(_Command):
    """Goes on with this item. `as_it_is`: as for `start`."""

    command: Literal["jump"]
    item: ItemNumber
    as_it_is: bool = False


class Orbit(_Command):
    """`radius_m` negative: counter-clockwise."""

    command: Literal["orbit"]
    lat: Latitude
    lon: Longitude
    radius_m: Annotated[float, Field(ge=-2000, le=2000, allow_inf_nan=False)]
    height_m: Height
    m_s: Speed | None = None

    @model_validator(mode="after")
    def _round_something(self) -> Self:
        if abs(self.radius_m) < 1.0:
            raise BadField("radius_m is 1 at least, or -1")
        return self


class LookAt(_Command):
    """Points the camera at a position, or ends that (`none`)."""

    command: Literal["roi"]
    none: bool = False
    lat: Latitude | None = None
    lon: Longitude | None = None
    height_m: Height | None = None

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Self:
        place = (self.lat, self.lon, self.height_m)
        if self.none and place != (None, None, None):
            raise BadField("either none, or a place")
        if not self.none and None in place:
            raise BadField("lat, lon and height_m are needed, or none")
        return self


class SetServo(_Command):
    """Moves a servo: an output of the autopilot, or a pin of the companion computer that has this number."""

    command: Literal["servo"]
    servo: Annotated[int, Field(ge=1, le=MAX_SERVO)]
    pulse_us: Annotated[int, Field(ge=MIN_PULSE_US, le=MAX_PULSE_US, description="Microseconds")]


class MoveGripper(_Command):
    """`release` drops what the gripper holds."""

    command: Literal["gripper"]
    action: Literal["release", "grab"]
    gripper: Annotated[int, Field(ge=1, le=MAX_GRIPPER)] = 1


class PointGimbal(_Command):
    """Points the gimbal. `pitch_deg` -90 is straight down; `yaw_deg` clockwise from the nose, with `locked` from
    north."""

    command: Literal["gimbal"]
    pitch_deg: Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
    yaw_deg: Heading = 0.0
    locked: bool = False


class _Camera(_Command):
    camera: Annotated[int, Field(ge=0, le=MAX_CAMERAS, description="From 1; 0: the one that the autopilot drives")] = 1

    @property
    def component(self) -> int:
        """Its MAVLink component id."""
        return CAMERA + self.camera - 1 if self.camera else AUTOPILOT


class ZoomCamera(_Camera):
    """To a share of its range, or on and on until stopped."""

    command: Literal["zoom"]
    percent: Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)] | None = None
    direction: Literal["in", "out", "stop"] | None = None

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Self:
        if (self.percent is None) == (self.direction is None):
            raise BadField("either percent or direction is needed")
        return self


class TakePhotos(_Camera):
    """`count` 0: until `stop`."""

    command: Literal["photo"]
    count: Annotated[int, Field(ge=0, le=10_000)] = 1
    every_s: Annotated[float, Field(ge=0, le=3600, allow_inf_nan=False, description="Between two")] = 0.0
    stop: bool = False

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if self.count != 1 and not self.stop and self.every_s <= 0:
            raise BadField("every_s is needed for more than one")
        return self


class RecordVideo(_Camera):
    """Video on the camera's own storage."""

    command: Literal["record"]
    on: bool


class Follow(_Command):
    """Keeps a fixed position relative to another drone until something ends it."""

    command: Literal["follow"]
    leader: Annotated[int, Field(ge=1, le=0xFFFFFFFF, description="The drone to follow")]
    north_m: Offset = 0.0
    east_m: Offset = 0.0
    up_m: Offset = 0.0
    for_s: Annotated[float, Field(ge=5, le=600, allow_inf_nan=False, description="Then it holds")] = 600.0


class FollowMe(_Command):
    """Follows the requester from its present side and height until something ends it. The request has the requester's
    present position; afterwards their browser sends `person_fix` on `/live` once a second."""

    command: Literal["follow_me"]
    lat: Latitude
    lon: Longitude
    accuracy_m: Annotated[
        float, Field(ge=0, allow_inf_nan=False, description="95 % confidence, as geolocation reports it")
    ]
    age_ms: Annotated[float, Field(ge=0, allow_inf_nan=False, description="Age of the position")] = 0.0
    distance_m: Annotated[float, Field(ge=MIN_M, le=MAX_M, allow_inf_nan=False, description="Horizontal")] = USUAL_M
    for_s: Annotated[float, Field(ge=5, le=600, allow_inf_nan=False, description="Then it holds")] = 600.0


class Calibrate(_Command):
    """Starts the calibration of a sensor. Prompts and progress come as the autopilot's own messages. On the ground,
    disarmed, as all of the vehicle's set-up."""

    command: Literal["calibrate"]
    sensor: Sensor


class CalibrationPose(_Command):
    """The drone lies as the accelerometer's calibration asked: 1 level, 2 left, 3 right, 4 nose down, 5 nose up, 6 on
    its back."""

    command: Literal["calibration_pose"]
    pose: Annotated[int, Field(ge=1, le=6)]


class EndCalibration(_Command):
    """Keeps the result of the compass calibration, or cancels the calibration."""

    command: Literal["calibration_end"]
    keep: bool


class SpinMotor(_Command):
    """Turns one motor. `propellers_off`: the drone's name, which confirms that its propellers are off."""

    command: Literal["motor_test"]
    motor: Annotated[int, Field(ge=1, le=12, description="In the autopilot's test order")]
    throttle_percent: Annotated[float, Field(ge=1, le=MAX_TEST_PERCENT, allow_inf_nan=False)]
    for_s: Annotated[float, Field(ge=0.5, le=MAX_TEST_S, allow_inf_nan=False)]
    propellers_off: Annotated[str, Field(max_length=200)]


class Reboot(_Command):
    """Restarts the autopilot. The drone is not heard for some seconds."""

    command: Literal["reboot"]


SETUP: Final = (Calibrate, CalibrationPose, EndCalibration, SpinMotor, Reboot)
"""Only on the ground and disarmed, and not for borrowers."""

OneOff = (
    Arm
    | Disarm
    | ChangeMode
    | TakeOff
    | GoTo
    | Simple
    | SetHome
    | ChangeSpeed
    | Turn
    | Start
    | Jump
    | Orbit
    | LookAt
    | SetServo
    | MoveGripper
    | PointGimbal
    | ZoomCamera
    | TakePhotos
    | RecordVideo
    | Calibrate
    | CalibrationPose
    | EndCalibration
    | SpinMotor
    | Reboot
)
"""Over when the autopilot has accepted it, and its telemetry shows it or has had the time to."""

FlightCommand = Annotated[OneOff | LandAt | Follow | FollowMe, Field(discriminator="command")]
