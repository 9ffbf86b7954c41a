"""Rigid bodies under forces and torques, above ground that is level under each. Knows no propeller and no wind."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from simulator.physics.rotation import (
    Floats,
    cross,
    from_vector,
    level,
    matrix,
    multiply,
    normalised,
    to_body,
)

GRAVITY_MSS = 9.80665
FRICTION = 0.6
"""Of the landing gear on the ground."""
GEAR_SAG_M = 0.01
"""How far the gear gives way under the vehicle's weight. A vehicle at rest is at height 0."""
GEAR_DAMPING = 0.7
LEVELLING_S = 0.06
"""The gear stands on several feet: whoever touches down leaning is tipped upright in about this time."""


class RigidBodies:
    """Position, velocity (world axes), attitude and body rates of each vehicle."""

    def __init__(
        self, count: int, mass_kg: Floats | float, inertia_kgm2: Floats, yaw_rad: float | Floats = 0.0
    ) -> None:
        """`inertia_kgm2`: the principal moments about forward, right, down: (3,) or (3, count)."""
        self.count = count
        self.mass_kg = np.broadcast_to(np.asarray(mass_kg, dtype=np.float64), (count,)).copy()
        self.inertia_kgm2 = np.broadcast_to(np.reshape(inertia_kgm2, (3, -1)), (3, count)).copy()
        self.position_m = np.zeros((3, count))
        self.velocity_mps = np.zeros((3, count))
        self.floor_m = np.zeros(count)
        """The ground under each, down of the origin. Whoever flies over hills moves it along."""
        self.attitude = level(count, yaw_rad)
        self.rotation = matrix(self.attitude)
        self.rates_rps = np.zeros((3, count))
        self.on_ground = np.ones(count, dtype=np.bool_)
        self.impact_mps = np.zeros(count)
        """Speed at which each touched the ground in the last step; 0 without a touch."""
        self.specific_force_mss = np.zeros((3, count))
        """What an ideal accelerometer reads, in body axes."""
        self.specific_force_mss[2] = -GRAVITY_MSS

    @property
    def alt_m(self) -> Floats:
        return np.asarray(0.0 - self.position_m[2])

    @property
    def over_ground_m(self) -> Floats:
        return np.asarray(self.floor_m - self.position_m[2])

    def energy_j(self) -> Floats:
        """Kinetic (straight and turning) and potential energy."""
        straight = 0.5 * self.mass_kg * np.einsum("in,in->n", self.velocity_mps, self.velocity_mps)
        turning = 0.5 * np.einsum("in,in,in->n", self.inertia_kgm2, self.rates_rps, self.rates_rps)
        return np.asarray(straight + turning + self.mass_kg * GRAVITY_MSS * self.alt_m)

    def advance(self, force_n: Floats, torque_nm: Floats, dt_s: float) -> None:
        """`force_n` without gravity, in world axes; `torque_nm` in body axes."""
        gear_n = self._gear_n()
        below = self.on_ground
        if below.any():
            torque_nm = self._upright(torque_nm, below, dt_s)
        self._turn(torque_nm, dt_s)
        acceleration = force_n / self.mass_kg
        acceleration[2] -= gear_n / self.mass_kg
        acceleration[2] += GRAVITY_MSS
        self.position_m += self.velocity_mps * dt_s + (0.5 * dt_s * dt_s) * acceleration
        before = self.velocity_mps.copy()
        self.velocity_mps += acceleration * dt_s
        if below.any():
            self._rub(gear_n, below, dt_s)
        felt = (self.velocity_mps - before) / dt_s
        felt[2] -= GRAVITY_MSS
        self.specific_force_mss = to_body(self.rotation, felt)

    def _turn(self, torque_nm: Floats, dt_s: float) -> None:
        middle = self.rates_rps + (0.5 * dt_s) * self._spin_up(self.rates_rps, torque_nm)
        after = self.rates_rps + dt_s * self._spin_up(middle, torque_nm)
        turn = (0.5 * dt_s) * (self.rates_rps + after)
        self.rates_rps = after
        self.attitude = normalised(multiply(self.attitude, from_vector(turn)))
        self.rotation = matrix(self.attitude)

    def _spin_up(self, rates_rps: Floats, torque_nm: Floats) -> Floats:
        return (torque_nm - cross(rates_rps, self.inertia_kgm2 * rates_rps)) / self.inertia_kgm2

    def _gear_n(self) -> Floats:
        """Notices what is on the ground, and returns the upward force of its gear: a spring with a damper."""
        squeezed = self.position_m[2] - self.floor_m + GEAR_SAG_M
        touching = squeezed > 0.0
        self.impact_mps = np.where(touching & ~self.on_ground, self.velocity_mps[2], 0.0)
        self.on_ground = touching
        if not touching.any():
            return np.zeros(self.count)
        stiffness = GRAVITY_MSS / GEAR_SAG_M
        push = stiffness * squeezed + 2.0 * GEAR_DAMPING * np.sqrt(stiffness) * self.velocity_mps[2]
        return np.where(touching, self.mass_kg * np.maximum(push, 0.0), 0.0)

    def _upright(self, torque_nm: Floats, below: npt.NDArray[np.bool_], dt_s: float) -> Floats:
        """The gear takes up every torque and tips the vehicle upright, in a motion that gyroscopes feel."""
        down = self.rotation[2][:, below]  # the world's down axis in body axes
        tip_s = max(LEVELLING_S, 2.0 * dt_s)
        self.rates_rps[:, below] = np.array([-down[1] / tip_s, down[0] / tip_s, np.zeros_like(down[0])])
        return np.where(below, 0.0, torque_nm)

    def _rub(self, gear_n: Floats, below: npt.NDArray[np.bool_], dt_s: float) -> None:
        sliding = self.velocity_mps[:2, below]
        speed = np.hypot(sliding[0], sliding[1])
        slower = np.maximum(speed - FRICTION * gear_n[below] / self.mass_kg[below] * dt_s, 0.0)
        self.velocity_mps[:2, below] = sliding * (slower / np.maximum(speed, 1e-12))
