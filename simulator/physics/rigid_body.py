"""Rigid bodies under forces and torques, above flat ground at down = 0. Knows no propeller and no wind."""

from __future__ import annotations

import numpy as np

from simulator.physics.rotation import (
    Floats,
    cross,
    from_vector,
    level,
    matrix,
    multiply,
    normalised,
    to_body,
    to_euler,
)

GRAVITY_MSS = 9.80665
GRIP_PER_S = 12.0
"""How fast the ground takes horizontal speed away from a vehicle that stands on it."""
STOPPED_MPS = 0.01


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

    def energy_j(self) -> Floats:
        """Kinetic (straight and turning) and potential energy."""
        straight = 0.5 * self.mass_kg * np.einsum("in,in->n", self.velocity_mps, self.velocity_mps)
        turning = 0.5 * np.einsum("in,in,in->n", self.inertia_kgm2, self.rates_rps, self.rates_rps)
        return np.asarray(straight + turning + self.mass_kg * GRAVITY_MSS * self.alt_m)

    def advance(self, force_n: Floats, torque_nm: Floats, dt_s: float) -> None:
        """`force_n` without gravity, in world axes; `torque_nm` in body axes."""
        self._turn(torque_nm, dt_s)
        acceleration = force_n / self.mass_kg
        acceleration[2] += GRAVITY_MSS
        self.position_m += self.velocity_mps * dt_s + (0.5 * dt_s * dt_s) * acceleration
        before = self.velocity_mps.copy()
        self.velocity_mps += acceleration * dt_s
        self._touch_ground(force_n, dt_s)
        felt = (self.velocity_mps - before) / dt_s
        felt[2] -= GRAVITY_MSS
        # The knock of a touchdown is a matter of milliseconds, not of a whole step: sensors see at most 4 g of it.
        self.specific_force_mss = to_body(self.rotation, np.clip(felt, -4.0 * GRAVITY_MSS, 4.0 * GRAVITY_MSS))

    def _turn(self, torque_nm: Floats, dt_s: float) -> None:
        middle = self.rates_rps + (0.5 * dt_s) * self._spin_up(self.rates_rps, torque_nm)
        after = self.rates_rps + dt_s * self._spin_up(middle, torque_nm)
        turn = (0.5 * dt_s) * (self.rates_rps + after)
        self.rates_rps = after
        self.attitude = normalised(multiply(self.attitude, from_vector(turn)))
        self.rotation = matrix(self.attitude)

    def _spin_up(self, rates_rps: Floats, torque_nm: Floats) -> Floats:
        return (torque_nm - cross(rates_rps, self.inertia_kgm2 * rates_rps)) / self.inertia_kgm2

    def _touch_ground(self, force_n: Floats, dt_s: float) -> None:
        below = self.position_m[2] >= 0.0
        self.impact_mps = np.where(below & ~self.on_ground, self.velocity_mps[2], 0.0)
        self.on_ground = below
        if not below.any():
            return
        self.position_m[2, below] = 0.0
        self.velocity_mps[2, below] = np.minimum(self.velocity_mps[2, below], 0.0)
        # Standing on its gear with little weight on it, a vehicle slides more easily.
        weight = self.mass_kg[below] * GRAVITY_MSS
        pressed = np.clip(1.0 + force_n[2, below] / weight, 0.2, 1.0)
        sliding = self.velocity_mps[:2, below] * np.exp(-GRIP_PER_S * dt_s * pressed)
        sliding[:, np.hypot(sliding[0], sliding[1]) < STOPPED_MPS] = 0.0
        self.velocity_mps[:2, below] = sliding
        # The gear stands level: of the attitude only the heading survives the touchdown.
        self.rates_rps[:, below] = 0.0
        yaw = to_euler(self.attitude[:, below])[2]
        self.attitude[:, below] = level(yaw.size, yaw)
        self.rotation[:, :, below] = matrix(self.attitude[:, below])
