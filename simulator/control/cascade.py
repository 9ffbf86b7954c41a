"""The cascade: position (PD) asks for a lean, height (PID) for thrust, attitude (PID) for torques.

The reference design holds its place by PD alone. A steady wind then leaves a steady error (drag / POSITION_P), so an
integral learns the wind; `wind_learning=False` is the reference.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from simulator.control.reference import Reference
from simulator.physics.mixer import Mixer
from simulator.physics.quadrotor_design import AIR_DENSITY_KGM3, QuadrotorDesign
from simulator.physics.rigid_body import GRAVITY_MSS
from simulator.physics.rotation import Floats, conjugate, from_euler, limited, multiply, to_euler, to_vector


@dataclass(frozen=True, slots=True)
class Gains:
    """Per metre, metre per second, radian and radian per second; accelerations come out."""

    position_p: float = 5.0
    position_d: float = 3.8
    wind_i: float = 2.2
    height_p: float = 6.0
    height_d: float = 5.0
    height_i: float = 3.0
    attitude_p: float = 110.0
    attitude_d: float = 19.0
    attitude_i: float = 60.0
    yaw_p: float = 6.0
    yaw_d: float = 4.5
    yaw_i: float = 1.0
    max_lean_rad: float = 0.8
    max_push_mss: float = 9.0
    """Largest acceleration that the integral of the wind may ask for."""
    max_lift_mss: float = 4.0
    """The same of the height's."""
    max_position_error_m: float = 4.0
    """A reference farther away than this pulls no harder."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What a controller knows of its vehicles; from the filter, or the truth."""

    position_m: Floats
    velocity_mps: Floats
    attitude: Floats
    rates_rps: Floats


