"""A quadrotor from its dimensions: mass, inertia, thrust and drag follow from what it is built of.

Numbers of a part are of that part alone; what a flight controller must know of the whole is computed here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from simulator.physics.frames import Frame, motors_of
from simulator.physics.rigid_body import GRAVITY_MSS
from simulator.physics.rotation import Floats

AIR_DENSITY_KGM3 = 1.225


@dataclass(frozen=True, slots=True)
class QuadrotorDesign:
    """The default is a 1.5 kg machine of 500 mm that flies as the product's own tests know it."""

    frame: Frame = Frame.X
    arm_m: float = 0.25
    """From the centre to each motor."""
    arm_kg: float = 0.06
    """A rod from the centre to the motor."""
    motor_kg: float = 0.067
    """Motor, propeller and speed controller: a point at the end of its arm."""
    core_kg: float = 0.992
    """Battery, electronics and payload: a box."""
    core_m: tuple[float, float, float] = (0.18, 0.12, 0.10)
    """Its length, width and height."""
    propeller_m: float = 0.254
    """Diameter."""
    thrust_coefficient: float = 0.105
    """Thrust = coefficient x air density x (turns per second)^2 x diameter^4."""
    torque_coefficient: float = 0.0066
    """Torque = coefficient x air density x (turns per second)^2 x diameter^5."""
    full_speed_rps: float = 783.0
    """Of a rotor at full command and full battery, radians per second."""
    motor_lag_s: float = 0.03
    """A rotor covers 63 % of a change of speed in this time."""
    drag_area_m2: float = 0.0735
    """Drag coefficient times frontal area."""
    rotor_drag: float = 0.18e-3
    """Newton seconds per metre of airspeed for each radian per second of all rotors together: blades that advance lift
    more than blades that retreat."""
    turning_drag_nms: tuple[float, float, float] = (0.008, 0.008, 0.0144)
    """Torque against each body rate."""
    ground_effect: bool = True
    motors: Floats = field(init=False, repr=False, compare=False)
    """Forward and right of the centre (metres), and the sign of the reaction torque: (3, 4)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "motors", motors_of(self.frame, self.arm_m))

    @property
    def mass_kg(self) -> float:
        return self.core_kg + 4.0 * (self.arm_kg + self.motor_kg)

    @property
    def weight_n(self) -> float:
        return self.mass_kg * GRAVITY_MSS

    @property
    def inertia_kgm2(self) -> Floats:
        """Principal moments about forward, right, down."""
        length, width, height = self.core_m
        core = self.core_kg / 12.0 * np.array([width**2 + height**2, length**2 + height**2, length**2 + width**2])
        # An arm is a rod: a third of its mass counts at its end.
        at_end_kg = self.motor_kg + self.arm_kg / 3.0
        forward, right = self.motors[0], self.motors[1]
        ends = at_end_kg * np.array([np.sum(right**2), np.sum(forward**2), np.sum(forward**2 + right**2)])
        return np.asarray(core + ends)

    @property
    def thrust_per_speed2(self) -> float:
        """Newton per (radian per second) squared."""
        return self.thrust_coefficient * AIR_DENSITY_KGM3 * self.propeller_m**4 / (2.0 * math.pi) ** 2

    @property
    def full_thrust_n(self) -> float:
        """Of one motor."""
        return self.thrust_per_speed2 * self.full_speed_rps**2

    @property
    def torque_per_thrust_m(self) -> float:
        return self.torque_coefficient * self.propeller_m / self.thrust_coefficient

    @property
    def hover_speed_rps(self) -> float:
        return math.sqrt(self.weight_n / 4.0 / self.thrust_per_speed2)

    @property
    def terminal_mps(self) -> float:
        """The speed of a fall with motors stopped."""
        return math.sqrt(2.0 * self.weight_n / (AIR_DENSITY_KGM3 * self.drag_area_m2))

    def allocation(self) -> Floats:
        """Returns the matrix (4, 4) from motor thrusts to total thrust and roll, pitch and yaw torque."""
        forward, right, turn = self.motors
        return np.array([np.ones(4), -right, forward, turn * self.torque_per_thrust_m])
