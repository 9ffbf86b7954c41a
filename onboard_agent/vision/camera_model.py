"""A camera on a vehicle as a pinhole: from pixels to directions of the body and of the world, and back. Pure.

Axes, all right-handed: lens (right, down, ahead), body (forward, right, down), world (north, east, down).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
"""Rows."""


@dataclass(frozen=True, slots=True)
class Mounting:
    """How the camera sits in the body. `tilt_deg`: of its axis, down from forward (90 looks straight down, with the
    picture's top ahead); then `turn_deg`: about the body's down axis, to the right; `spin_deg`: about its own axis, the
    picture's top to the right. The offsets are the lens' place in the body, from the vehicle's reference point."""

    tilt_deg: float = 90.0
    turn_deg: float = 0.0
    spin_deg: float = 0.0
    forward_m: float = 0.0
    right_m: float = 0.0
    down_m: float = 0.0

    def body_from_lens(self) -> Matrix:
        tilt, turn, spin = (math.radians(angle) for angle in (self.tilt_deg, self.turn_deg, self.spin_deg))
        s, c = math.sin(tilt), math.cos(tilt)
        tilted: Matrix = ((0.0, -s, c), (1.0, 0.0, 0.0), (0.0, c, s))
        return times(times(_about_last(turn), tilted), _about_last(spin))


@dataclass(frozen=True, slots=True)
class Attitude:
    """Radians, as in the MAVLink message ATTITUDE: yaw from north, then pitch (nose up), then roll (right down)."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float

    def world_from_body(self) -> Matrix:
        sr, cr = math.sin(self.roll_rad), math.cos(self.roll_rad)
        sp, cp = math.sin(self.pitch_rad), math.cos(self.pitch_rad)
        pitched: Matrix = ((cp, 0.0, sp), (0.0, 1.0, 0.0), (-sp, 0.0, cp))
        rolled: Matrix = ((1.0, 0.0, 0.0), (0.0, cr, -sr), (0.0, sr, cr))
        return times(times(_about_last(self.yaw_rad), pitched), rolled)


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Pixels are square, the axis meets the middle of the picture, the lens does not distort. Raises ValueError for a
    field of view (horizontal) outside (0, 180) degrees or a picture without pixels."""

    width_px: int
    height_px: int
    field_of_view_deg: float
    mounting: Mounting = Mounting()

    def __post_init__(self) -> None:
        if not 0.0 < self.field_of_view_deg < 180.0:
            raise ValueError("the field of view is to be between 0 and 180 degrees")
        if self.width_px < 1 or self.height_px < 1:
            raise ValueError("a picture has pixels")

    @property
    def focal_px(self) -> float:
        return self.width_px / 2.0 / math.tan(math.radians(self.field_of_view_deg) / 2.0)

    @property
    def middle_px(self) -> tuple[float, float]:
        """Whole numbers are pixel centres."""
        return (self.width_px - 1) / 2.0, (self.height_px - 1) / 2.0

    def lens_ray(self, x_px: float, y_px: float) -> Vector:
        """Returns the ray through a pixel, one metre ahead of the lens."""
        middle_x, middle_y = self.middle_px
        return (x_px - middle_x) / self.focal_px, (y_px - middle_y) / self.focal_px, 1.0

    def body_direction(self, x_px: float, y_px: float) -> Vector:
        """Returns the unit vector in body axes towards what a pixel shows."""
        return unit(applied(self.mounting.body_from_lens(), self.lens_ray(x_px, y_px)))

    def offset_deg(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Returns the angles right and down from the camera's axis, each in the plane of its own picture axis."""
        right, down, _ = self.lens_ray(x_px, y_px)
        return math.degrees(math.atan(right)), math.degrees(math.atan(down))

    def pixel_of(self, body_m: Vector) -> tuple[float, float] | None:
        """Projects a place in body axes, in metres from the lens; None if it is not ahead of the camera."""
        right, down, ahead = applied(transposed(self.mounting.body_from_lens()), body_m)
        if ahead <= 1e-9:
            return None
        middle_x, middle_y = self.middle_px
        return middle_x + self.focal_px * right / ahead, middle_y + self.focal_px * down / ahead


def _about_last(angle_rad: float) -> Matrix:
    s, c = math.sin(angle_rad), math.cos(angle_rad)
    return (c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)


def applied(matrix: Matrix, vector: Vector) -> Vector:
    a, b, c = (row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2] for row in matrix)
    return a, b, c


def transposed(matrix: Matrix) -> Matrix:
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return (a, d, g), (b, e, h), (c, f, i)


def times(left: Matrix, right: Matrix) -> Matrix:
    x, y, z = (applied(left, column) for column in transposed(right))
    return transposed((x, y, z))


def unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return vector[0] / length, vector[1] / length, vector[2] / length
