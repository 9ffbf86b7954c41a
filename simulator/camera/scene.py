"""Draws what a camera sees: sky, ground, marks, and objects on the ground. A picture depends only on the seed, the pose
and the time; only the land is kept between pictures."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.ground import draw_ground
from simulator.camera.ground_map import GroundMap, ground_map
from simulator.camera.marks import Mark, draw_marks
from simulator.camera.pads import LandingPad, draw_pads
from simulator.camera.sky import draw_sky
from simulator.camera.solids import draw_solids
from simulator.camera.targets import GroundTarget, draw_targets
from simulator.camera.view import FIELD_OF_VIEW_DEG, Pose, View

Picture = npt.NDArray[np.uint8]


class Scene:
    """The world of one squad: the same land and marks for all of its cameras. `light`: 1 is a clear day."""

    def __init__(
        self,
        seed: int,
        marks: list[Mark],
        *,
        pads: Sequence[LandingPad] = (),
        targets: Sequence[GroundTarget] = (),
        light: float = 1.0,
    ) -> None:
        self._seed = seed
        self._marks = marks
        self._pads = list(pads)
        self._targets = list(targets)
        self._light = light
        self._ground: GroundMap | None = None
        self._making = Lock()

    def prepare(self) -> GroundMap:
        """Generates the land once, on the first call: about two seconds. Concurrent callers wait."""
        with self._making:
            if self._ground is None:
                self._ground = ground_map(self._seed)
            return self._ground

    def draw(
        self,
        pose: Pose,
        width: int,
        height: int,
        *,
        tilt_deg: float,
        now_s: float,
        field_of_view_deg: float = FIELD_OF_VIEW_DEG,
    ) -> Picture:
        """Returns blue, green, red. `now_s` moves the clouds."""
        ground = self.prepare()
        view = View(pose, width, height, tilt_deg, field_of_view_deg)
        picture = np.empty((height, width, 3), np.uint8)
        draw_sky(picture, view, self._seed, now_s)
        draw_ground(picture, view, ground)
        draw_marks(picture, view, self._marks)
        draw_pads(picture, view, self._pads)
        draw_targets(picture, view, self._targets)
        draw_solids(picture, view, ground.land)
        if self._light != 1.0:
            picture = np.asarray(cv2.convertScaleAbs(picture, alpha=self._light), np.uint8)
        return picture
