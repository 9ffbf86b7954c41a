"""Where a landing pad is: several markers around one place to touch down, found in a picture.

A large marker is found from far above and leaves the picture close to the ground; a small one takes over there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from onboard_agent.vision.camera_model import CameraModel, Vector
from onboard_agent.vision.landing_target import VISION_FIDUCIAL, LandingTarget, NotBelow, landing_target
from onboard_agent.vision.markers import Marker, MarkerDetector
from onboard_agent.vision.pad_setting import PadMarker


@dataclass(frozen=True, slots=True)
class PadSighting:
    """`body_m`: the place to touch down (forward, right, down) from the vehicle's reference point. `yaw_rad`: of the
    pad's top against the nose, clockwise. `number`, `size_rad`: of the marker that told."""

    body_m: Vector
    yaw_rad: float
    number: int
    size_rad: float

    def message(self, time_us: int) -> LandingTarget | None:
        """Returns the fields of LANDING_TARGET; None if the pad is not below the vehicle. `time_us`: when the picture
        was taken."""
        distance_m = math.hypot(*self.body_m)
        try:
            return landing_target(
                self.body_m,
                time_us=time_us,
                kind=VISION_FIDUCIAL,
                number=self.number,
                distance_m=distance_m,
                size_rad=self.size_rad,
                yaw_rad=self.yaw_rad,
            )
        except NotBelow:
            return None


class PadFinder:
    """Raises ValueError for an unknown family, or a pad without markers."""

    def __init__(self, markers: Sequence[PadMarker], family: str, camera: CameraModel) -> None:
        if not markers:
            raise ValueError("a landing pad has markers")
        self._markers = {marker.number: marker for marker in markers}
        self._detector = MarkerDetector(family)
        self._camera = camera

    def look(self, picture: npt.NDArray[np.uint8]) -> PadSighting | None:
        """Takes (height, width) grey or (height, width, 3) blue, green, red. The largest marker in the picture tells:
        it is the most exact."""
        found = [marker for marker in self._detector.find(picture) if marker.number in self._markers]
        for marker in sorted(found, key=_side_px, reverse=True):
            sighting = self._from(marker)
            if sighting is not None:
                return sighting
        return None

    def _from(self, marker: Marker) -> PadSighting | None:
        known = self._markers[marker.number]
        pose = marker.pose(known.side_m, self._camera)
        if pose is None:
            return None
        right, up = pose.body_from_square[:, 0], pose.body_from_square[:, 1]
        mounting = self._camera.mounting
        lens = np.array([mounting.forward_m, mounting.right_m, mounting.down_m])
        place = lens + np.array(pose.body_m) - known.right_m * right - known.up_m * up
        forward_m, right_m, down_m = (float(part) for part in place)
        yaw_rad = math.atan2(float(up[1]), float(up[0]))
        return PadSighting((forward_m, right_m, down_m), yaw_rad, marker.number, known.side_m / pose.distance_m)


def _side_px(marker: Marker) -> float:
    a, b, c, d = marker.corners_px
    return max(math.dist(a, c), math.dist(b, d))
