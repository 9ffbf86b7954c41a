"""The pose of a camera, and the projection of the world's points into its picture. Pure geometry.

World axes are north, east, down (metres) from the squad's home; the ground is flat at down = 0. Picture axes are right
and down from the centre of the top left pixel.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Box = tuple[int, int, int, int]
"""Left, top, right, bottom; the last two are exclusive."""

FIELD_OF_VIEW_DEG = 75.0
"""Horizontal."""
EYE_HEIGHT_M = 0.25
"""The lens above the feet of the landing gear."""
LEAN_IN_A_BOX_PX = 40.0
MAX_BOXES = 8


@dataclass(frozen=True, slots=True)
class Pose:
    """The pose of a vehicle. `height_m`: above ground; the quaternion rotates body axes (forward, right, down) into
    world axes."""

    north_m: float
    east_m: float
    height_m: float
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def rotation(self) -> Floats:
        w, x, y, z = self.quaternion
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )


def pose_of(north_m: float, east_m: float, height_m: float, roll: float, pitch: float, yaw: float) -> Pose:
    """Converts angles in degrees."""
    cr, cp, cy = (math.cos(math.radians(a) / 2) for a in (roll, pitch, yaw))
    sr, sp, sy = (math.sin(math.radians(a) / 2) for a in (roll, pitch, yaw))
    quaternion = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    return Pose(north_m, east_m, height_m, quaternion)


class View:
    """One picture's geometry: `width` x `height` pixels, the camera tilted down from forward by `tilt_deg`.
    `field_of_view_deg`: horizontal."""

    def __init__(
        self, pose: Pose, width: int, height: int, tilt_deg: float, field_of_view_deg: float = FIELD_OF_VIEW_DEG
    ) -> None:
        self.width, self.height = width, height
        self.focal_px = width / 2.0 / math.tan(math.radians(field_of_view_deg) / 2.0)
        self.eye = np.array([pose.north_m, pose.east_m, -max(pose.height_m, 0.0) - EYE_HEIGHT_M])
        self.eye_height_m = -float(self.eye[2])
        s, c = math.sin(math.radians(tilt_deg)), math.cos(math.radians(tilt_deg))
        mount = np.array([[0.0, -s, c], [1.0, 0.0, 0.0], [0.0, c, s]])
        self.turned = pose.rotation() @ mount
        """From lens axes (right, down, ahead) to world axes."""
        f, cx, cy = self.focal_px, (width - 1) / 2.0, (height - 1) / 2.0
        self.rays = self.turned @ np.array([[1 / f, 0.0, -cx / f], [0.0, 1 / f, -cy / f], [0.0, 0.0, 1.0]])
        """From a pixel (x, y, 1) to the ray through it, one metre ahead."""
        self.middle = np.array([cx, cy])
        self.dip = self.rays[2]
        """Dip of the ray through a pixel, linear in x and y: above 0 it meets the ground, `eye_height_m / dip`
        ahead."""

    def plane_to_texture(self, height_m: float, texel_m: float, middle_px: float) -> Floats:
        """Returns the transformation from pixels to a map's pixels, for a plane at this height above ground: `texel_m`
        per pixel, north up, the world's origin at `middle_px` in both directions."""
        north, east, down = self.rays
        rise_m = -height_m - self.eye[2]
        u = (rise_m * east + self.eye[1] * down) / texel_m + middle_px * down
        v = -(rise_m * north + self.eye[0] * down) / texel_m + middle_px * down
        return np.array([u, v, down])

    def to_lens(self, points: Floats) -> Floats:
        """Converts world points (..., 3) to lens axes."""
        return np.asarray((points - self.eye) @ self.turned)

    def to_pixels(self, lens_points: Floats) -> Floats:
        """Projects points (..., 3) in lens axes, all of them ahead, to pixels (..., 2)."""
        return np.asarray(lens_points[..., :2] / lens_points[..., 2:] * self.focal_px + self.middle)

    def boxes_where(self, dip_from: float, dip_to: float) -> list[Box]:
        """Returns adjacent boxes that contain all pixels with a dip between the two, and few others: the steeper the
        horizon, the narrower the boxes."""
        lean_px = min(abs(self.dip[0] / self.dip[1]) if self.dip[1] else math.inf, 10.0) * self.width
        count = min(max(math.ceil(lean_px / LEAN_IN_A_BOX_PX), 1), MAX_BOXES)
        edges = [round(i * self.width / count) for i in range(count + 1)]
        boxes = (self._box(dip_from, dip_to, *pair) for pair in itertools.pairwise(edges))
        return [box for box in boxes if box is not None]

    def _box(self, dip_from: float, dip_to: float, left_px: int, right_px: int) -> Box | None:
        """Returns the smallest box between two columns; None if there are no such pixels."""
        left, right, bottom = float(left_px), right_px - 1.0, self.height - 1.0
        corners = np.array([[left, 0.0], [right, 0.0], [right, bottom], [left, bottom]])
        a, b, c = self.dip
        kept = cut(corners, (a, b), dip_from - c)
        kept = cut(kept, (-a, -b), c - dip_to)
        if len(kept) == 0:
            return None
        (west, north), (east, south) = kept.min(axis=0), kept.max(axis=0)
        return (
            math.floor(west),
            math.floor(north),
            min(math.ceil(east) + 1, right_px),
            min(math.ceil(south) + 1, self.height),
        )


def cut(polygon: Floats, normal: tuple[float, ...], least: float) -> Floats:
    """Returns the part of a convex polygon (n, k) with `point . normal >= least`; an empty array if there is none."""
    heights = polygon @ np.array(normal) - least
    if (heights >= 0.0).all():
        return polygon
    kept = []
    for i in range(len(polygon)):
        here, there = heights[i - 1], heights[i]
        if (here < 0.0) != (there < 0.0):
            kept.append(polygon[i - 1] + (polygon[i] - polygon[i - 1]) * (here / (here - there)))
        if there >= 0.0:
            kept.append(polygon[i])
    return np.array(kept).reshape(-1, polygon.shape[1])


def dips(view: View, box: Box) -> npt.NDArray[np.float32]:
    """Returns the dip of each pixel of a box."""
    left, top, right, bottom = box
    a, b, c = view.dip
    across = (a * np.arange(left, right) + c).astype(np.float32)
    along = (b * np.arange(top, bottom)).astype(np.float32)
    return np.asarray(along[:, None] + across[None, :])


def shifted(matrix: Floats, box: Box) -> Floats:
    """Returns the same transformation, from pixels of a box."""
    left, top, _, _ = box
    return np.asarray(matrix @ np.array([[1.0, 0.0, left], [0.0, 1.0, top], [0.0, 0.0, 1.0]]))
