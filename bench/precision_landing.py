"""Precision landing: 20 landings of the simulator in wind on a pad that a camera looks for. Its pictures are drawn from
the drone's true pose at the camera's rate, the real detector finds the pad, and LANDING_TARGET goes the agent's way.

The same landings without a target stand beside it. `--seed N` makes other ones, `--rounds N` another number;
`--autopilot PATH` flies them with a real ArduCopter in its own simulator.
"""

from __future__ import annotations

import argparse
import math
import random
import time
from collections import deque
from dataclasses import dataclass, field

import cv2
import numpy as np

from bench.rows import Report
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.landing.target_sender import TargetSender
from onboard_agent.vision.camera_model import CameraModel, Mounting
from onboard_agent.vision.landing_pad import PadFinder
from onboard_agent.vision.landing_target import LandingTarget
from onboard_agent.vision.pad_setting import PadMarker
from simulator.camera.pads import LandingPad
from simulator.camera.scene import Scene
from simulator.camera.view import Pose
from simulator.dialect import Codec, mavlink
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.modes import Mode
from simulator.vehicle import Vehicle, VehicleSettings

LANDINGS = 20
WANTED_M = 0.3
WIDTH_PX, HEIGHT_PX = 640, 480
CAMERA_HZ = 5.0
STEP_S = 0.02
HEIGHT_M = 12.0
MAX_BESIDE_M = 3.0
"""Where LAND is commanded, to the side of the pad."""
MIN_WIND_MPS, MAX_WIND_MPS = 3.0, 8.0
"""At 10 m above the ground."""
FIELD_OF_VIEW_DEG = 100.0
"""A wide lens: it sees the pad from the side of a drone that leans against the wind."""
DETECTING_S = 0.06
"""From the picture to its sighting, as on a small computer."""
HOME = Place(47.397742, 8.545594, 488.0)
MAX_FLIGHT_S = 240.0
NOISE = 6.0
"""Standard deviation of each pixel, of 255."""
PARAMETERS = (("PLND_TYPE", 1.0), ("PLND_LAG", 0.1))


@dataclass
class Landing:
    """`beside_m`: where it came down, from the pad. `from_m`: where LAND was commanded."""

    beside_m: float
    from_m: float
    wind_mps: float
    height_last_seen_m: float = math.nan
    pictures: int = 0
    found: int = 0
    sent: int = 0
    look_ms: list[float] = field(default_factory=list)


class Eyes:
    """Camera, detector and sender: what the agent has on board."""

    def __init__(self, pad: LandingPad, seed: int) -> None:
        self._scene = Scene(1, [], pads=[pad])
        self._scene.prepare()
        cv2.setRNGSeed(seed)
        # Pictures are drawn from straight above the vehicle's place however it leans, so the lens is that place.
        camera = CameraModel(WIDTH_PX, HEIGHT_PX, FIELD_OF_VIEW_DEG, Mounting(tilt_deg=90.0))
        markers = [PadMarker(one.number, one.side_m, one.right_m, one.up_m) for one in pad.markers]
        self._finder = PadFinder(markers, "aruco-4x4-50", camera)
        self.sender = TargetSender(FrameMaker())
        self._waiting: deque[tuple[float, float, LandingTarget]] = deque()
        self._next_s = 0.0

    def tick(self, pose: Pose, now_s: float, landing: Landing) -> list[bytes]:
        """Returns the frames for the autopilot, with the camera's rate and the detector's time by the given clock."""
        if now_s >= self._next_s:
            self._next_s = now_s + 1.0 / CAMERA_HZ
            target = self.look(pose, now_s, landing)
            if target is not None:
                self._waiting.append((now_s + DETECTING_S, now_s, target))
        while self._waiting and self._waiting[0][0] <= now_s:
            _, taken_s, target = self._waiting.popleft()
            self.sender.saw(target, taken_s)
        frames = self.sender.due(1, now_s)
        landing.sent += len(frames)
        return frames

    def look(self, pose: Pose, taken_s: float, landing: Landing) -> LandingTarget | None:
        """Takes a picture and looks for the pad in it."""
        picture = self._scene.draw(
            pose, WIDTH_PX, HEIGHT_PX, tilt_deg=90.0, now_s=taken_s, field_of_view_deg=FIELD_OF_VIEW_DEG
        )
        noise = cv2.randn(np.empty(picture.shape, np.int16), np.zeros(3), np.full(3, NOISE))
        noisy = np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), np.uint8)
        began = time.thread_time()
        sighting = self._finder.look(noisy)
        landing.look_ms.append((time.thread_time() - began) * 1e3)
        landing.pictures += 1
        target = None if sighting is None else sighting.message(round(taken_s * 1e6))
        if target is not None:
            landing.found += 1
            landing.height_last_seen_m = pose.height_m
        return target


