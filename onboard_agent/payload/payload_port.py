"""An autopilot's port with servos and a sensor of the companion computer beside it. Thin shell.

What the sensor measures comes as if the vehicle had sent it, so black box, link and console have it like all telemetry.
Only what the agent has let pass reaches the servos: this is the last stop before the autopilot.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Sequence
from typing import Final

from onboard_agent.autopilot_port.port import AutopilotPort, OnBytes
from onboard_agent.autopilot_port.schemes import make_port
from onboard_agent.payload.sensor_lines import SensorLines
from onboard_agent.payload.servo import Servo
from onboard_agent.payload.servo_commands import ServoCommands
from onboard_agent.payload.sysfs_pwm import SysfsPwm
from onboard_agent.unusable import Unusable
from wire.dialect import mavlink
from wire.frame_stream import FrameStream
from wire.frames import message_id, source

_log = logging.getLogger(__name__)

SENSOR_SCHEMES: Final = ("serial", "tcp", "tcpin")
_HEARTBEAT: Final = int(mavlink.MAVLINK_MSG_ID_HEARTBEAT)


class PayloadPort(AutopilotPort):
    """`inner` leads to the autopilot; `sensor` is a line of JSON, or None."""

    def __init__(
        self, inner: AutopilotPort, servos: Sequence[Servo], sensor: AutopilotPort | None, pwm: SysfsPwm
    ) -> None:
        super().__init__(inner.name)
        self.speaks_first, self.narrow, self.counts = inner.speaks_first, inner.narrow, inner.counts
        self._inner = inner
        self._pwm = pwm
        self._commands = ServoCommands(servos, pwm.move) if servos else None
        self._sensor = sensor
        self._lines = SensorLines()
        self._lines.counts = self.counts
        self._from_autopilot = FrameStream()
        self._to_autopilot = FrameStream()
        self._received: OnBytes | None = None
        self._system_id = 0

    async def run(self, received: OnBytes) -> None:
        self._received = received
        self._inner.on_open = self._opened
        parts = [asyncio.create_task(self._inner.run(self._heard))]
        if self._sensor is not None:
            self._sensor.on_open = self._lines.restart
            parts.append(asyncio.create_task(self._sensor.run(self._measured)))
        try:
            done, _ = await asyncio.wait(parts, return_when=asyncio.FIRST_COMPLETED)
            for part in done:
                part.result()
        finally:
            for part in parts:
                part.cancel()
            await asyncio.wait(parts)
            self._pwm.close()

    def send(self, data: bytes) -> None:
        if self._commands is None or not self._system_id:
            self._inner.send(data)
            return
        for frame in self._to_autopilot.feed(data):
            answer = self._commands.take(frame, self._system_id)
            if answer is None:
                self._inner.send(frame)
                continue
            if self._commands.failure:
                _log.warning("%s", self._commands.failure)
            if self._received is not None:
                self._received(answer)

    def _opened(self) -> None:
        self._from_autopilot = FrameStream()
        self._system_id = 0
        self.on_open()

    def _heard(self, data: bytes) -> None:
        assert self._received is not None
        # Whole frames only: what is put in between must not split one.
        frames = self._from_autopilot.feed(data)
        if not self._system_id:
            ids = [source(frame) for frame in frames if message_id(frame) == _HEARTBEAT]
            self._system_id = next((system for system, part in ids if part == mavlink.MAV_COMP_ID_AUTOPILOT1), 0)
        if frames:
            self._received(b"".join(frames))

    def _measured(self, data: bytes) -> None:
        """Values that come before the vehicle is known are lost: nobody could say whose they are."""
        frames = self._lines.feed(data, asyncio.get_running_loop().time(), self._system_id)
        if self._system_id and self._received is not None:
            for frame in frames:
                self._received(frame)


def with_payload(port: AutopilotPort, servos: Sequence[Servo], sensor: str | None) -> AutopilotPort:
    """Returns the port with what is configured beside it. Raises Unusable for a sensor of no known kind."""
    if not servos and not sensor:
        return port
    line = None
    if sensor:
        if sensor.partition(":")[0] not in SENSOR_SCHEMES:
            raise Unusable(f"sensor {sensor!r}: known are {', '.join(SENSOR_SCHEMES)}")
        line = make_port(sensor)
    return PayloadPort(port, servos, line, SysfsPwm())
