"""A recording of a RealSense camera, made by the library from frames of our own: a slope in depth, a grey level for
each frame."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pyrealsense2 as rs

WIDTH_PX, HEIGHT_PX, RATE_HZ = 64, 48, 30
FRAMES = 15
COUNT_M = 0.0005
"""One count of depth, half of what the agent gives."""


def depth_counts(number: int) -> np.ndarray[Any, np.dtype[np.uint16]]:
    """2 m at the left, 50 counts more each column; unknown in the upper row; `number` is in the lower left corner."""
    counts = np.tile(4000 + 50 * np.arange(WIDTH_PX, dtype=np.uint16), (HEIGHT_PX, 1))
    counts[0] = 0
    counts[-1, 0] = 2 * (number + 1)
    return counts


def colour_pixels(number: int) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Red, green, blue."""
    return np.full((HEIGHT_PX, WIDTH_PX, 3), (200, 10 * number, 30), np.uint8)


def infrared_pixels(number: int) -> np.ndarray[Any, np.dtype[np.uint8]]:
    return np.full((HEIGHT_PX, WIDTH_PX), 100 + number, np.uint8)


def record(path: Path) -> None:
    """Colour (RGB), infrared and depth; the lens for colour is 20 mm right of the one for depth."""
    device = rs.software_device()
    device.register_info(rs.camera_info.name, "Made by a test")
    device.register_info(rs.camera_info.serial_number, "123456789")
    stereo, colour = device.add_sensor("Stereo Module"), device.add_sensor("RGB Camera")
    profiles = [
        stereo.add_video_stream(_stream(rs.stream.depth, 0, 1, rs.format.z16, 2)),
        stereo.add_video_stream(_stream(rs.stream.infrared, 1, 2, rs.format.y8, 1)),
        colour.add_video_stream(_stream(rs.stream.color, 0, 3, rs.format.rgb8, 3)),
    ]
    stereo.add_read_only_option(rs.option.depth_units, COUNT_M)
    between = rs.extrinsics()
    between.rotation, between.translation = [1, 0, 0, 0, 1, 0, 0, 0, 1], [-0.02, 0, 0]
    profiles[0].register_extrinsics_to(profiles[2], between)
    recorder = rs.recorder(str(path), device)
    taken = rs.frame_queue(3 * FRAMES)
    sensors = recorder.query_sensors()
    sensors[0].open(profiles[:2])
    sensors[1].open(profiles[2])
    for sensor in sensors:
        sensor.start(taken)
    began_ms = time.time() * 1000
    for number in range(FRAMES):
        at_ms = began_ms + number * 1000 / RATE_HZ
        parts: list[tuple[Any, np.ndarray[Any, Any]]] = [
            (stereo, depth_counts(number)),
            (stereo, infrared_pixels(number)),
            (colour, colour_pixels(number)),
        ]
        for profile, (sensor, pixels) in zip(profiles, parts, strict=True):
            sensor.on_video_frame(_frame(pixels, profile, number, at_ms))
        for _ in range(3):  # the recorder writes what was taken
            taken.wait_for_frame(5000)
    for sensor in sensors:
        sensor.stop()
        sensor.close()


def _stream(kind: Any, index: int, uid: int, pixels: Any, bytes_per_pixel: int) -> Any:
    lens = rs.intrinsics()
    lens.width, lens.height, lens.model = WIDTH_PX, HEIGHT_PX, rs.distortion.brown_conrady
    lens.ppx, lens.ppy, lens.fx, lens.fy = WIDTH_PX / 2, HEIGHT_PX / 2, WIDTH_PX, WIDTH_PX
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid, stream.fmt, stream.bpp = kind, index, uid, pixels, bytes_per_pixel
    stream.width, stream.height, stream.fps, stream.intrinsics = WIDTH_PX, HEIGHT_PX, RATE_HZ, lens
    return stream


def _frame(pixels: np.ndarray[Any, Any], profile: Any, number: int, at_ms: float) -> Any:
    frame = rs.software_video_frame()
    frame.pixels, frame.stride, frame.bpp = pixels, pixels.strides[0], pixels.strides[1]
    frame.timestamp, frame.domain, frame.frame_number = at_ms, rs.timestamp_domain.hardware_clock, number
    frame.profile = profile.as_video_stream_profile()
    if pixels.dtype == np.uint16:
        frame.depth_units = COUNT_M
    return frame
