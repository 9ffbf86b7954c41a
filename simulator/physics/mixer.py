"""From thrust and torques to motor commands, for every frame. Roll and pitch come before thrust, thrust before yaw."""

from __future__ import annotations

import numpy as np

from simulator.physics.quadrotor_design import QuadrotorDesign
from simulator.physics.rotation import Floats, limited

IDLE_SHARE = 0.06
"""Share of the full thrust that armed motors never go below in flight."""


class Mixer:
    def __init__(self, design: QuadrotorDesign) -> None:
        self._full_n = design.full_thrust_n
        columns = np.linalg.inv(design.allocation())
        self._per_thrust, self._per_tilt, self._per_yaw = columns[:, :1], columns[:, 1:3], columns[:, 3:]

    def thrusts_n(self, thrust_n: Floats, torque_nm: Floats) -> Floats:
        """Returns what each motor is to give, (4, vehicles). What cannot be had is given up in the order above."""
        low, high = IDLE_SHARE * self._full_n, self._full_n
        tilt = self._per_tilt @ torque_nm[:2]
        spread = tilt.max(axis=0) - tilt.min(axis=0)
        tilt = tilt * np.minimum(1.0, (high - low) / np.maximum(spread, 1e-9))
        lift = self._per_thrust @ thrust_n[np.newaxis]
        lift = limited(lift, low - tilt.min(axis=0), high - tilt.max(axis=0))
        level = lift + tilt
        yaw = self._per_yaw @ torque_nm[2:]
        room = np.where(yaw > 0.0, high - level, level - low)
        share = np.min(np.where(np.abs(yaw) > 1e-12, room / np.maximum(np.abs(yaw), 1e-12), 1.0), axis=0)
        return np.asarray(level + yaw * limited(share, 0.0, 1.0))

    def commands(self, thrust_n: Floats, torque_nm: Floats) -> Floats:
        """Returns shares of the full rotor speed, 0..1: thrust grows with the square of the speed."""
        return np.sqrt(limited(self.thrusts_n(thrust_n, torque_nm) / self._full_n, 0.0, 1.0))