class Cascade:
    def __init__(
        self, design: QuadrotorDesign, count: int, gains: Gains | None = None, *, wind_learning: bool = True
    ) -> None:
        gains = gains or Gains()
        self.gains = gains if wind_learning else replace(gains, wind_i=0.0)
        self.design = design
        self.mixer = Mixer(design)
        self._inertia = design.inertia_kgm2[:, np.newaxis]
        self._push_mss = np.zeros((2, count))
        self._lift_mss = np.zeros(count)
        self._turn = np.zeros((3, count))
        self._p = np.array([[gains.attitude_p], [gains.attitude_p], [gains.yaw_p]])
        self._d = np.array([[gains.attitude_d], [gains.attitude_d], [gains.yaw_d]])
        self._i = np.array([[gains.attitude_i], [gains.attitude_i], [gains.yaw_i]])
        self._most_turn = np.array([[20.0], [20.0], [2.0]])
        self.thrust_n = np.zeros(count)
        self.wanted_attitude = np.zeros((4, count))

    def reset(self, vehicles: npt.NDArray[np.intp] | slice = slice(None)) -> None:
        self._push_mss[:, vehicles] = 0.0
        self._lift_mss[vehicles] = 0.0
        self._turn[:, vehicles] = 0.0

    def commands(
        self, motion: Motion, reference: Reference, dt_s: float, on_ground: npt.NDArray[np.bool_] | None = None
    ) -> Floats:
        """Returns shares of the full rotor speed, (4, vehicles). Vehicles `on_ground` (bool) learn nothing."""
        learning = 1.0 if on_ground is None else np.where(on_ground, 0.0, 1.0)
        push = self._push(motion, reference, dt_s, learning)
        lift = self._lift(motion, reference, dt_s, learning)
        return self.lean(motion, push, lift, reference.yaw_rad, dt_s, learning)

    def lean(
        self,
        motion: Motion,
        push_mss: Floats,
        lift_mss: Floats,
        yaw_rad: float | Floats,
        dt_s: float,
        learning: Floats | float,
    ) -> Floats:
        """`push_mss`: wanted level acceleration, north and east; `lift_mss`: upward, gravity not counted."""
        roll, pitch, yaw = to_euler(motion.attitude)
        cos, sin = np.cos(yaw), np.sin(yaw)
        forward = push_mss[0] * cos + push_mss[1] * sin
        right = push_mss[1] * cos - push_mss[0] * sin
        upward = np.maximum(GRAVITY_MSS + lift_mss, 0.3 * GRAVITY_MSS)
        wanted_pitch = -np.arctan2(forward, upward)
        wanted_roll = np.arctan2(right * np.cos(wanted_pitch), upward)
        upright = np.maximum(np.cos(roll) * np.cos(pitch), 0.5)
        thrust = self.design.mass_kg * (GRAVITY_MSS + lift_mss) / upright
        wanted_yaw = np.broadcast_to(np.asarray(yaw_rad, dtype=np.float64), roll.shape)
        return self.hold_attitude(motion, from_euler(wanted_roll, wanted_pitch, wanted_yaw), thrust, dt_s, learning)

    def hold_attitude(
        self, motion: Motion, wanted: Floats, thrust_n: Floats, dt_s: float, learning: Floats | float = 1.0
    ) -> Floats:
        self.wanted_attitude = wanted
        self.thrust_n = limited(thrust_n, 0.0, 4.0 * self.design.full_thrust_n)
        error = to_vector(multiply(conjugate(motion.attitude), wanted))
        near = np.abs(error) < 0.5  # in a large manoeuvre an integral would only wind up
        self._turn = limited(self._turn + self._i * error * near * learning * dt_s, -self._most_turn, self._most_turn)
        turn = self._p * limited(error, -0.7, 0.7) - self._d * motion.rates_rps + self._turn
        return self.mixer.commands(self.thrust_n, self._inertia * turn)

    def _push(self, motion: Motion, reference: Reference, dt_s: float, learning: Floats | float) -> Floats:
        gains = self.gains
        apart = _columns(reference.position_m)[:2] - motion.position_m[:2]
        far = np.hypot(apart[0], apart[1])
        apart = apart * np.minimum(1.0, gains.max_position_error_m / np.maximum(far, 1e-9))
        speed = _columns(reference.velocity_mps)
        slower = speed[:2] - motion.velocity_mps[:2]
        wanted = gains.position_p * apart + gains.position_d * slower + self._push_mss
        wanted = wanted + _columns(reference.acceleration_mss)[:2] + self._drag_mss(speed)[:2]
        most = GRAVITY_MSS * np.tan(gains.max_lean_rad)
        size = np.hypot(wanted[0], wanted[1])
        # Learn the wind only while there is lean to spare, else the integral winds up.
        spare = np.where(size < most, learning, 0.0)
        learned = self._push_mss + (gains.wind_i * dt_s) * apart * spare
        self._push_mss = limited(learned, -gains.max_push_mss, gains.max_push_mss)
        return np.asarray(wanted * np.minimum(1.0, most / np.maximum(size, 1e-9)))

    def _lift(self, motion: Motion, reference: Reference, dt_s: float, learning: Floats | float) -> Floats:
        gains = self.gains
        higher = motion.position_m[2] - _columns(reference.position_m)[2]
        higher = limited(higher, -gains.max_position_error_m, gains.max_position_error_m)
        faster = motion.velocity_mps[2] - _columns(reference.velocity_mps)[2]
        lift = gains.height_p * higher + gains.height_d * faster + self._lift_mss
        lift = lift - _columns(reference.acceleration_mss)[2]
        most = 4.0 * self.design.full_thrust_n / self.design.mass_kg - GRAVITY_MSS
        spare = np.where((lift < most) & (lift > -0.8 * GRAVITY_MSS), learning, 0.0)
        learned = self._lift_mss + (gains.height_i * dt_s) * higher * spare
        self._lift_mss = limited(learned, -gains.max_lift_mss, gains.max_lift_mss)
        return limited(lift, -0.8 * GRAVITY_MSS, most)

    def _drag_mss(self, velocity_mps: Floats) -> Floats:
        """In still air, level and hovering."""
        design = self.design
        speed = np.sqrt(np.einsum("in,in->n", velocity_mps, velocity_mps))
        blades = 4.0 * design.rotor_drag * design.hover_speed_rps
        per_speed = (0.5 * AIR_DENSITY_KGM3 * design.drag_area_m2 * speed + blades) / design.mass_kg
        return np.asarray(per_speed * velocity_mps)


def _columns(vector: Floats) -> Floats:
    return vector[:, np.newaxis] if vector.ndim == 1 else vector
