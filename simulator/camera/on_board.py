"""The cameras of a squad, as seen by the flight: their poses, and when each is unplugged. They draw in a separate
process (`simulator.camera.process`), which is restarted if it dies."""

from __future__ import annotations

import logging
import os
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from simulator.camera.marks import Mark
from simulator.camera.pads import LandingPad, parse_pad
from simulator.camera.process import CameraSettings, Settings
from simulator.camera.server import CameraEndpoint, listen
from simulator.camera.shared_poses import make_shared_poses
from simulator.camera.targets import GroundTarget, parse_target
from simulator.camera.view import Pose
from simulator.failure_modes import Failure, PlannedFailure
from simulator.geodesy import LocalFrame, Place
from simulator.vehicle import Vehicle

AGAIN_S = 1.0
END_WITHIN_S = 3.0

log = logging.getLogger("simulator")


@dataclass(frozen=True, slots=True)
class Pictured:
    """What else is in the pictures. `pads`: as `parse_pad` reads them; `targets`: as `parse_target` does; `light`: 1 is
    a clear day."""

    pads: Sequence[str] = ()
    targets: Sequence[str] = ()
    light: float = 1.0


NOTHING_MORE: Final = Pictured()


class CameraProcess:
    """The process, its input and its output. `start` opens the ports; nothing else here blocks."""

    def __init__(
        self,
        endpoints: Sequence[CameraEndpoint],
        seed: int,
        marks: list[Mark],
        *,
        pads: list[LandingPad],
        targets: list[GroundTarget],
        light: float,
    ) -> None:
        self.endpoints = endpoints
        self.unplug_requests: list[deque[float]] = [deque(maxlen=8) for _ in endpoints]
        """Requests to unplug a camera, in simulated seconds; the flight takes them from here."""
        self.plugged = [True] * len(endpoints)
        self._seed = seed
        self._marks = marks
        self._pads = pads
        self._targets = targets
        self._light = light
        self._file, self.poses = make_shared_poses(len(endpoints))
        self._process: subprocess.Popen[bytes] | None = None
        self._started_s = 0.0
        self._heard = b""

    def start(self) -> None:
        """Raises OSError if a port is not available."""
        listeners: list[socket.socket] = []
        try:
            for endpoint in self.endpoints:
                listeners.append(listen(endpoint))  # noqa: PERF401 - those before one that fails are closed
            self._spawn([listener.fileno() for listener in listeners])
        finally:
            for listener in listeners:
                listener.close()

    def close(self) -> None:
        process = self._process
        if process is not None:
            self._process = None
            assert process.stdin is not None and process.stdout is not None
            process.stdin.close()
            try:
                process.wait(END_WITHIN_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            process.stdout.close()
        self.poses.close()
        self._file.close()

    def plug(self, number: int, plugged: bool) -> None:
        """Unplugging closes the viewers' connections, and the port refuses new ones."""
        if plugged is self.plugged[number]:
            return
        self.plugged[number] = plugged
        log.info("camera %d is %s", number + 1, "back" if plugged else "unplugged")
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):  # it has died; its restart passes on the state
                self._process.stdin.write(f"plug {number} {plugged:d}\n".encode())

    def tend(self) -> None:
        """Reads the output of the process, and restarts it if it has died. Call often."""
        process = self._process
        if process is None or process.stdout is None:
            return
        try:
            said = os.read(process.stdout.fileno(), 4096)
        except BlockingIOError:
            return
        if said:
            self._receive(said)
        elif time.monotonic() - self._started_s > AGAIN_S and process.poll() is not None:
            log.error("the process of the cameras has ended (%s) and is started again", process.returncode)
            assert process.stdin is not None
            process.stdout.close()
            process.stdin.close()
            self._spawn([])

    def _receive(self, said: bytes) -> None:
        *lines, self._heard = (self._heard + said).split(b"\n")
        for line in lines:
            match line.decode().split():
                case ["unplug", number, seconds]:
                    self.unplug_requests[int(number)].append(float(seconds))

    def _spawn(self, listener_fds: list[int]) -> None:
        cameras = [
            CameraSettings(
                endpoint.host,
                endpoint.port,
                name_of(number),
                listener_fds[number] if listener_fds else None,
                self.plugged[number],
            )
            for number, endpoint in enumerate(self.endpoints)
        ]
        settings = Settings(
            self._seed, self._marks, cameras, self._file.fileno(), self._pads, self._targets, self._light
        )
        self._started_s = time.monotonic()
        self._heard = b""
        self._process = subprocess.Popen(  # noqa: S603 - ourselves
            [sys.executable, "-m", "simulator.camera.process", settings.to_json()],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pass_fds=[*listener_fds, settings.poses_fd],
            bufsize=0,
        )
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)


