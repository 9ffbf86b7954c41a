"""The asyncio shell: advances the vehicles' clocks and carries their bytes. Contains no autopilot logic."""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from simulator.flight_constants import TICK_S
from simulator.links import Endpoint, Link, open_link
from simulator.squad import step_together
from simulator.vehicle import Vehicle
from simulator.vehicle_ports import VehiclePort

if TYPE_CHECKING:
    from simulator.camera.on_board import SquadCameras, VehicleCamera
    from simulator.shell_socket import ShellSocket
    from simulator.vehicle_csv import FlightLogs

BEHIND_MAX_S = 0.25
"""Wall time by which the simulation may lag before it stops catching up and runs late instead."""
LATE_REPORT_S = 10.0

log = logging.getLogger("simulator")


@dataclass(slots=True)
class VehicleSlot:
    """A vehicle and its links."""

    vehicle: Vehicle
    link: Link
    camera: VehicleCamera | None = None
    ports: list[tuple[VehiclePort, Link]] = field(default_factory=list)


class Clock:
    """Simulated seconds, `speed` times as fast as the loop's own clock."""

    def __init__(self, speed: float) -> None:
        self.speed = speed
        self._loop = asyncio.get_running_loop()
        self._origin_s = self._loop.time()

    def now_s(self) -> float:
        return (self._loop.time() - self._origin_s) * self.speed

    def fall_back(self, simulated_s: float) -> None:
        """Pretends that less time has passed."""
        self._origin_s += simulated_s / self.speed


async def fly(
    vehicles: list[Vehicle],
    endpoints: list[Endpoint],
    speed: float,
    cameras: SquadCameras | None = None,
    ports: Sequence[tuple[VehiclePort, Endpoint]] = (),
    terminals: ShellSocket | None = None,
    logs: FlightLogs | None = None,
) -> None:
    """Runs until SIGINT or SIGTERM. `ports`: one each for as many vehicles, in their order."""
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    clock = Clock(speed)
    berths: list[VehicleSlot] = []
    try:
        if cameras is not None:
            cameras.start()
        for index, (vehicle, endpoint) in enumerate(zip(vehicles, endpoints, strict=True)):
            camera = cameras.of(index) if cameras is not None else None
            berths.append(VehicleSlot(vehicle, await _berth(vehicle, endpoint, clock), camera))
        for slot, (port, endpoint) in zip(berths, ports, strict=False):
            slot.ports.append((port, await open_link(endpoint, port.receive)))
        if terminals is not None:
            await terminals.open()
        await _keep_time(berths, clock, stop, terminals, logs)
    finally:
        if logs is not None:
            logs.close()
        if terminals is not None:
            terminals.close()
        for berth in berths:
            berth.link.close()
            for _, link in berth.ports:
                link.close()
        if cameras is not None:
            cameras.close()


async def _berth(vehicle: Vehicle, endpoint: Endpoint, clock: Clock) -> Link:
    return await open_link(endpoint, lambda data: vehicle.receive(data, clock.now_s()))


async def _keep_time(
    berths: list[VehicleSlot],
    clock: Clock,
    stop: asyncio.Event,
    terminals: ShellSocket | None,
    logs: FlightLogs | None,
) -> None:
    loop, vehicles = asyncio.get_running_loop(), [berth.vehicle for berth in berths]
    next_s, stepped_s, late_s, report_s = loop.time(), 0.0, 0.0, loop.time() + LATE_REPORT_S
    while not stop.is_set():
        behind_s = clock.now_s() - stepped_s - BEHIND_MAX_S * clock.speed
        if behind_s > 0.0:
            clock.fall_back(behind_s)
            late_s += behind_s
        stepped_s = clock.now_s()
        for berth in berths:
            for port, link in berth.ports:
                if answers := port.step(stepped_s):
                    link.send([answers])
        step_together(vehicles, stepped_s)
        for berth in berths:
            frames = berth.vehicle.datagrams_to_send()
            if frames:
                berth.link.send(frames)
            if berth.camera is not None:
                berth.camera.follow(berth.vehicle, stepped_s)
        if terminals is not None:
            terminals.step()
        if logs is not None:
            logs.step()
        if loop.time() >= report_s:
            if late_s > 0.0:
                log.warning("this machine is too slow: %.1f simulated seconds lost", late_s)
            late_s, report_s = 0.0, loop.time() + LATE_REPORT_S
        next_s = max(next_s + TICK_S, loop.time())
        await asyncio.sleep(next_s - loop.time())
