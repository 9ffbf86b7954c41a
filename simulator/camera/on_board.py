"""The cameras of a squad, as the flight knows them: where each looks from, and when it is unplugged. They draw in a
process of their own (`simulator.camera.process`), which is started again if it dies."""

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

from simulator.camera.marks import Mark
from simulator.camera.process import CameraSettings, Settings
from simulator.camera.server import CameraEndpoint, listen
from simulator.camera.shared_poses import make_shared_poses
from simulator.camera.view import Pose
from simulator.failure_modes import Failure, PlannedFailure
from simulator.geodesy import LocalFrame, Place
from simulator.vehicle import Vehicle

AGAIN_S = 1.0
END_WITHIN_S = 3.0

log = logging.getLogger("simulator")


class CameraProcess:
    """The process, and what it is told and says. `start` opens the ports; nothing else in here waits."""

    def __init__(self, endpoints: Sequence[CameraEndpoint], seed: int, marks: list[Mark]) -> None:
        self.endpoints = endpoints
        self.unplug_requests: list[deque[float]] = [deque(maxlen=8) for _ in endpoints]
        """For how many simulated seconds somebody asks a camera to be unplugged; the flight takes them from here."""
        self.plugged = [True] * len(endpoints)
        self._seed = seed
        self._marks = marks
        self._file, self.poses = make_shared_poses(len(endpoints))
        self._process: subprocess.Popen[bytes] | None = None
        self._started_s = 0.0
        self._heard = b""

    def start(self) -> None:
        """Raises OSError if a port cannot be had."""
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
        """Unplugged, the viewers' connections end and the port refuses."""
        if plugged is self.plugged[number]:
            return
        self.plugged[number] = plugged
        log.info("camera %d is %s", number + 1, "back" if plugged else "unplugged")
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):  # it has died, and is told when it is started again
                self._process.stdin.write(f"plug {number} {plugged:d}\n".encode())

    def tend(self) -> None:
        """Hears what the process says, and starts it again if it has died. Call often."""
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
        settings = Settings(self._seed, self._marks, cameras, self._file.fileno())
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
    """Of one vehicle. `stands_at`: north and east of the squad's home, metres, where it was switched on."""

    def __init__(self, process: CameraProcess, number: int, stands_at: tuple[float, float]) -> None:
        self._darkroom = process
        self._number = number
        self._stands_at = stands_at

    def follow(self, vehicle: Vehicle, now_s: float) -> None:
        """After each step of the flight; takes some microseconds."""
        process, number = self._darkroom, self._number
        process.tend()
        unplug_requests = process.unplug_requests[number]
        while unplug_requests:
            vehicle.plan_failure(PlannedFailure(now_s, Failure.CAMERA_UNPLUGGED, now_s + unplug_requests.popleft()))
        process.plug(number, Failure.CAMERA_UNPLUGGED not in vehicle.failures)
        body = vehicle.flight.body
        north_m, east_m = self._stands_at
        quaternion = (body.qw, body.qx, body.qy, body.qz)
        process.poses.write(number, Pose(north_m + body.north_m, east_m + body.east_m, body.alt_m, quaternion), now_s)


class SquadCameras:
    """One for each of the first vehicles, in one world around `home`; the others have none. Raises ValueError."""

    def __init__(
        self, endpoints: Sequence[CameraEndpoint], vehicles: Sequence[Vehicle], home: Place, seed: int
    ) -> None:
        if len(endpoints) > len(vehicles):
            raise ValueError(f"{len(endpoints)} times --camera for {len(vehicles)} vehicles: give one for each at most")
        frame = LocalFrame(home)
        places = [vehicle.settings.flight.place for vehicle in vehicles]
        stands = [frame.to_local(place.lat_deg, place.lon_deg) for place in places]
        marks = [Mark(north, east, str(number)) for number, (north, east) in enumerate(stands, start=1)]
        self._darkroom = CameraProcess(endpoints, seed, marks)
        self._carried = [VehicleCamera(self._darkroom, number, stands[number]) for number in range(len(endpoints))]

    def of(self, number: int) -> VehicleCamera | None:
        """Of the vehicle with that number, from 0."""
        return self._carried[number] if number < len(self._carried) else None

    def lines(self) -> list[str]:
        """What there is, for people."""
        return [f"camera of {name_of(i)}: {endpoint}" for i, endpoint in enumerate(self._darkroom.endpoints)]

    def start(self) -> None:
        """Raises OSError if a port cannot be had."""
        self._darkroom.start()

    def close(self) -> None:
        self._darkroom.close()


def name_of(number: int) -> str:
    return f"vehicle {number + 1}"