class VehicleCamera:
    """The camera of one vehicle. `stands_at`: metres north and east of the squad's home, at power-on."""

    def __init__(self, process: CameraProcess, number: int, stands_at: tuple[float, float]) -> None:
        self._darkroom = process
        self._number = number
        self._stands_at = stands_at

    def follow(self, vehicle: Vehicle, now_s: float) -> None:
        """Call after each step of the flight; takes some microseconds."""
        process, number = self._darkroom, self._number
        process.tend()
        unplug_requests = process.unplug_requests[number]
        while unplug_requests:
            vehicle.plan_failure(PlannedFailure(now_s, Failure.CAMERA_UNPLUGGED, now_s + unplug_requests.popleft()))
        process.plug(number, Failure.CAMERA_UNPLUGGED not in vehicle.failures)
        body = vehicle.flight.body
        north_m, east_m, height_m, quaternion = body.true_pose
        # The picture's land is flat: as far below the camera as the ground right under it.
        height_m -= body.ground_m()
        north_m, east_m = north_m + self._stands_at[0], east_m + self._stands_at[1]
        process.poses.write(number, Pose(north_m, east_m, height_m, quaternion), now_s)


class SquadCameras:
    """One for each of the first vehicles, in one world around `home`; the others have none. Raises ValueError."""

    def __init__(
        self,
        endpoints: Sequence[CameraEndpoint],
        vehicles: Sequence[Vehicle],
        home: Place,
        seed: int,
        pictured: Pictured = NOTHING_MORE,
    ) -> None:
        if len(endpoints) > len(vehicles):
            raise ValueError(f"{len(endpoints)} times --camera for {len(vehicles)} vehicles: give one for each at most")
        frame = LocalFrame(home)
        places = [vehicle.settings.flight.place for vehicle in vehicles]
        stands = [frame.to_local(place.lat_deg, place.lon_deg) for place in places]
        marks = [Mark(north, east, str(number)) for number, (north, east) in enumerate(stands, start=1)]
        on_ground = []
        for number, text in enumerate(pictured.targets, start=seed):
            letter, lat_deg, lon_deg, heading_deg, side_m, colour = parse_target(text)
            local = frame.to_local(lat_deg, lon_deg)
            on_ground.append(GroundTarget(letter, *local, heading_deg, side_m, number, colour))
        pads = [_pad(text, frame) for text in pictured.pads]
        self._darkroom = CameraProcess(endpoints, seed, marks, pads=pads, targets=on_ground, light=pictured.light)
        self._carried = [VehicleCamera(self._darkroom, number, stands[number]) for number in range(len(endpoints))]

    def of(self, number: int) -> VehicleCamera | None:
        """Returns the camera of the vehicle with this number, from 0."""
        return self._carried[number] if number < len(self._carried) else None

    def lines(self) -> list[str]:
        """Describes the cameras, for people."""
        return [f"camera of {name_of(i)}: {endpoint}" for i, endpoint in enumerate(self._darkroom.endpoints)]

    def start(self) -> None:
        """Raises OSError if a port is not available."""
        self._darkroom.start()

    def close(self) -> None:
        self._darkroom.close()


def _pad(text: str, frame: LocalFrame) -> LandingPad:
    lat_deg, lon_deg, heading_deg = parse_pad(text)
    return LandingPad(*frame.to_local(lat_deg, lon_deg), heading_deg)


def name_of(number: int) -> str:
    return f"vehicle {number + 1}"
