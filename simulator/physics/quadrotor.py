"""Quadrotors: rotor commands and air in, forces and motion out."""

from __future__ import annotations

import math

import numpy as np

from simulator.physics.quadrotor_design import AIR_DENSITY_KGM3, QuadrotorDesign
from simulator.physics.rigid_body import RigidBodies
from simulator.physics.rotation import Floats, limited, to_body, to_world

MAX_GROUND_EFFECT = 1.3
"""Share of thrust on the ground. The formula holds for a rotor more than half a radius above it."""
ROTOR_HEIGHT_M = 0.12
"""Of the rotors above the feet of the landing gear."""


class Quadrotors(RigidBodies):
    """Vehicles of one design. `step` takes the share of full speed that each speed controller is told, 0..1."""

    def __init__(self, design: QuadrotorDesign, count: int = 1, yaw_rad: float | Floats = 0.0) -> None:
        super().__init__(count, design.mass_kg, design.inertia_kgm2, yaw_rad)
        self.design = design
        self.rotor_rps = np.zeros((4, count))
        self.thrust_n = np.zeros((4, count))
        self.motor_health = np.ones((4, count))
        """Share of the full speed that each motor still reaches."""
        self._allocation = design.allocation()
        self._turning_drag = np.reshape(design.turning_drag_nms, (3, 1))

    def step(self, command: Floats, dt_s: float, wind_mps: Floats, power: Floats | float = 1.0) -> None:
        """`wind_mps`: the direction in which the air moves, (3, vehicles). `power`: share of the full thrust that the
        battery's voltage leaves, 0..1."""
        force_n, torque_nm = self.forces(command, dt_s, wind_mps, power)
        self.advance(force_n, torque_nm, dt_s)

    def forces(
        self, command: Floats, dt_s: float, wind_mps: Floats, power: Floats | float = 1.0
    ) -> tuple[Floats, Floats]:
        """Spins the rotors and returns their force and the drag in world axes, and the torque in body axes."""
        design = self.design
        wanted = limited(command, 0.0, 1.0) * self.motor_health * (design.full_speed_rps * np.sqrt(power))
        self.rotor_rps += (wanted - self.rotor_rps) * (1.0 - math.exp(-dt_s / design.motor_lag_s))
        thrust = design.thrust_per_speed2 * self.rotor_rps * self.rotor_rps
        if design.ground_effect:
            thrust = thrust * self._ground_effect()
        self.thrust_n = thrust
        total, roll, pitch, yaw = self._allocation @ thrust
        air = to_body(self.rotation, self.velocity_mps - wind_mps)
        speed = np.sqrt(np.einsum("in,in->n", air, air))
        body_force = -(0.5 * AIR_DENSITY_KGM3 * design.drag_area_m2) * speed * air
        body_force -= (design.rotor_drag * self.rotor_rps.sum(axis=0)) * air
        body_force[2] -= total
        torque = np.array([roll, pitch, yaw]) - self._turning_drag * self.rates_rps
        return to_world(self.rotation, body_force), torque

    def _ground_effect(self) -> Floats:
        """Returns the gain in thrust near the ground, after Cheeseman and Bennett."""
        height = self.over_ground_m + ROTOR_HEIGHT_M
        ratio = self.design.propeller_m / 2.0 / (4.0 * np.maximum(height, 1e-3))
        return np.asarray(np.minimum(1.0 / (1.0 - np.minimum(ratio, 0.9) ** 2), MAX_GROUND_EFFECT))
