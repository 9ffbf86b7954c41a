"""Flight by hand from a program: a stream of MANUAL_CONTROL. Thin shell."""

from __future__ import annotations

import asyncio
from typing import Final

from control_tower.connection import Connection
from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.lateness import stamp_ms
from wire.tagged import stamp, tag

EVERY_S: Final = 0.04
FRESH_S: Final = 0.5
"""A program that says nothing new for so long lets go: the sticks are centred."""
_SYSTEM_ID: Final = 255
_COMPONENT_ID: Final = 190


class Sticks:
    """Get one from `Flight.sticks`."""

    def __init__(self, connection: Connection, drone_id: int) -> None:
        self._connection = connection
        self._drone_id = DroneId(drone_id)
        self._axes = (0.0, 0.0, 0.0, 0.0)
        self._set_at = float("-inf")
        self._sequence = 0

    def set(self, *, pitch: float = 0.0, roll: float = 0.0, throttle: float = 0.0, yaw: float = 0.0) -> None:
        """-1 to 1 each: forward, right, up (0 holds the height in modes that do), clockwise. Holds for 0.5 s; say it
        again to go on. Raises ValueError."""
        axes = (pitch, roll, throttle, yaw)
        if not all(-1.0 <= axis <= 1.0 for axis in axes):
            raise ValueError("a stick has -1 to 1")
        self._axes, self._set_at = axes, asyncio.get_running_loop().time()

    async def stream(self) -> None:
        """Sends them until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            now = loop.time()
            pitch, roll, throttle, yaw = self._axes if now - self._set_at < FRESH_S else (0.0,) * 4
            message = mavlink.MAVLink_manual_control_message(
                self._connection.system_id(self._drone_id),
                round(pitch * 1000),
                round(roll * 1000),
                round(500 + throttle * 500),
                round(yaw * 1000),
                0,
            )
            frame = build(message, system_id=_SYSTEM_ID, component_id=_COMPONENT_ID, sequence=self._sequence)
            self._sequence += 1
            self._connection.send_frames(stamp(stamp_ms(now)) + tag(self._drone_id, frame))
            await asyncio.sleep(EVERY_S)
