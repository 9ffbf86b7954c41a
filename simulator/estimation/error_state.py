"""The state of the filter: what it believes, how unsure it is, and how an error moves with the vehicle.

An error-state Kalman filter keeps the attitude as a quaternion and estimates small errors of everything: of the
attitude as a rotation vector in body axes, of velocity and position in world axes, of each sensor's bias. Errors of
satellites and of the barometer wander; they are states too, because a filter that took them for noise would trust a
hundred wandering positions as if they were a hundred opinions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simulator.physics.rotation import Floats, from_vector, matrix, multiply, normalised

Indices = npt.NDArray[np.intp]

ATTITUDE, VELOCITY, POSITION = slice(0, 3), slice(3, 6), slice(6, 9)
ACCELEROMETER_BIAS, GYRO_BIAS, COMPASS_BIAS = slice(9, 12), slice(12, 15), slice(15, 18)
GPS_BIAS, GPS_MULTIPATH, BAROMETER_BIAS = slice(18, 21), slice(21, 24), slice(24, 25)
STATES = 25
MOVING = 9
"""The first states, whose errors grow out of other states."""


@dataclass(frozen=True, slots=True)
class FilterNoise:
    """What the filter takes its sensors for (standard deviations; of a sample, if not said otherwise)."""

    acceleration_mss: float = 0.16
    rates_rps: float = math.radians(0.33)
    acceleration_bias_walk: float = 0.001
    """Per square root of a second, like the next ones."""
    gyro_bias_walk: float = math.radians(0.003)
    compass_bias_walk: float = 0.0002
    compass_gauss: float = 0.0042
    barometer_m: float = 0.12
    barometer_bias_m: float = 0.25
    barometer_bias_s: float = 150.0
    gps_m: tuple[float, float, float] = (0.15, 0.15, 0.3)
    gps_bias_m: tuple[float, float, float] = (1.27, 1.27, 2.5)
    gps_bias_s: float = 1800.0
    gps_multipath_m: tuple[float, float, float] = (0.25, 0.25, 0.5)
    gps_multipath_s: float = 60.0
    gps_mps: tuple[float, float, float] = (0.08, 0.08, 0.15)


@dataclass(frozen=True, slots=True)
class FirstDoubts:
    """Standard deviations at the start, on the ground and standing still."""

    tilt_rad: float = 0.010
    yaw_rad: float = 0.08
    velocity_mps: float = 0.05
    position_m: float = 0.1
    """The place where it stands is the origin: what the satellites say beside it is their error."""
    gps_error_m: float = 10.0
    """Of the first fix: a receiver that has just found its satellites may be worse than later."""
    height_m: float = 0.05
    acceleration_bias_mss: float = 0.07
    gyro_bias_rps: float = math.radians(0.06)
    compass_bias_gauss: float = 0.008
    """Of a calibrated compass."""
    barometer_m: float = 0.05
    """Its error at the start is what it reads as zero."""


class ErrorState:
    """Belief and covariance of `count` vehicles."""

    def __init__(self, count: int, noise: FilterNoise) -> None:
        self.count = count
        self.noise = noise
        self.attitude = np.zeros((4, count))
        self.attitude[0] = 1.0
        self.rotation = matrix(self.attitude)
        self.velocity_mps = np.zeros((3, count))
        self.position_m = np.zeros((3, count))
        self.acceleration_bias_mss = np.zeros((3, count))
        self.gyro_bias_rps = np.zeros((3, count))
        self.compass_bias_gauss = np.zeros((3, count))
        self.gps_bias_m = np.zeros((3, count))
        self.gps_multipath_m = np.zeros((3, count))
        self.barometer_bias_m = np.zeros(count)
        self.covariance = np.zeros((count, STATES, STATES))

    def start(self, which: Indices, attitude: Floats, position_m: Floats, gyro_bias_rps: Floats) -> None:
        """These vehicles stand here with this attitude; of their sensors' errors only the gyroscope's is known."""
        self.attitude[:, which] = attitude
        self.rotation[:, :, which] = matrix(attitude)
        self.position_m[:, which], self.gyro_bias_rps[:, which] = position_m, gyro_bias_rps
        unknown = (self.velocity_mps, self.acceleration_bias_mss, self.compass_bias_gauss, self.gps_bias_m)
        for part in (*unknown, self.gps_multipath_m, self.barometer_bias_m):
            part[..., which] = 0.0

    def doubt(self, doubts: FirstDoubts, which: Indices) -> None:
        """Starts the covariance of these vehicles again."""
        noise = self.noise
        spread = np.concatenate(
            (
                [doubts.tilt_rad, doubts.tilt_rad, doubts.yaw_rad],
                [doubts.velocity_mps] * 3,
                [doubts.position_m, doubts.position_m, doubts.height_m],
                [doubts.acceleration_bias_mss] * 3,
                [doubts.gyro_bias_rps] * 3,
                [doubts.compass_bias_gauss] * 3,
                [doubts.gps_error_m] * 3,
                noise.gps_multipath_m,
                [doubts.barometer_m],
            )
        )
        self.covariance[which] = np.diag(spread**2)

    def spread(self, part: slice) -> Floats:
        """Returns the standard deviations of these states, (states, vehicles)."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance, axis1=1, axis2=2)[:, part].T, 0.0))

    def inject(self, error: Floats) -> None:
        """Corrects the belief by the estimated errors, (vehicles, states)."""
        step = error.T
        self.attitude = normalised(multiply(self.attitude, from_vector(step[ATTITUDE])))
        self.rotation = matrix(self.attitude)
        self.velocity_mps = self.velocity_mps + step[VELOCITY]  # not in place: the history keeps the old one
        self.position_m = self.position_m + step[POSITION]  # not in place: the history keeps the old one
        self.acceleration_bias_mss += step[ACCELEROMETER_BIAS]
        self.gyro_bias_rps += step[GYRO_BIAS]
        self.compass_bias_gauss += step[COMPASS_BIAS]
        self.gps_bias_m += step[GPS_BIAS]
        self.gps_multipath_m += step[GPS_MULTIPATH]
        self.barometer_bias_m += step[BAROMETER_BIAS][0]

    def spread_out(self, turn_rad: Floats, force_mss: Floats, over_s: float, sample_s: float) -> None:
        """Moves the covariance on by `over_s`: `turn_rad` is the rotation meanwhile, `force_mss` the mean specific
        force, both in body axes; `sample_s` is the time between two samples of the inertial sensors."""
        noise, rotation = self.noise, np.moveaxis(self.rotation, 2, 0)
        lever = -over_s * (rotation @ _skew(force_mss))
        moved = np.zeros((self.count, MOVING, STATES))
        moved[:, :9, :9] = np.eye(9)
        moved[:, ATTITUDE, ATTITUDE] -= _skew(turn_rad)
        moved[:, ATTITUDE, GYRO_BIAS] = -over_s * np.eye(3)
        moved[:, VELOCITY, ATTITUDE] = lever
        moved[:, VELOCITY, ACCELEROMETER_BIAS] = -over_s * rotation
        moved[:, POSITION, VELOCITY] = over_s * np.eye(3)
        moved[:, POSITION, ATTITUDE] = (0.5 * over_s) * lever
        moved[:, POSITION, ACCELEROMETER_BIAS] = (-0.5 * over_s * over_s) * rotation
        gps_keep, barometer_keep = math.exp(-over_s / noise.gps_bias_s), math.exp(-over_s / noise.barometer_bias_s)
        multipath_keep = math.exp(-over_s / noise.gps_multipath_s)
        keep = np.ones(STATES - MOVING)
        keep[9:12], keep[12:15], keep[15] = gps_keep, multipath_keep, barometer_keep
        before = self.covariance
        top = moved @ before
        after = np.empty_like(before)
        after[:, :9, :9] = top @ np.swapaxes(moved, 1, 2)
        after[:, :9, 9:] = top[:, :, 9:] * keep
        after[:, 9:, :9] = np.swapaxes(after[:, :9, 9:], 1, 2)
        after[:, 9:, 9:] = before[:, 9:, 9:] * np.outer(keep, keep)
        fresh = np.zeros(STATES)
        fresh[ATTITUDE] = noise.rates_rps**2 * sample_s * over_s
        fresh[VELOCITY] = noise.acceleration_mss**2 * sample_s * over_s
        fresh[ACCELEROMETER_BIAS] = noise.acceleration_bias_walk**2 * over_s
        fresh[GYRO_BIAS] = noise.gyro_bias_walk**2 * over_s
        fresh[COMPASS_BIAS] = noise.compass_bias_walk**2 * over_s
        fresh[GPS_BIAS] = np.square(noise.gps_bias_m) * (1.0 - gps_keep**2)
        fresh[GPS_MULTIPATH] = np.square(noise.gps_multipath_m) * (1.0 - multipath_keep**2)
        fresh[BAROMETER_BIAS] = noise.barometer_bias_m**2 * (1.0 - barometer_keep**2)
        diagonal = np.arange(STATES)
        after[:, diagonal, diagonal] += fresh
        self.covariance = after
        self.gps_bias_m *= gps_keep
        self.gps_multipath_m *= multipath_keep
        self.barometer_bias_m *= barometer_keep


def _skew(vector: Floats) -> Floats:
    """Returns the matrices (vehicles, 3, 3) of a cross product."""
    x, y, z = vector
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
