"""Landing on a target that LANDING_TARGET shows, as ArduCopter 4.6 does it with PLND_TYPE 1 (read, facts only).

Its own rules: a measurement needs a distance, because there is no range finder; the attitude of PLND_LAG ago turns it
into north and east; a filter settles for two seconds before it is flown; a target unseen for two seconds is lost. Then
the landing goes on where it is: without a range finder ArduCopter never retries.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Protocol

from simulator.dialect import Message
from simulator.flight_constants import TICK_S
from simulator.geodesy import clamp
from simulator.notices import Severity
from simulator.parameters import Parameters

LOST_AFTER_S = 2.0
SETTLES_S = 2.0
MIN_UPDATE_S = 0.5
"""Of measurements while the filter settles."""
MAX_NIS = 3.0
MAX_OUTLIERS = 3
BODY, LOCAL = 12, 20
"""MAV_FRAME_BODY_FRD, MAV_FRAME_LOCAL_FRD."""
ENABLED, MAVLINK = 1.0, 1.0
RAW = 0
SLOW_BELOW_M, SLOW_ABOVE_M = 2.0, 0.35
"""Height over the target between which the descent waits for the error to shrink."""
ACCEPTABLE_M = 0.15
MIN_DESCENT_MPS = 0.1

Vector = tuple[float, float, float]


class Body(Protocol):
    vn_mps: float
    ve_mps: float

    def attitude(self) -> Vector: ...


class Machine(Protocol):
    now_s: float
    parameters: Parameters

    @property
    def body(self) -> Body: ...

    def notify(self, severity: Severity, text: str) -> None: ...


@dataclass(slots=True)
class AxisFilter:
    """Position and velocity of the target relative to the vehicle along one axis, and their covariance."""

    position_m: float
    velocity_mps: float
    p: float
    pv: float
    v: float

    def predict(self, gained_mps: float, noise_mps: float) -> None:
        """`gained_mps`: the vehicle's change of velocity in this tick."""
        self.position_m += self.velocity_mps * TICK_S
        self.velocity_mps -= gained_mps
        self.p += 2.0 * TICK_S * self.pv + TICK_S**2 * self.v
        self.pv += TICK_S * self.v
        self.v += noise_mps**2

    def surprise(self, measured_m: float, variance: float) -> float:
        """Returns the squared innovation over its variance."""
        return (measured_m - self.position_m) ** 2 / (self.p + variance)

    def fuse(self, measured_m: float, variance: float) -> None:
        gain_p, gain_v = self.p / (self.p + variance), self.pv / (self.p + variance)
        error_m = measured_m - self.position_m
        self.position_m += gain_p * error_m
        self.velocity_mps += gain_v * error_m
        self.v -= gain_v * self.pv
        self.pv -= gain_p * self.pv
        self.p -= gain_p * self.p


