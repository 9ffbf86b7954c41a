"""Between the agent, which speaks MAVLink, and a flight controller that speaks MSP. Bytes and `now` in, bytes out.

It polls the controller and shows the answers as an autopilot's messages. Heartbeats go on only while MSP_STATUS is
answered, so that a silent controller is seen as a silent autopilot. Of what comes from the agent, sticks become
MSP_SET_RAW_RC, arming and modes become switches, and everything else is answered as unsupported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from onboard_agent.autopilot.msp import answers as msp
from onboard_agent.autopilot.msp.answers import SET_RAW_RC
from onboard_agent.autopilot.msp.frames import ANSWER, REQUEST, MspMessage, MspReader, encode
from onboard_agent.autopilot.msp.stick_stream import StickStream
from onboard_agent.autopilot.msp.vehicle import MspVehicle
from onboard_agent.autopilot.own_frames import FrameMaker, Sender
from wire.autopilots.msp_multicopter import NUMBERS
from wire.dialect import decode, mavlink
from wire.frame_stream import FrameStream

TICK_S: Final = 0.01
SILENT_S: Final = 1.5
SYSTEM_ID: Final = 1
AGAIN_S: Final = 0.5
MAX_TRIES: Final = 8
"""Older firmware answers some requests with an error, or not at all."""

_ASKED_ONCE: Final = (
    msp.FC_VARIANT,
    msp.FC_VERSION,
    msp.BOX_NAMES,
    msp.BOX_IDS,
    msp.MODE_RANGES,
    msp.RX_MAP,
)
_POLLED_S: Final[Mapping[int, float]] = {
    msp.ATTITUDE: 0.1,
    msp.STATUS: 0.2,
    msp.ALTITUDE: 0.2,
    msp.RAW_GPS: 0.2,
    msp.RC: 0.2,
    msp.ANALOG: 1.0,
}
"""Intervals. With 16 channels, questions and answers take 0.8 kB/s, and sticks at 50 Hz 2.2 kB/s more. A line of
115,200 baud carries 11.5 kB/s each way."""
_ACCEPTED, _DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
_UNSUPPORTED: Final = mavlink.MAV_RESULT_UNSUPPORTED
_NAMES: Final = {float(number): name for name, number in NUMBERS.items()}


class MspTranslator:
    """`from_controller`, `from_agent` and `tick` return (MSP for the controller, MAVLink for the agent)."""

    def __init__(self) -> None:
        self.vehicle = MspVehicle()
        self.sticks = StickStream()
        self._reader = MspReader()
        self._from_agent = FrameStream()
        self._maker = FrameMaker()
        self._began_at: float | None = None
        self._next_poll_at = dict.fromkeys(_POLLED_S, float("-inf"))
        self._tries = dict.fromkeys(_ASKED_ONCE, 0)
        self._next_try_at = float("-inf")
        self._status_at = float("-inf")
        self._beat_at = float("-inf")
        self._shown: tuple[bool, int] | None = None
        self._boxes_said: tuple[str, ...] | None = None

    def from_controller(self, data: bytes, now: float) -> tuple[bytes, bytes]:
        """Takes bytes from the line."""
        out: list[Any] = []
        for message in self._reader.feed(data):
            if message.direction == ANSWER:
                out += self._answered(message.function, message.payload, now)
            elif message.function in self._tries:
                self._tries[message.function] = MAX_TRIES
        return b"", self._packed(out)

    def from_agent(self, data: bytes, now: float) -> tuple[bytes, bytes]:
        """Takes MAVLink frames of agent, pilot or ground station."""
        out: list[Any] = []
        for frame in self._from_agent.feed(data):
            message = decode(frame)
            if message is not None:
                out += self._obey(message, now)
        return self._sticks_due(now), self._packed(out)

    def tick(self, now: float) -> tuple[bytes, bytes]:
        """Call each TICK_S."""
        self._began_at = now if self._began_at is None else self._began_at
        wanted = [function for function, at in self._next_poll_at.items() if now >= at]
        for function in wanted:
            self._next_poll_at[function] = now + _POLLED_S[function]
        if now >= self._next_try_at:
            self._next_try_at = now + AGAIN_S
            again = [function for function, tries in self._tries.items() if tries < MAX_TRIES]
            for function in again:
                self._tries[function] += 1
            wanted += again
        if not self.vehicle.armed:
            self.sticks.return_over()
        requests = b"".join(encode(MspMessage(1, REQUEST, function)) for function in wanted)
        return requests + self._sticks_due(now), self._packed(self._beat(now))

    # From the controller

    def _answered(self, function: int, payload: bytes, now: float) -> list[Any]:
        vehicle = self.vehicle
        if function in self._tries:
            self._tries[function] = MAX_TRIES
            self._learned(function, payload)
            return []
        boot_ms = round((now - (now if self._began_at is None else self._began_at)) * 1000)
        out: list[Any] = []
        if function == msp.STATUS and (status := msp.status(payload)) is not None:
            vehicle.status, self._status_at = status, now
            out = self._beat(now) + self._said_boxes()
        elif function == msp.ATTITUDE and (attitude := msp.attitude(payload)) is not None:
            vehicle.attitude = attitude
            out = [vehicle.attitude_message(boot_ms)]
        elif function == msp.ALTITUDE and (altitude := msp.altitude(payload)) is not None:
            vehicle.altitude = altitude
            out = [vehicle.air()]
        elif function == msp.RAW_GPS and (gps := msp.gps(payload)) is not None:
            vehicle.gps = gps
            vehicle.took_gps()
            out = [vehicle.position(boot_ms), vehicle.gps_message(boot_ms * 1000)]
        elif function == msp.ANALOG and (analog := msp.analog(payload)) is not None:
            vehicle.analog = analog
        elif function == msp.RC:
            vehicle.channels = msp.channels(payload)
            out = [vehicle.rc_channels(boot_ms)]
        return out

    def _learned(self, function: int, payload: bytes) -> None:
        vehicle = self.vehicle
        match function:
            case msp.FC_VARIANT:
                vehicle.variant = payload[:4].decode("ascii", "replace")
            case msp.FC_VERSION if len(payload) >= 3:
                vehicle.version = (payload[0], payload[1], payload[2])
            case msp.BOX_NAMES:
                vehicle.boxes.names = msp.box_names(payload)
            case msp.BOX_IDS:
                vehicle.boxes.ids = tuple(payload)
            case msp.MODE_RANGES:
                vehicle.boxes.ranges = msp.mode_ranges(payload)
            case msp.RX_MAP if sorted(payload[:4]) == [0, 1, 2, 3]:
                self.sticks.order = tuple(payload[:4])

    def _beat(self, now: float) -> list[Any]:
        """Each second, and at once when the mode or the arming has changed."""
        vehicle = self.vehicle
        shown = (vehicle.armed, vehicle.mode)
        if now - self._status_at > SILENT_S or (now - self._beat_at < 1.0 and shown == self._shown):
            return []
        self._beat_at, self._shown = now, shown
        return [vehicle.heartbeat(), vehicle.system_status(), vehicle.landed_state(), vehicle.home()]

    def _said_boxes(self) -> list[Any]:
        """Every active box by its own name, when they change: a mode stands for several."""
        status, boxes = self.vehicle.status, self.vehicle.boxes
        active = boxes.active(status.flags) if status is not None else ()
        if not boxes.names or active == self._boxes_said:
            return []
        self._boxes_said = active
        return [_text(mavlink.MAV_SEVERITY_INFO, f"Boxes: {', '.join(active) or 'none'}")]

    # From the agent

    def _obey(self, message: Any, now: float) -> list[Any]:
        kind = message.get_type()
        if kind == "MANUAL_CONTROL":
            self.sticks.manual_control(message, now)
        elif kind == "RC_CHANNELS_OVERRIDE":
            self.sticks.override(message, now)
        elif kind in ("COMMAND_LONG", "COMMAND_INT"):
            result, more = self._command(message, now)
            sender = (message.get_srcSystem(), message.get_srcComponent())
            return [*more, mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *sender)]
        elif kind == "MISSION_REQUEST_LIST":
            sender = (message.get_srcSystem(), message.get_srcComponent())
            return [mavlink.MAVLink_mission_count_message(*sender, 0, message.mission_type)]
        elif kind == "MISSION_COUNT":
            sender = (message.get_srcSystem(), message.get_srcComponent())
            result = mavlink.MAV_MISSION_UNSUPPORTED
            return [mavlink.MAVLink_mission_ack_message(*sender, result, message.mission_type)]
        return []

    def _command(self, message: Any, now: float) -> tuple[int, list[Any]]:
        command = message.command
        if command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            return self._arm(arm=message.param1 >= 0.5, now=now)
        if command == mavlink.MAV_CMD_DO_SET_MODE:
            return self._set_mode(_NAMES.get(message.param2, ""), now)
        if command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            made = self._requested(int(message.param1))
            return (_ACCEPTED, [made]) if made is not None else (_UNSUPPORTED, [])
        return _UNSUPPORTED, []

    def _arm(self, *, arm: bool, now: float) -> tuple[int, list[Any]]:
        pulses = self.vehicle.boxes.arming(arm=arm)
        if pulses is None:
            return _no_switch("arm" if arm else "disarm")
        self.sticks.press(pulses, now)
        return _ACCEPTED, []

    def _set_mode(self, name: str, now: float) -> tuple[int, list[Any]]:
        pulses = self.vehicle.boxes.switches(name)
        if pulses is None:
            return _no_switch(f"enter {name or 'that mode'}")
        returns = name == "RETURN" and self.vehicle.armed
        if not returns and not self.sticks.goes(now):
            words = "Switches need sticks: fly by hand first"
            return mavlink.MAV_RESULT_TEMPORARILY_REJECTED, [_text(mavlink.MAV_SEVERITY_WARNING, words)]
        self.sticks.switch(pulses)
        if returns:
            self.sticks.return_begun(now)
        else:
            self.sticks.return_over()
        return _ACCEPTED, []

    def _requested(self, message_id: int) -> Any | None:
        vehicle = self.vehicle
        makers: Mapping[int, Callable[[], Any | None]] = {
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: vehicle.firmware,
            mavlink.MAVLINK_MSG_ID_HOME_POSITION: vehicle.home,
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: vehicle.heartbeat,
            mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: vehicle.landed_state,
        }
        maker = makers.get(message_id)
        return maker() if maker is not None and vehicle.status is not None else None

    def _sticks_due(self, now: float) -> bytes:
        payload = self.sticks.due(now, self.vehicle.channels)
        return b"" if payload is None else encode(MspMessage(1, REQUEST, SET_RAW_RC, payload))

    def _packed(self, messages: list[Any]) -> bytes:
        sender = Sender(SYSTEM_ID, mavlink.MAV_COMP_ID_AUTOPILOT1)
        return b"".join(self._maker.make(one, sender) for one in messages if one is not None)


def _no_switch(what: str) -> tuple[int, list[Any]]:
    words = f"No switch to {what}: set up one (Modes)"
    return _DENIED, [_text(mavlink.MAV_SEVERITY_WARNING, words)]


def _text(severity: int, words: str) -> Any:
    return mavlink.MAVLink_statustext_message(severity, words.encode("ascii", "replace")[:50])
