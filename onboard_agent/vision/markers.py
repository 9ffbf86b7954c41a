"""ArUco and AprilTag markers, by OpenCV's detector: number, corners, and pose if the side is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.camera_model import CameraModel
from onboard_agent.vision.concentric_squares import diagonal_meetings, square_target
from onboard_agent.vision.square_pose import SquarePose, square_pose
from onboard_agent.vision.square_target import Point, SquareTarget
from onboard_agent.vision.target_kind import MARKER_FAMILIES
from onboard_agent.vision.target_kind import Marker as MarkerKind

FAMILIES: Final = {
    family: int(getattr(cv2.aruco, f"DICT_{family.removeprefix('aruco-').replace('-', '_').upper()}"))
    if family != "aruco-original"
    else cv2.aruco.DICT_ARUCO_ORIGINAL
    for family in MARKER_FAMILIES
}


@dataclass(frozen=True, slots=True)
class Marker:
    """`corners_px`: from the marker's own top left, clockwise on its face."""

    number: int
    centre_px: Point
    corners_px: tuple[Point, Point, Point, Point]

    def pose(self, side_m: float, camera: CameraModel) -> SquarePose | None:
        """`side_m`: of the black square."""
        return square_pose(self.corners_px, side_m, camera)


class MarkerDetector:
    """Raises ValueError for a family that is not in `FAMILIES`."""

    def __init__(self, family: str = "apriltag-36h11") -> None:
        if family not in FAMILIES:
            raise ValueError(f"{family!r} is none of {', '.join(FAMILIES)}")
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(FAMILIES[family]), parameters)

    def find(self, picture: npt.NDArray[np.uint8]) -> list[Marker]:
        """Takes (height, width) grey or (height, width, 3) blue, green, red. Returns markers by number."""
        grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        outlines, numbers, _ = self._detector.detectMarkers(grey)
        found = []
        for number, outline in zip(np.asarray(() if numbers is None else numbers).ravel(), outlines, strict=True):
            corners = np.asarray(outline, np.float64).reshape(4, 2)
            a, b, c, d = ((float(x), float(y)) for x, y in corners)
            x, y = diagonal_meetings(corners[None])[0]
            found.append(Marker(int(number), (float(x), float(y)), (a, b, c, d)))
        return sorted(found, key=lambda marker: marker.number)


class MarkerTargets:
    """A detector of targets: the markers of one family and number. Keeps no state between pictures."""

    def __init__(self, kind: MarkerKind) -> None:
        self._number = kind.number
        self._detector = MarkerDetector(kind.family)

    def find(self, picture: npt.NDArray[np.uint8]) -> list[SquareTarget]:
        """Takes (height, width) grey or (height, width, 3) blue, green, red."""
        found = [marker for marker in self._detector.find(picture) if marker.number == self._number]
        return [square_target(np.array(marker.corners_px), (1.0,), 1.0) for marker in found]
