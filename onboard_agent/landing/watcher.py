"""Looks for the landing pad in a process of its own: pictures in, a line for each that shows it."""

from __future__ import annotations

import os
import sys
import threading
from typing import Final

import cv2

from onboard_agent.landing.sighting_line import SightingLine, encode_line
from onboard_agent.vision.camera_model import CameraModel, Mounting
from onboard_agent.vision.cameras.cameras import Cameras
from onboard_agent.vision.landing_pad import PadFinder
from onboard_agent.vision.pad_setting import PadSetting, parse_pad_setting

USUAL_FOV_DEG: Final = 75.0
_NAME: Final = "down"


def camera_model(setting: PadSetting, width_px: int, height_px: int) -> CameraModel:
    """Returns the pinhole that the setting says; straight down if it says nothing."""
    said = dict(setting.camera)
    mounting = Mounting(
        tilt_deg=said.get("tilt", 90.0),
        turn_deg=said.get("turn", 0.0),
        spin_deg=said.get("spin", 0.0),
        forward_m=said.get("forward", 0.0),
        right_m=said.get("right", 0.0),
        down_m=said.get("down", 0.0),
    )
    return CameraModel(width_px, height_px, said.get("fov", USUAL_FOV_DEG), mounting)


def watch(pad: str, camera: str) -> None:
    """Runs until it is killed. Raises Unusable for settings that say nothing; the agent has checked them."""
    setting = parse_pad_setting(pad, camera)
    out = os.dup(1)
    os.dup2(2, 1)  # what a driver prints must not be taken for a line
    cv2.setNumThreads(1)
    came = threading.Event()
    finder: tuple[tuple[int, int], PadFinder] | None = None
    with Cameras.open({_NAME: setting.source}, on_change=came.set) as cameras:
        while True:
            came.wait()
            came.clear()
            frame = cameras.get_frames().get(_NAME)
            if frame is None:
                continue
            height_px, width_px = frame.pixels.shape[:2]
            if finder is None or finder[0] != (width_px, height_px):
                model = camera_model(setting, width_px, height_px)
                finder = ((width_px, height_px), PadFinder(setting.markers, setting.family, model))
            sighting = finder[1].look(frame.pixels)
            message = None if sighting is None else sighting.message(round(frame.taken_s * 1e6))
            if message is not None:
                os.write(out, encode_line(SightingLine(frame.taken_s, message)))
    sys.exit(0)
