"""ArUco and AprilTag markers, by OpenCV's detector: number, corners, and pose if the side is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.camera_model import CameraModel
from onboard_agent.vision.concentric_squares import diagonal_meetings
from onboard_agent.vision.square_pose import SquarePose, square_pose
from onboard_agent.vision.square_target import Point

FAMILIES: Final = {
    "aruco-4x4-50": cv2.aruco.DICT_4X4_50,
    "aruco-5x5-100": cv2.aruco.DICT_5X5_100,
    "aruco-6x6-250": cv2.aruco.DICT_6X6_250,
    "aruco-original": cv2.aruco.DICT_ARUCO_ORIGINAL,
    "apriltag-16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "apriltag-25h9": cv2.aruco.DICT_APRILTAG_25h9,
    "apriltag-36h11": cv2.aruco.DICT_APRILTAG_36h11,
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