class PrecisionLanding:
    """Call `receive` for each LANDING_TARGET, and `update` every tick."""

    def __init__(self) -> None:
        self._measured: tuple[Vector, int] | None = None
        """The newest measurement in metres, and its frame; None: already used."""
        self._history: deque[tuple[Vector, float, float]] = deque(maxlen=1)
        """Attitude and velocity, from PLND_LAG ago to now."""
        self._last = (0.0, 0.0)
        self._axes: tuple[AxisFilter, AxisFilter] | None = None
        self._began_s = self._updated_s = 0.0
        self._outliers = 0
        self._wrong_frame_told = False
        self.height_m = 0.0
        """Of the vehicle over the target, as last measured."""
        self.acquired = False

    @staticmethod
    def is_on(parameters: Parameters) -> bool:
        return (
            parameters.find("PLND_ENABLED") is not None
            and parameters["PLND_ENABLED"] == ENABLED
            and parameters["PLND_TYPE"] == MAVLINK
        )

    def receive(self, message: Message, flight: Machine) -> None:
        """Takes a LANDING_TARGET. Without a valid position its angles are those of a camera that looks straight
        down."""
        if not self.is_on(flight.parameters):
            return
        if message.frame not in (BODY, LOCAL):
            if not self._wrong_frame_told:
                self._wrong_frame_told = True
                flight.notify(Severity.INFO, "Plnd: Frame not supported")
            return
        if not (math.isfinite(message.distance) and message.distance > 0.0):
            return
        if message.position_valid == 1:
            vector = (message.x, message.y, message.z)
        else:
            ray = (-math.tan(message.angle_y), math.tan(message.angle_x), 1.0)
            scale = message.distance / math.hypot(*ray)
            vector = (ray[0] * scale, ray[1] * scale, ray[2] * scale)
        if all(map(math.isfinite, vector)) and vector[2] > 0.0:
            self._measured = (vector, int(message.frame))

    def update(self, flight: Machine) -> None:
        """One tick of the estimator."""
        if not self.is_on(flight.parameters):
            self._axes, self.acquired = None, False
            return
        self._remember(flight)
        if self._axes is not None and flight.now_s - self._updated_s > LOST_AFTER_S:
            if self.acquired:
                flight.notify(Severity.CRITICAL, "PrecLand: Target Lost")
            self._axes, self.acquired = None, False
        measured, self._measured = self._measured, None
        if measured is not None:
            self._take(self._in_world(*measured), flight)
        if self._axes is not None and not self.acquired:
            self._settle(flight)

    def target_from_here(self) -> tuple[float, float] | None:
        """Returns metres north and east of the vehicle; None without a target."""
        if self._axes is None or not self.acquired:
            return None
        north, east = self._axes
        lag_s = (len(self._history) - 1) * TICK_S
        return north.position_m + north.velocity_mps * lag_s, east.position_m + east.velocity_mps * lag_s

    def climb_mps(self, climb_mps: float, flight: Machine) -> float:
        """Returns the climb rate of a landing that wants this one: none while the target is far to the side, slow
        close to the ground until the error has shrunk."""
        target = self.target_from_here()
        if target is None:
            return climb_mps
        error_m = math.hypot(*target)
        far_m = flight.parameters["PLND_XY_DIST_MAX"]
        if far_m > 0.0 and error_m > far_m:
            return 0.0
        if not SLOW_ABOVE_M < self.height_m < SLOW_BELOW_M:
            return climb_mps
        fastest = abs(flight.parameters["LAND_SPEED"]) / 100.0 * 0.5
        return min(-MIN_DESCENT_MPS, -fastest + error_m * fastest / ACCEPTABLE_M)

    def _remember(self, flight: Machine) -> None:
        lag_s = clamp(flight.parameters["PLND_LAG"], 0.02, 0.25)
        length = max(round(lag_s / TICK_S), 1)
        if self._history.maxlen != length:
            self._history = deque(self._history, maxlen=length)
        body = flight.body
        self._history.append((body.attitude(), body.vn_mps, body.ve_mps))
        _, north, east = self._history[0]
        if self._axes is not None:
            noise = flight.parameters["PLND_ACC_P_NSE"] * TICK_S
            self._axes[0].predict(north - self._last[0], noise)
            self._axes[1].predict(east - self._last[1], noise)
        self._last = (north, east)

    def _in_world(self, vector: Vector, frame: int) -> Vector:
        roll, pitch, yaw = self._history[0][0]
        if frame == LOCAL:
            roll = pitch = 0.0
        return rotated(vector, roll, pitch, yaw)

    def _take(self, world_m: Vector, flight: Machine) -> None:
        north_m, east_m, self.height_m = world_m
        variance = (self.height_m * 0.01 + 0.02) ** 2
        _, vn, ve = self._history[0]
        raw = int(flight.parameters["PLND_EST_TYPE"]) == RAW
        if self._axes is None or raw:
            if self._axes is None:
                flight.notify(Severity.INFO, "PrecLand: Target Found")
                self._began_s = flight.now_s
            self._axes = (
                AxisFilter(north_m, -vn, variance, 0.0, 4.0),
                AxisFilter(east_m, -ve, variance, 0.0, 4.0),
            )
            self.acquired = self.acquired or raw
            self._updated_s = flight.now_s
            return
        pairs = tuple(zip(self._axes, (north_m, east_m), strict=True))
        if max(axis.surprise(value, variance) for axis, value in pairs) >= MAX_NIS and self._outliers < MAX_OUTLIERS:
            self._outliers += 1
            return
        self._outliers = 0
        for axis, value in pairs:
            axis.fuse(value, variance)
        self._updated_s = flight.now_s

    def _settle(self, flight: Machine) -> None:
        if flight.now_s - self._updated_s > MIN_UPDATE_S:
            self._axes = None
            flight.notify(Severity.CRITICAL, "PrecLand: Init Failed")
        elif flight.now_s - self._began_s > SETTLES_S:
            self.acquired = True
            flight.notify(Severity.INFO, "PrecLand: Init Complete")


def rotated(vector: Vector, roll: float, pitch: float, yaw: float) -> Vector:
    """Returns body axes (forward, right, down) as north, east, down. Radians."""
    x, y, z = vector
    sr, cr, sp, cp, sy, cy = (f(angle) for angle in (roll, pitch, yaw) for f in (math.sin, math.cos))
    y, z = y * cr - z * sr, y * sr + z * cr
    x, z = x * cp + z * sp, z * cp - x * sp
    return x * cy - y * sy, x * sy + y * cy, z
