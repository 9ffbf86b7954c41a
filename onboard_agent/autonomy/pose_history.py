"""Where the drone was, and how it leaned, when a picture was taken. Pure; one thread adds while others ask."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from onboard_agent.autonomy.core.lines import Seen

KEPT: Final = 40
"""Four seconds."""
MAX_AHEAD_S: Final = 0.4
"""After the newest telemetry the drone is taken to fly on as it did; for longer its place is not known."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Degrees and metres; `height_m` above home. `yaw_deg` from north, clockwise; `pitch_deg` nose up; `roll_deg` right
    side down."""

    lat_deg: float
    lon_deg: float
    height_m: float
    roll_deg: float
    pitch_deg: float
    yaw_deg: float


Sample = tuple[float, tuple[float, ...]]


class PoseHistory:
    """Add each line of telemetry, then ask `at`."""

    def __init__(self) -> None:
        self._places: deque[Sample] = deque(maxlen=KEPT)
        self._angles: deque[Sample] = deque(maxlen=KEPT)

    def add(self, seen: Seen) -> None:
        """Takes telemetry. What has not changed since the last line counts once."""
        if not self._places or seen.position_at_s > self._places[-1][0]:
            self._places.append((seen.position_at_s, (seen.lat_deg, seen.lon_deg, seen.height_m)))
        if seen.attitude_at_s and (not self._angles or seen.attitude_at_s > self._angles[-1][0]):
            yaw = seen.yaw_deg
            if self._angles:  # never the long way round
                before = self._angles[-1][1][2]
                yaw = before + (yaw - before + 180.0) % 360.0 - 180.0
            self._angles.append((seen.attitude_at_s, (seen.roll_deg, seen.pitch_deg, yaw)))

    def at(self, taken_s: float) -> Pose | None:
        """Returns the pose at a time of CLOCK_MONOTONIC, between the two samples around it; None: not known."""
        place, angles = _at(tuple(self._places), taken_s), _at(tuple(self._angles), taken_s)
        if place is None or angles is None:
            return None
        lat_deg, lon_deg, height_m = place
        roll_deg, pitch_deg, yaw_deg = angles
        return Pose(lat_deg, lon_deg, height_m, roll_deg, pitch_deg, yaw_deg % 360.0)


def _at(samples: Sequence[Sample], at_s: float) -> tuple[float, ...] | None:
    if not samples or at_s < samples[0][0] or at_s > samples[-1][0] + MAX_AHEAD_S:
        return None
    later = next((number for number, one in enumerate(samples) if one[0] >= at_s), len(samples) - 1)
    if later == 0:
        return samples[0][1]
    (before_s, before), (after_s, after) = samples[later - 1], samples[later]
    share = (at_s - before_s) / (after_s - before_s)
    return tuple(one + share * (other - one) for one, other in zip(before, after, strict=True))
