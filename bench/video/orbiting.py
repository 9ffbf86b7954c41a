"""Flies the vehicle that carries the camera, so that the picture moves: up, then in circles. Plain MAVLink over UDP.

It is a separate vehicle in the simulator's process, not the agent's: flying the camera takes no part in the
measurement.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from struct import Struct
from typing import Any, Final

from bench.rig import HOME, Kind
from wire.dialect import build, mavlink
from wire.frames import frame_length, message_id

CARRIER: Final = Kind("px4", radio=False)
HEIGHT_M: Final = 25.0
RADIUS_M: Final = 40.0
SPEED_M_S: Final = 8.0
ASK_EVERY_S: Final = 2.0
AMSL: Final = 0
"""MAV_FRAME_GLOBAL."""
_RELATIVE_ALT: Final = Struct("<i")
_RELATIVE_ALT_AT: Final = 10 + 16
_POSITION: Final = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT


class OrbitPilot:
    """Repeats unconfirmed requests every 2 s. `circles`: it is up, and has been sent into circles."""

    def __init__(self) -> None:
        """On the host of the calling thread."""
        self.circles = False
        self._height_m = 0.0
        self._vehicle: tuple[str, int] | None = None
        self._sequence = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        self.port = int(self._socket.getsockname()[1])
        asyncio.get_running_loop().add_reader(self._socket, self._receive)
        self._flying = asyncio.create_task(self._fly())

    def close(self) -> None:
        self._flying.cancel()
        asyncio.get_running_loop().remove_reader(self._socket)
        self._socket.close()

    async def _fly(self) -> None:
        while not self.circles:
            if self._vehicle is not None and self._height_m < HEIGHT_M - 2.0:
                self._command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HOME[2] + HEIGHT_M)
                self._command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
            elif self._vehicle is not None:
                x, y = round(HOME[0] * 1e7), round(HOME[1] * 1e7)
                turn = (RADIUS_M, SPEED_M_S, 0, 0)
                orbit = mavlink.MAV_CMD_DO_ORBIT
                self._send(
                    mavlink.MAVLink_command_int_message(1, 1, AMSL, orbit, 0, 0, *turn, x, y, HOME[2] + HEIGHT_M)
                )
                self.circles = True
            await asyncio.sleep(ASK_EVERY_S)

    def _command(self, number: int, *params: float) -> None:
        seven = (*params, *([0.0] * (7 - len(params))))
        self._send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *seven))

    def _send(self, message: Any) -> None:
        assert self._vehicle is not None
        self._sequence += 1
        frame = build(message, system_id=255, component_id=190, sequence=self._sequence & 0xFF)
        with contextlib.suppress(OSError):
            self._socket.sendto(frame, self._vehicle)

    def _receive(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                datagram, self._vehicle = self._socket.recvfrom(2048)
                at = 0
                while at < len(datagram):
                    after = at + frame_length(datagram, at)
                    frame = datagram[at:after]
                    if message_id(frame) == _POSITION:
                        (mm,) = _RELATIVE_ALT.unpack_from(frame.ljust(48, b"\0"), _RELATIVE_ALT_AT)
                        self._height_m = mm / 1000
                    at = after
