"""Second opinions on the heading, which the filter's own doubt cannot give: a gyroscope that suddenly turns and a field
that suddenly lies beside the compass look the same from inside.

The compass has an opinion by itself, without what the filter has learnt of its error, while the field has the earth's
strength and dip, and has not jumped. Motion has one: the way that satellites see a change of velocity point, beside
the way that the inertial sensors felt it. Who hovers has only the first.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from simulator.physics.rotation import Floats, to_world
from simulator.sensors.magnetometer import earth_field_gauss

Flags = npt.NDArray[np.bool_]

MAX_STRENGTH_GAUSS = 0.035
MAX_DIP_RAD = math.radians(6.0)
"""What a calibrated compass and a small error of the tilt leave."""
SMOOTHED_S = 0.3
JUMP_RAD = math.radians(12.0)
"""No gyroscope turns so far within `SMOOTHED_S` without being noticed: it is the field."""
DRIFT_RAD, DRIFT_S = math.radians(4.0), 0.5
APART_RAD, APART_S = math.radians(9.0), 0.5
AGREE_RAD, AGREE_S = math.radians(5.0), 2.0
SILENT_S = 2.0
LEG_S = 1.0
"""Of a change of velocity."""
KEPT_S = 10.0
LEG_NOISE_MPS = 0.12
SURE_RAD = math.radians(5.0)
"""Standard deviation of the opinion by motion, from which it counts."""
CONTRARY_RAD = math.radians(12.0)


def turned(angle: Floats) -> Floats:
    """Returns the angles from -pi to pi."""
    return np.asarray((angle + math.pi) % (2.0 * math.pi) - math.pi)


class HeadingCheck:
    def __init__(self, count: int) -> None:
        self.known = np.ones(count, dtype=np.bool_)
        """Whether the heading is confirmed."""
        self.off_rad = np.zeros(count)
        """How far the believed heading is from the compass's, smoothed."""
        field = earth_field_gauss()[:, 0]
        self._strength = float(np.linalg.norm(field))
        self._dip_rad = math.asin(float(field[2]) / self._strength)
        self._declination_rad = math.atan2(float(field[1]), float(field[0]))
        self._jumped = np.zeros(count, dtype=np.bool_)
        self._drifts_s, self._apart_s, self._agrees_s = np.zeros(count), np.zeros(count), np.zeros(count)
        self._heard_s = np.full(count, -math.inf)
        self._last_s = 0.0
        self._leg_s = -math.inf
        self._felt, self._seen = np.full((2, count), np.nan), np.full((2, count), np.nan)
        self._likeness = np.zeros(count, dtype=np.complex128)
        self._motion = np.zeros(count)

    def start(self, seats: npt.NDArray[np.intp], now_s: float) -> None:
        """These vehicles have just been aligned by their compass."""
        self.known[seats], self._heard_s[seats] = True, now_s
        for part in (self.off_rad, self._drifts_s, self._apart_s, self._motion, self._likeness):
            part[seats] = 0.0
        self._jumped[seats] = False
        self.forget_legs(seats)

    def forget_legs(self, seats: npt.NDArray[np.intp] | Flags) -> None:
        """The velocity or the heading was set anew: what was felt before does not go with what is felt after."""
        self._felt[:, seats] = np.nan
        self._likeness[seats], self._motion[seats] = 0.0, 0.0

    def take_compass(self, rotation: Floats, field_gauss: Floats, fresh: Flags, now_s: float) -> Flags:
        """`field_gauss`: calibrated, in body axes. Returns the vehicles whose gyroscope must have changed: the heading
        drifts away from a compass that nothing disturbs."""
        usable = fresh & np.isfinite(field_gauss).all(axis=0)
        over_s, self._last_s = min(now_s - self._last_s, 0.2), now_s
        world = to_world(rotation, np.where(usable, field_gauss, 1.0))
        strength = np.linalg.norm(world, axis=0)
        dip_rad = np.arcsin(np.clip(world[2] / np.maximum(strength, 1e-6), -1.0, 1.0))
        earthly = np.abs(strength - self._strength) < MAX_STRENGTH_GAUSS
        earthly &= np.abs(dip_rad - self._dip_rad) < MAX_DIP_RAD
        off = turned(np.arctan2(world[1], world[0]) - self._declination_rad)
        ahead = np.abs(turned(off - self.off_rad))
        self._jumped = np.where(usable, (self._jumped | (ahead > JUMP_RAD)) & (np.abs(off) > AGREE_RAD), self._jumped)
        blend = over_s / (SMOOTHED_S + over_s)
        self.off_rad = np.where(usable, turned(self.off_rad + blend * turned(off - self.off_rad)), self.off_rad)
        self._heard_s = np.where(usable, now_s, self._heard_s)
        sound = usable & earthly & ~self._jumped
        size = np.abs(self.off_rad)

        def lasting(so_far_s: Floats, holds: Flags) -> Floats:
            return np.where(usable, np.where(holds, so_far_s + over_s, 0.0), so_far_s)

        self._drifts_s = lasting(self._drifts_s, sound & (size > DRIFT_RAD))
        self._apart_s = lasting(self._apart_s, ~sound | (size > APART_RAD))
        self._agrees_s = lasting(self._agrees_s, sound & (size < AGREE_RAD))
        self._judge(now_s)
        drifting = np.asarray(self._drifts_s > DRIFT_S)
        self._drifts_s = np.where(drifting, -DRIFT_S, self._drifts_s)
        return drifting

    def take_velocity(self, felt_mps: Floats, seen_mps: Floats, fresh: Flags, now_s: float) -> None:
        """`felt_mps`: what the inertial sensors alone add up to, on the believed heading; `seen_mps`: by satellites.
        North and east."""
        if now_s - self._leg_s < LEG_S - 1e-6:
            return
        self._leg_s = now_s
        felt, seen = felt_mps - self._felt, seen_mps - self._seen
        usable = fresh & np.isfinite(felt).all(axis=0) & np.isfinite(seen).all(axis=0)
        ours, theirs = felt[0] + 1j * felt[1], seen[0] + 1j * seen[1]
        keep = math.exp(-LEG_S / KEPT_S)
        self._likeness = keep * self._likeness + np.where(usable, ours * np.conj(theirs), 0.0)
        self._motion = keep * self._motion + np.where(usable, np.abs(ours) * np.abs(theirs), 0.0)
        self._felt, self._seen = felt_mps.copy(), np.where(fresh, seen_mps, np.nan)

    @property
    def motion_off_rad(self) -> Floats:
        """How far the believed heading is from that by motion; NaN: motion has no opinion."""
        doubt_rad = LEG_NOISE_MPS / np.sqrt(np.maximum(self._motion, 1e-6))
        return np.where(doubt_rad < SURE_RAD, np.angle(self._likeness), np.nan)

    def _judge(self, now_s: float) -> None:
        by_motion = np.abs(self.motion_off_rad)
        contrary, confirms = by_motion > CONTRARY_RAD, by_motion < AGREE_RAD
        silent = now_s - self._heard_s > SILENT_S
        lost = (self._apart_s > APART_S) | silent | contrary
        found = ((self._agrees_s > AGREE_S) & ~silent & ~contrary) | confirms
        self.known = np.where(found, True, np.where(lost, False, self.known))
