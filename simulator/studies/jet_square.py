"""The square test of the jet quadcopter: take-off to 10 m, a square of 10 m sides, landing.

Flown three times: by the quadrotor alone, with the jet, and with the jet refined (an engine that spools more slowly, in
coarser steps of its throttle, with a dead band of a metre and a map that is wrong by a little). Gains and masses of the
published machine are unknown. Ours were chosen so that the published findings appear: the model explains them, it does
not predict them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from simulator.control.cascade import Cascade, Gains, Motion
from simulator.control.jet_governor import JetGains, JetGovernor
from simulator.control.trajectory import PlanLimits, Trajectory, WayPoint, plan
from simulator.physics.jet_quadrotor import JetDesign, JetQuadrotorDesign, JetQuadrotors
from simulator.physics.quadrotor import Quadrotors
from simulator.physics.rotation import Floats

SIDE_M = HEIGHT_M = 10.0
PAUSE_S = 8.0
SETTLED_S = 1.6
"""Of each pause: its end, in which oscillation and steady error are measured."""
LATE_S = 30.0
"""Before the landing: what is there then is not the take-off any more."""
POSITION_NOISE_M, VELOCITY_NOISE_MPS = 0.02, 0.05
"""Of what the controller is told (standard deviations)."""
VERTICAL_JET_DEG = 25.0


class Case(StrEnum):
    ALONE = "quadrotor alone"
    JET = "with jet"
    REFINED = "with jet, refined"


_ALONE = Gains(position_p=8.0, position_d=5.0, wind_i=1.6, attitude_p=45.0, attitude_d=11.0, max_lean_rad=0.6)
_CARRIED = replace(_ALONE, height_p=1.0, height_d=1.6, height_i=0.0)
_REFINED = replace(_ALONE, height_p=0.7, height_d=1.2, height_i=0.0)
_SETTINGS: Mapping[Case, tuple[Gains, JetDesign, JetGains]] = {
    Case.ALONE: (_ALONE, JetDesign(), JetGains()),
    Case.JET: (
        _CARRIED,
        JetDesign(spool_share_per_s=0.15, spool_s=1.2),
        JetGains(height_p=0.03, height_d=0.0, height_i=0.0, step=0.01),
    ),
    Case.REFINED: (
        _REFINED,
        JetDesign(spool_share_per_s=0.08, spool_s=1.5),
        JetGains(
            height_p=0.025,
            height_d=0.0,
            height_i=0.0015,
            max_learned=0.3,
            step=0.03,
            dead_band_m=1.0,
            map_error=0.025,
        ),
    ),
}


@dataclass(frozen=True, slots=True)
class SquareFlight:
    """One flight. Positions (samples, 3): north, east, down."""

    case: Case
    trajectory: Trajectory
    times_s: Floats
    position_m: Floats
    reference_m: Floats
    jet_tilt_deg: Floats
    jet_n: Floats
    rotors_n: Floats

    def _settled(self) -> list[Floats]:
        """The deviations at the end of each pause at a corner: position less reference, height upward."""
        ends = [leg.from_s for leg in self.trajectory.legs if leg.motion.distance_m == 0.0]
        off = (self.position_m - self.reference_m) * np.array([1.0, 1.0, -1.0])
        return [off[(self.times_s > end_s - SETTLED_S) & (self.times_s < end_s)] for end_s in ends]

    @property
    def oscillation_m(self) -> float:
        """Half of the way to and fro in north and east, whichever is more: the median over the corners."""
        return float(np.median([max(np.ptp(off[:, 0]), np.ptp(off[:, 1])) / 2.0 for off in self._settled()]))

    @property
    def overshoot_m(self) -> float:
        return float(-self.position_m[:, 2].min() - HEIGHT_M)

    def _late_height_m(self) -> Floats:
        """Over the reference, in the last `LATE_S` before the landing."""
        end_s = max(leg.from_s for leg in self.trajectory.legs if leg.motion.distance_m == 0.0)
        late = (self.times_s > end_s - LATE_S) & (self.times_s < end_s)
        return np.asarray(self.reference_m[late, 2] - self.position_m[late, 2])

    @property
    def steady_error_m(self) -> float:
        """Of the height: the mean of its last part."""
        return float(self._late_height_m().mean())

    @property
    def height_oscillation_m(self) -> float:
        """Half of the height's range in its last part."""
        return float(np.ptp(self._late_height_m()) / 2.0)

    @property
    def worst_tilt_deg(self) -> float:
        return float(self.jet_tilt_deg.max())

    @property
    def landed(self) -> bool:
        return bool(abs(self.position_m[-1, 2]) < 0.5)


def square() -> Trajectory:
    corners = [
        WayPoint(SIDE_M, 0.0, HEIGHT_M),
        WayPoint(SIDE_M, SIDE_M, HEIGHT_M),
        WayPoint(0.0, SIDE_M, HEIGHT_M),
        WayPoint(0.0, 0.0, HEIGHT_M),
    ]
    limits = PlanLimits(speed_mps=2.0, acceleration_mss=1.0, climb_mps=2.0)
    return plan(corners, limits, take_off_m=HEIGHT_M, pause_s=PAUSE_S)


def fly(case: Case, *, dt_s: float = 0.01, seed: int = 1) -> SquareFlight:
    gains, jet, jet_gains = _SETTINGS[case]
    design = JetQuadrotorDesign(jet=jet)
    jets = JetQuadrotors(design) if case is not Case.ALONE else None
    body = jets or Quadrotors(design.quadrotor)
    cascade = Cascade(design.quadrotor, 1, gains, wind_learning=False)
    governor = JetGovernor(design, 1, jet_gains)
    noise = np.random.default_rng(seed)
    trajectory, still = square(), np.zeros((3, 1))
    rows = []
    for step in range(round((trajectory.duration_s + 8.0) / dt_s)):
        reference = trajectory.at(step * dt_s)
        motion = Motion(
            body.position_m + noise.normal(0.0, POSITION_NOISE_M, (3, 1)),
            body.velocity_mps + noise.normal(0.0, VELOCITY_NOISE_MPS, (3, 1)),
            body.attitude,
            body.rates_rps,
        )
        if jets is not None:
            jets.throttle, jets.gimbal_rad = governor.command(motion, reference, dt_s)
        body.step(cascade.commands(motion, reference, dt_s, body.on_ground), dt_s, still)
        tilt_deg = float(np.degrees(jets.jet_tilt_rad()[0])) if jets is not None else 0.0
        jet_n = float(jets.jet_thrust_n[0]) if jets is not None else 0.0
        rotors_n = float(body.thrust_n.sum())
        rows.append((step * dt_s, *body.position_m[:, 0], *reference.position_m, tilt_deg, jet_n, rotors_n))
    table = np.array(rows)
    return SquareFlight(
        case, trajectory, table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7], table[:, 8], table[:, 9]
    )
