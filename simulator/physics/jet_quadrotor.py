"""The jet quadcopter: a quadrotor round a small gas turbine that carries weight and is kept vertical by two servos.

The turbine spools up and down slowly and never below its idle speed. Its gimbal turns as fast as two small servos can
turn it: their torque and their speed are limited, and what turns the turbine turns the vehicle the other way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from simulator.physics.quadrotor import Quadrotors
from simulator.physics.quadrotor_design import QuadrotorDesign
from simulator.physics.rigid_body import GRAVITY_MSS
from simulator.physics.rotation import Floats, limited, to_world


@dataclass(frozen=True, slots=True)
class JetDesign:
    full_thrust_n: float = 60.0
    idle_share: float = 0.35
    """Share of the full speed below which the turbine does not run; thrust grows with the square."""
    engine_kg: float = 0.85
    gimbal_kg: float = 0.35
    payload_kg: float = 1.8
    fuel_kg: float = 0.6
    fuel_kg_per_ns: float = 4.5e-5
    """Burnt per second and newton of thrust."""
    spool_s: float = 0.9
    """Lag of the speed behind its command."""
    spool_share_per_s: float = 0.25
    """The most by which the engine's controller lets the speed change."""
    rotor_momentum_nms: float = 0.30
    """Of the turbine at full speed."""
    gimbal_inertia_kgm2: float = 0.004
    servo_torque_nm: float = 0.35
    servo_speed_rps: float = 5.0
    servo_angle_rad: float = 0.6
    servo_p: float = 900.0
    servo_d: float = 55.0

    @property
    def dry_kg(self) -> float:
        return self.engine_kg + self.gimbal_kg + self.payload_kg


@dataclass(frozen=True, slots=True)
class JetQuadrotorDesign:
    quadrotor: QuadrotorDesign = field(default_factory=QuadrotorDesign)
    jet: JetDesign = field(default_factory=JetDesign)

    @property
    def carried_n(self) -> float:
        """The weight that the jet is to carry at the start: its own, its fuel's, the payload's."""
        return (self.jet.dry_kg + self.jet.fuel_kg) * GRAVITY_MSS

    @property
    def carrying_share(self) -> float:
        """The speed at which it does."""
        return math.sqrt(self.carried_n / self.jet.full_thrust_n)


class JetQuadrotors(Quadrotors):
    """`throttle` and `gimbal_rad` are the commands to engine and servos; they stay until changed."""

    def __init__(self, design: JetQuadrotorDesign, count: int = 1, yaw_rad: float | Floats = 0.0) -> None:
        super().__init__(design.quadrotor, count, yaw_rad)
        self.jet = design.jet
        self.fuel_kg = np.full(count, self.jet.fuel_kg)
        self.spool = np.full(count, self.jet.idle_share)
        """Share of the full speed."""
        self.throttle = np.full(count, self.jet.idle_share)
        self.gimbal_rad = np.zeros((2, count))
        """Commanded angles about the forward and the right axis."""
        self.angle_rad = np.zeros((2, count))
        self.angle_rate_rps = np.zeros((2, count))
        # Engine and payload hang close to the centre: a ball with a radius of 8 cm.
        self.inertia_kgm2 += 0.4 * (self.jet.dry_kg + self.jet.fuel_kg) * 0.08**2
        self._weigh()

    @property
    def jet_thrust_n(self) -> Floats:
        return np.where(self.fuel_kg > 0.0, self.jet.full_thrust_n * self.spool**2, 0.0)

    def jet_axis(self) -> Floats:
        """The direction in which the jet pushes, in world axes."""
        return to_world(self.rotation, self._axis_in_body())

    def jet_tilt_rad(self) -> Floats:
        return np.arccos(limited(-self.jet_axis()[2], -1.0, 1.0))

    def forces(
        self, command: Floats, dt_s: float, wind_mps: Floats, power: Floats | float = 1.0
    ) -> tuple[Floats, Floats]:
        force, torque = super().forces(command, dt_s, wind_mps, power)
        self._spool(dt_s)
        turned_nm = self._turn_gimbal(dt_s)
        thrust = self.jet_thrust_n
        self.fuel_kg = np.maximum(self.fuel_kg - self.jet.fuel_kg_per_ns * thrust * dt_s, 0.0)
        self._weigh()
        torque[:2] -= turned_nm
        # A spinning turbine resists being turned: what turns it about one axis pushes about the other.
        spin_nms = self.jet.rotor_momentum_nms * self.spool
        rates = self.rates_rps[:2] + self.angle_rate_rps
        torque[0] += spin_nms * rates[1]
        torque[1] -= spin_nms * rates[0]
        return force + thrust * self.jet_axis(), torque

    def _spool(self, dt_s: float) -> None:
        jet = self.jet
        wanted = (limited(self.throttle, jet.idle_share, 1.0) - self.spool) / jet.spool_s
        self.spool = self.spool + dt_s * limited(wanted, -jet.spool_share_per_s, jet.spool_share_per_s)

    def _turn_gimbal(self, dt_s: float) -> Floats:
        """Returns the torque of the servos."""
        jet = self.jet
        wanted = limited(self.gimbal_rad, -jet.servo_angle_rad, jet.servo_angle_rad)
        most = jet.servo_torque_nm / jet.gimbal_inertia_kgm2
        pull = jet.servo_p * (wanted - self.angle_rad) - jet.servo_d * self.angle_rate_rps
        before = self.angle_rate_rps
        after = limited(before + limited(pull, -most, most) * dt_s, -jet.servo_speed_rps, jet.servo_speed_rps)
        self.angle_rad = self.angle_rad + (0.5 * dt_s) * (before + after)
        self.angle_rate_rps = after
        return np.asarray((after - before) / dt_s * jet.gimbal_inertia_kgm2)

    def _axis_in_body(self) -> Floats:
        a, b = self.angle_rad
        return np.array([-np.sin(b), np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b)])

    def _weigh(self) -> None:
        self.mass_kg = self.design.mass_kg + self.jet.dry_kg + self.fuel_kg