class Station:
    """A vehicle and its clock."""

    def __init__(self, settings: VehicleSettings) -> None:
        self.vehicle = Vehicle(settings)
        self.now_s = 0.0
        self._codec = Codec(255, 190)

    def say(self, number: int, *params: float) -> None:
        seven = (*params, *([0.0] * (7 - len(params))))
        frame = self._codec.encode(mavlink.MAVLink_command_long_message(1, 1, number, 0, *seven))
        self.vehicle.receive(frame, self.now_s)

    def step(self) -> None:
        self.now_s = round(self.now_s + STEP_S, 6)
        self.vehicle.step(self.now_s)
        self.vehicle.datagrams_to_send()

    def run(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self.step()


def land_once(seed: int, number: int, *, with_target: bool) -> Landing:
    """Flies one landing. Everything follows from seed and number."""
    source = random.Random(f"{seed} {number}")
    wind_mps = source.uniform(MIN_WIND_MPS, MAX_WIND_MPS)
    flight = FlightSettings(
        HOME,
        boot_s=0.5,
        heading_deg=source.uniform(0.0, 360.0),
        wind_mps=wind_mps,
        wind_from_deg=source.uniform(0.0, 360.0),
        seed=source.randrange(1, 1 << 30),
    )
    beside_m, towards = MAX_BESIDE_M * math.sqrt(source.random()), source.uniform(0.0, math.tau)
    # Away from the origin of the world, so that nothing lands right by standing where it started.
    pad = LandingPad(20.0 + source.uniform(-5, 5), -15.0 + source.uniform(-5, 5), source.uniform(0.0, 360.0))
    station = Station(VehicleSettings(flight, parameters=PARAMETERS))
    vehicle = station.vehicle
    station.run(3.0)
    station.say(mavlink.MAV_CMD_DO_SET_MODE, 1, int(Mode.GUIDED))
    station.say(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    station.run(1.0)
    station.say(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HEIGHT_M)
    station.run(15.0)
    body = vehicle.flight.body
    north_m, east_m = pad.north_m + beside_m * math.cos(towards), pad.east_m + beside_m * math.sin(towards)
    place = vehicle.flight.origin.to_place(north_m, east_m, 0.0)
    go = mavlink.MAVLink_command_int_message(
        1, 1, 6, mavlink.MAV_CMD_DO_REPOSITION, 0, 0, -1, 1, 0, math.nan, *_e7(place), HEIGHT_M
    )
    vehicle.receive(Codec(255, 190).encode(go), station.now_s)
    station.run(25.0)
    landing = Landing(math.nan, math.hypot(body.north_m - pad.north_m, body.east_m - pad.east_m), wind_mps)
    station.say(mavlink.MAV_CMD_DO_SET_MODE, 1, int(Mode.LAND))
    eyes = Eyes(pad, number + 1) if with_target else None
    until_s = station.now_s + MAX_FLIGHT_S
    while vehicle.flight.armed or station.now_s < until_s - MAX_FLIGHT_S + 1.0:
        if station.now_s > until_s:
            raise RuntimeError(f"landing {number} of seed {seed} never ended")
        station.step()
        for frame in eyes.tick(Pose(*body.true_pose), station.now_s, landing) if eyes is not None else ():
            vehicle.receive(frame, station.now_s)
    north_m, east_m, _, _ = body.true_pose
    landing.beside_m = math.hypot(north_m - pad.north_m, east_m - pad.east_m)
    return landing


def _e7(place: Place) -> tuple[int, int]:
    return round(place.lat_deg * 1e7), round(place.lon_deg * 1e7)


async def run(report: Report, options: argparse.Namespace) -> None:
    cv2.setNumThreads(1)  # what one core of the companion computer does
    count = options.rounds or (3 if options.quick else LANDINGS)
    if options.autopilot is not None:
        from bench.precision_landing_real import land_all

        flown = await land_all(options.autopilot, options.seed, count)
        add_rows(report, f"a real ArduCopter, {count} landings of seed {options.seed}", flown, with_target=True)
        return
    for case, with_target in (("with the pad's target", True), ("the same without", False)):
        landings = [land_once(options.seed, number, with_target=with_target) for number in range(count)]
        add_rows(report, f"{case}, {count} landings of seed {options.seed}", landings, with_target=with_target)


def add_rows(report: Report, case: str, landings: list[Landing], *, with_target: bool) -> None:
    """Adds the figures of these landings."""
    report.add(case, "landings", len(landings), "count")
    report.add(case, f"within_{WANTED_M:g}_m", sum(one.beside_m <= WANTED_M for one in landings), "count")
    report.spread(case, "beside_the_pad", [one.beside_m for one in landings], "m")
    report.spread(case, "land_commanded_beside", [one.from_m for one in landings], "m")
    report.spread(case, "wind", [one.wind_mps for one in landings], "m/s")
    if not with_target:
        return
    pictures = sum(one.pictures for one in landings)
    report.add(case, "pictures", pictures, "count")
    report.add(case, "pad_found", sum(one.found for one in landings) / max(pictures, 1), "share")
    report.spread(case, "height_last_seen", [one.height_last_seen_m for one in landings], "m")
    report.spread(case, "detector_time", [ms for one in landings for ms in one.look_ms], "ms")
