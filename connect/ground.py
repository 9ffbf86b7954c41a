"""The local programs of one `tower connect`, and the drones that they see. No I/O of its own.

One drone passes unchanged. Several get systems of their own, 1, 2, 3 as they were named: autopilots come with the same
id, and a ground station takes two drones of one id for one. Frames are then sent under that id, and what a program
addresses to it goes to its drone alone, under the id that its autopilot has.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Final

from connect.endpoints import Endpoint
from wire.frame_stream import FrameStream
from wire.frames import source
from wire.ids import DroneId
from wire.own_system import target_system
from wire.readdressing import readdressed

MAX_PROGRAMS: Final = 32
"""Whose half frames are kept at a time."""

Received = Callable[[Hashable, bytes], None]
Gone = Callable[[Hashable], None]


class Ground:
    """`drones`: in the order of their systems."""

    def __init__(self, endpoints: Sequence[Endpoint], drones: Sequence[DroneId]) -> None:
        self._endpoints = endpoints
        self._system_of = {drone_id: number for number, drone_id in enumerate(drones, 1)} if len(drones) > 1 else {}
        self._own_system_of: dict[DroneId, int] = {}
        """As its autopilot has it."""
        self._streams: dict[Hashable, FrameStream] = {}
        self._received: dict[DroneId, Received] = {}
        self._gone: list[Gone] = []

    @property
    def places(self) -> str:
        return ", ".join(endpoint.name for endpoint in self._endpoints)

    def system_of(self, drone_id: DroneId) -> int | None:
        """None: that of its autopilot."""
        return self._system_of.get(drone_id)

    async def open(self) -> None:
        """Raises Unusable if an address is not available."""
        for endpoint in self._endpoints:
            await endpoint.open(self.from_program, self._program_gone)

    def close(self) -> None:
        for endpoint in self._endpoints:
            endpoint.close()

    def attach(self, drone_id: DroneId, received: Received, gone: Gone) -> None:
        """`received` gets what programs send to this drone."""
        self._received[drone_id] = received
        self._gone.append(gone)

    def send(self, drone_id: DroneId, frames: list[bytes]) -> None:
        """Sends frames of a drone to every program."""
        if (system := self._system_of.get(drone_id)) is not None:
            self._own_system_of[drone_id] = source(frames[0])[0]
            frames = [readdressed(frame, sender=system) for frame in frames]
        for endpoint in self._endpoints:
            endpoint.send(frames)

    def from_program(self, program: Hashable, data: bytes) -> None:
        """Takes bytes from a local program."""
        if not self._system_of:
            for received in self._received.values():
                received(program, data)
            return
        if program not in self._streams and len(self._streams) >= MAX_PROGRAMS:
            self._streams.pop(next(iter(self._streams)))
        for frame in self._streams.setdefault(program, FrameStream()).feed(data):
            target = target_system(frame)
            for drone_id, received in self._received.items():
                if target in (None, 0):
                    received(program, frame)
                elif target == self._system_of[drone_id] and drone_id in self._own_system_of:
                    received(program, readdressed(frame, target=self._own_system_of[drone_id]))

    def _program_gone(self, program: Hashable) -> None:
        self._streams.pop(program, None)
        for gone in self._gone:
            gone(program)
