"""The pose of a square of known side, from its four corners (OpenCV's IPPE for squares)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.camera_model import CameraModel, Vector, applied
from onboard_agent.vision.square_target import Point

Floats = npt.NDArray[np.float64]
MAX_AMBIGUITY: Final = 0.6
"""Ratio of the two solutions' errors above which the rotation, not the place, is in doubt."""
MIN_APART_RAD: Final = 0.1
"""Solutions closer to each other are one."""


@dataclass(frozen=True, slots=True)
class SquarePose:
    """`body_m`: the square's centre in body axes (forward, right, down) from the lens. `body_from_square`: rotation
    (3, 3) from its axes (right, up, out of its face) to body axes. `error_px`: root mean square of the reprojection.
    `is_ambiguous`: a mirrored tilt explains the corners nearly as well; place and distance hold all the same."""

    body_m: Vector
    body_from_square: Floats
    error_px: float
    is_ambiguous: bool

    @property
    def distance_m(self) -> float:
        x, y, z = self.body_m
        return float(np.sqrt(x * x + y * y + z * z))


def camera_matrix(camera: CameraModel) -> Floats:
    x, y = camera.middle_px
    return np.array([[camera.focal_px, 0.0, x], [0.0, camera.focal_px, y], [0.0, 0.0, 1.0]])


def square_pose(corners_px: tuple[Point, Point, Point, Point], side_m: float, camera: CameraModel) -> SquarePose | None:
    """`corners_px`: top left, top right, bottom right, bottom left as the square's own face has them. Raises ValueError
    unless `side_m` is above 0; returns None if OpenCV finds no pose ahead of the camera."""
    if side_m <= 0.0:
        raise ValueError("side_m is to be above 0")
    half = side_m / 2.0
    # The order that SOLVEPNP_IPPE_SQUARE asks for.
    model = np.array([(-half, half, 0.0), (half, half, 0.0), (half, -half, 0.0), (-half, -half, 0.0)])
    seen = np.array(corners_px, np.float64)
    matrix, undistorted = camera_matrix(camera), np.zeros(4)
    _, turns, places, _ = cv2.solvePnPGeneric(model, seen, matrix, undistorted, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    solutions = []
    for turn, place in zip(turns, places, strict=True):
        # Seen exactly from ahead, IPPE is degenerate and off by tens of degrees: refine each of the two.
        turn, place = cv2.solvePnPRefineLM(model, seen, matrix, undistorted, turn, place)
        drawn = np.asarray(cv2.projectPoints(model, turn, place, matrix, undistorted)[0], np.float64).reshape(4, 2)
        error_px = float(np.sqrt(((drawn - seen) ** 2).sum(axis=1).mean()))
        if float(np.asarray(place).ravel()[2]) > 0.0:
            solutions.append((error_px, np.asarray(turn, np.float64), np.asarray(place, np.float64).ravel()))
    if not solutions:
        return None
    solutions.sort(key=lambda solution: solution[0])
    error_px, turn, place = solutions[0]
    body_from_lens = camera.mounting.body_from_lens()
    right, down, ahead = (float(part) for part in place)
    return SquarePose(
        applied(body_from_lens, (right, down, ahead)),
        np.array(body_from_lens) @ np.asarray(cv2.Rodrigues(turn)[0], np.float64),
        error_px,
        _is_ambiguous(solutions),
    )


def _is_ambiguous(solutions: list[tuple[float, Floats, Floats]]) -> bool:
    """Whether two different rotations explain the corners about equally well."""
    if len(solutions) < 2:
        return False
    (best_px, one, _), (second_px, other, _) = solutions
    between = np.asarray(cv2.Rodrigues(one)[0]).T @ np.asarray(cv2.Rodrigues(other)[0])
    apart_rad = float(np.arccos(np.clip((np.trace(between) - 1.0) / 2.0, -1.0, 1.0)))
    return apart_rad > MIN_APART_RAD and best_px > MAX_AMBIGUITY * second_px
