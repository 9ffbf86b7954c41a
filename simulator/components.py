"""Components besides the autopilot, with their own heartbeats and answers: a camera, and a gimbal device.

The autopilot is the gimbal manager, as in PX4 and in ArduPilot's mounts. Source: mavlink.io, services/camera and
services/gimbal_v2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from simulator.command_message import ACCEPTED, FAILED, UNSUPPORTED, Command
from simulator.dialect import Codec, Message, mavlink
from simulator.flight import Flight
from simulator.payload_camera import CameraReports
from simulator.payload_gimbal import Gimbal

HEARTBEAT_S = 1.0
CAMERA, GIMBAL = int(mavlink.MAV_COMP_ID_CAMERA), int(mavlink.MAV_COMP_ID_GIMBAL)
_HEARTBEAT = 0

Send = Callable[[Message, Codec], None]


class Payload(Protocol):
    """The function and the messages of a component."""

    heartbeat_type: int
    """MAV_TYPE."""
    intervals_s: dict[int, float]
    """What it sends unrequested."""

    def report(self, message_id: int, flight: Flight) -> Message | None: ...
    def carry_out(self, flight: Flight, command: Command) -> int: ...
    def tick(self, flight: Flight) -> None: ...


class Component:
    def __init__(self, system_id: int, component_id: int, payload: Payload, send: Send) -> None:
        self.payload = payload
        self._send = send
        self._codec = Codec(system_id, component_id)
        self._due_s = dict.fromkeys((_HEARTBEAT, *payload.intervals_s), 0.0)

    def receive(self, flight: Flight, command: Command, sender: tuple[int, int]) -> None:
        """Handles a command for this component: the acknowledgement first, then the requested message."""
        asked = int(command.params[0]) if command.number == mavlink.MAV_CMD_REQUEST_MESSAGE else None
        report = None if asked is None else self._report(asked, flight)
        if asked is None:
            result = self.payload.carry_out(flight, command)
            if result == UNSUPPORTED and command.number in OLD_REQUESTS:
                report = self._report(OLD_REQUESTS[command.number], flight)
                result = ACCEPTED if report is not None else FAILED
        else:
            result = ACCEPTED if report is not None else FAILED
        self._say(mavlink.MAVLink_command_ack_message(command.number, result, 0, 0, *sender))
        if report is not None:
            self._say(report)

    def tick(self, flight: Flight) -> None:
        self.payload.tick(flight)
        for message_id, due_s in self._due_s.items():
            if flight.now_s + 1e-9 >= due_s:
                self._due_s[message_id] = flight.now_s + self.payload.intervals_s.get(message_id, HEARTBEAT_S)
                report = self._report(message_id, flight)
                if report is not None:
                    self._say(report)

    def _report(self, message_id: int, flight: Flight) -> Message | None:
        if message_id == _HEARTBEAT:
            return mavlink.MAVLink_heartbeat_message(
                self.payload.heartbeat_type, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
            )
        return self.payload.report(message_id, flight)

    def _say(self, message: Message) -> None:
        self._send(message, self._codec)


OLD_REQUESTS = {
    int(mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION): int(mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION),
    int(mavlink.MAV_CMD_REQUEST_CAMERA_SETTINGS): int(mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS),
    int(mavlink.MAV_CMD_REQUEST_STORAGE_INFORMATION): int(mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION),
    int(mavlink.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS): int(mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS),
    int(mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION): int(mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION),
    int(mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS): int(mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS),
}
"""Commands superseded by REQUEST_MESSAGE; ground stations still send them."""


class Components:
    """The components of one vehicle, by component id; there may be none."""

    def __init__(self, system_id: int, send: Send, *, camera: bool, gimbal: bool) -> None:
        self.gimbal = Gimbal() if gimbal else None
        self.camera = CameraReports(GIMBAL if gimbal else 0) if camera else None
        payloads: dict[int, Payload | None] = {CAMERA: self.camera, GIMBAL: self.gimbal}
        self._all = {
            number: Component(system_id, number, payload, send)
            for number, payload in payloads.items()
            if payload is not None
        }

    def of(self, component_id: int) -> Component | None:
        return self._all.get(component_id)

    def tick(self, flight: Flight) -> None:
        for component in self._all.values():
            component.tick(flight)
