"""The drawing process: all cameras of a squad, separate from the flight, whose clock must not wait for pictures.

`python -m simulator.camera.process SETTINGS`, with SETTINGS from `Settings.to_json`. It reads lines from its standard
input (`plug NUMBER 1`, `plug NUMBER 0`), writes viewers' requests to its standard output (`unplug NUMBER SECONDS`), and
exits when its standard input closes.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import socket
import sys
import threading
from dataclasses import asdict, dataclass
from functools import partial

from simulator.camera.marks import Mark
from simulator.camera.pads import LandingPad, PadMarker
from simulator.camera.scene import Scene
from simulator.camera.server import Camera, CameraEndpoint
from simulator.camera.shared_poses import SharedPoses
from simulator.camera.targets import GroundTarget


@dataclass(frozen=True, slots=True)
class CameraSettings:
    host: str
    port: int
    name: str
    listener_fd: int | None
    """The already opened port; None: it must be opened."""
    plugged: bool


@dataclass(frozen=True, slots=True)
class Settings:
    seed: int
    marks: list[Mark]
    cameras: list[CameraSettings]
    poses_fd: int
    pads: list[LandingPad]
    targets: list[GroundTarget]
    light: float

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Settings:
        read = json.loads(text)
        marks = [Mark(**mark) for mark in read["marks"]]
        cameras = [CameraSettings(**one) for one in read["cameras"]]
        pads = [
            LandingPad(**{**pad, "markers": tuple(PadMarker(**one) for one in pad["markers"])}) for pad in read["pads"]
        ]
        targets = [GroundTarget(**one) for one in read["targets"]]
        return cls(read["seed"], marks, cameras, read["poses_fd"], pads, targets, read["light"])


def say_unplug(number: int, seconds: float) -> None:
    os.write(sys.stdout.fileno(), f"unplug {number} {seconds:g}\n".encode())


def make_camera(settings: Settings, number: int, scene: Scene, poses: SharedPoses) -> Camera:
    one = settings.cameras[number]
    listener = socket.socket(fileno=one.listener_fd) if one.listener_fd is not None else None
    camera = Camera(
        CameraEndpoint(one.host, one.port),
        one.name,
        scene,
        sight=partial(poses.read, number),
        on_unplug=partial(say_unplug, number),
    )
    camera.plug(one.plugged)
    camera.start(listener)
    return camera


def main() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the flight, which ends this process
    logging.basicConfig(level=logging.INFO, format="tower-sim: %(message)s")
    settings = Settings.from_json(sys.argv[1])
    poses = SharedPoses(settings.poses_fd, len(settings.cameras))
    scene = Scene(settings.seed, settings.marks, pads=settings.pads, targets=settings.targets, light=settings.light)
    cameras = [make_camera(settings, number, scene, poses) for number in range(len(settings.cameras))]
    # So that the first viewer does not have to wait for it.
    threading.Thread(target=scene.prepare, name="land", daemon=True).start()
    for line in sys.stdin:
        match line.split():
            case ["plug", number, plugged]:
                cameras[int(number)].plug(plugged == "1")
    for camera in cameras:
        camera.close()
    os._exit(0)  # a viewer's thread that still draws must not be torn down under OpenCV


if __name__ == "__main__":
    main()
