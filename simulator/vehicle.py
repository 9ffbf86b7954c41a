"""One simulated vehicle: bytes in, bytes out, time passed in.

`receive` only queues. Everything happens in `step`, on a grid of TICK_S, so the output depends on what was received
when, not on how often `step` was called. Times are seconds since power-on and never go back.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from simulator.air_traffic import AirTraffic
from simulator.ardupilot import ARDUPILOT
from simulator.command_message import ACCEPTED, FAILED, UNSUPPORTED, Command, read_command
from simulator.commands_flight import jump_to_item
from simulator.components import Components
from simulator.dialect import COMPONENT_METADATA, Codec, Message, mavlink
from simulator.event_server import EventServer
from simulator.failure_modes import Failure, PlannedFailure
from simulator.flavour import Flavour
from simulator.flight import Flight
from simulator.flight_constants import TICK_S, ticks_until
from simulator.flight_state import FlightSettings
from simulator.log_protocol import LogServer
from simulator.logbook import Logbook
from simulator.metadata import ComponentFiles
from simulator.missions import MissionServer
from simulator.notices import Notice, Severity
from simulator.parameter_protocol import ParameterServer
from simulator.reports_common import ms
from simulator.served_files import file_server
from simulator.setpoints import receive_setpoint
from simulator.status_texts import StatusTexts
from simulator.telemetry import Telemetry
from simulator.vehicle_setup import IN_PROGRESS, LATER

INBOX_MAX = 512
"""Datagrams queued for the next tick; in a flood the newest are lost, as in a full serial buffer."""
OUTBOX_MAX = 4096
"""Frames not yet fetched; the oldest are evicted first."""
TEXTS_KEPT = 64
REBOOT_AFTER_S = 0.2
SET_MODE_FLAG = 1
SLOW_MODE_CHANGE_S = 1.5
PROGRESS_EVERY_S = 1.0
WORKS_FOR_S = 12.0
SLOW_MAX = 64
"""Queued mode changes; the oldest are dropped, because the last one decides."""
ONLY_SOME_MESSAGES = {
    Failure.COMMAND_LONG_ONLY: ("COMMAND_INT", int(mavlink.MAV_RESULT_COMMAND_LONG_ONLY)),
    Failure.COMMAND_INT_ONLY: ("COMMAND_LONG", int(mavlink.MAV_RESULT_COMMAND_INT_ONLY)),
    Failure.COMMAND_LONG_UNKNOWN: ("COMMAND_LONG", UNSUPPORTED),
}
"""Which message is refused, and with which result."""


@dataclass(frozen=True, slots=True)
class VehicleSettings:
    flight: FlightSettings
    system_id: int = 1
    parameters: tuple[tuple[str, float], ...] = ()
    parameter_count: int = 0
    failures: tuple[PlannedFailure, ...] = field(default=())
    flavour: Flavour = ARDUPILOT
    metadata: bool | None = None
    """Whether COMPONENT_METADATA is answered; None: as the flavour does."""
    camera: bool = False
    """A camera as a separate component."""
    gimbal: bool = False
    traffic: bool = False
    """A receiver of ADS-B, which hears a few aircraft."""
    telemetry_pace: float = 1.0
    """Simulated seconds in which a message comes that is due each second: the speed of the simulated time, where its
    messages are to come as often as those of a real vehicle."""


class Vehicle:
    def __init__(self, settings: VehicleSettings, failures: Iterable[Failure] = ()) -> None:
        self.settings = settings
        self.failures: set[Failure] = set(failures)
        self._planned: list[tuple[float, bool, Failure]] = []
        """(second, sets in (True) or ends, failure), in order."""
        for planned in settings.failures:
            self.plan_failure(planned)
        overrides = (
            (settings.flavour.system_id_parameter, float(settings.system_id)),
            (settings.flavour.battery_parameter, settings.flight.battery_mah),
            *settings.parameters,
        )
        self.parameters = settings.flavour.make_parameters(overrides, settings.parameter_count)
        self._logbook = Logbook(settings.flavour.banner)
        self._codec = Codec(settings.system_id)
        self._inbox: deque[tuple[float, bytes]] = deque()
        self._outbox: deque[bytes] = deque(maxlen=OUTBOX_MAX)
        self._ticks = 0
        self._boot_tick = 0
        self._reboot_tick: int | None = None
        self._sent = 0
        self._texts = StatusTexts()
        self._owed: list[int] = []
        self._setup_peer = (0, 0)
        self.overflowed = 0
        self.said: deque[str] = deque(maxlen=TEXTS_KEPT)
        """The latest texts, for a terminal."""
        self.video_uri = ""
        self._boot()

    def _boot(self) -> None:
        self._slow: deque[tuple[float, Command]] = deque(maxlen=SLOW_MAX)
        """(due time, command): delayed by MODE_CHANGE_SLOW."""
        self._at_work: list[tuple[float, float, Command, tuple[int, int]]] = []
        """(end, next report, command, sender): delayed by COMMAND_IN_PROGRESS."""
        self._suffered: set[Failure] = set()
        """What its servers know of."""
        self.flight = Flight(self.settings.flight, self.parameters, self.failures, self.settings.flavour)
        if self.settings.flavour.reports_mode_at_once:
            self.flight.on_mode_change = self._owe_heartbeat
        self.flight.on_item_reached = lambda seq: self._send(mavlink.MAVLink_mission_item_reached_message(seq))
        self.flight.on_photo = lambda photo: self._send(self.settings.flavour.photo_message(self.flight, photo))
        self._telemetry = Telemetry(self.settings.flavour, pace=self.settings.telemetry_pace)
        self._events = EventServer(self._send)
        self._missions = MissionServer(self.flight, self.settings.flavour, self._send, self.restart_soon)
        self._logs = LogServer(self.flight, self._logbook, self._send)
        self._parameter_server = ParameterServer(self.parameters, self._send, self._notify)
        settings = self.settings
        offers = settings.flavour.offers_metadata if settings.metadata is None else settings.metadata
        self._metadata = ComponentFiles(self.parameters) if offers else None
        self._files = file_server(self.parameters, self._send, self._logbook, self._metadata, settings.flavour)
        self._sufferers = [one for one in (self._parameter_server, self._files, self._metadata) if one is not None]
        self._traffic = AirTraffic(settings.flight.place) if settings.traffic else None
        self.components = Components(settings.system_id, self._send, camera=settings.camera, gimbal=settings.gimbal)
        if self.components.camera is not None:
            self.components.camera.video_uri = self.video_uri
        self._notify(Severity.INFO, self.settings.flavour.banner[0])

    # The interface.

    def receive(self, data: bytes, now_s: float) -> None:
        if len(self._inbox) >= INBOX_MAX:
            self.overflowed += 1
        else:
            self._inbox.append((now_s, data))

    def step(self, now_s: float) -> None:
        """Advances to `now_s`."""
        last = ticks_until(now_s)
        while self._ticks < last:
            self._ticks += 1
            self._tick(self._ticks * TICK_S)

    @property
    def ticks(self) -> int:
        """Those flown."""
        return self._ticks

    def plan_failure(self, planned: PlannedFailure) -> None:
        """Adds a failure, also in flight; one in the past sets in at the next tick."""
        self._planned.append((planned.from_s, True, planned.failure))
        if planned.until_s < math.inf:
            self._planned.append((planned.until_s, False, planned.failure))
        self._planned.sort()

    def datagrams_to_send(self) -> list[bytes]:
        """Returns one frame each, in order; each is returned once."""
        datagrams = list(self._outbox)
        self._outbox.clear()
        return datagrams

    @property
    def intervals_s(self) -> Mapping[int, float]:
        """Of each message that is sent by itself."""
        return self._telemetry.intervals_s

    # One tick.

    def _tick(self, now_s: float) -> None:
        flight = self.flight
        while self._planned and self._planned[0][0] <= now_s:
            _, sets_in, failure = self._planned.pop(0)
            if sets_in:
                self.failures.add(failure)
            else:
                self.failures.discard(failure)
        flight.now_s = (self._ticks - self._boot_tick) * TICK_S
        while self._inbox and self._inbox[0][0] <= now_s + 1e-9:
            data = self._inbox.popleft()[1]
            for message in () if self.failures & {Failure.MAVLINK_MUTE, Failure.DEAF} else self._codec.decode(data):
                self._handle(message)
        while self._slow and self._slow[0][0] <= flight.now_s:
            self.settings.flavour.carry_out(flight, self._slow.popleft()[1])
        self._work_on(flight.now_s)
        flight.tick(flight.now_s)
        self._missions.tick()
        if self.failures != self._suffered:
            self._suffered = set(self.failures)
            for server in self._sufferers:
                server.suffer(self.failures)
        self._parameter_server.tick()
        self._files.tick(flight.now_s)
        self._logs.tick()
        if self.settings.flavour.keeps_dataflash_logs:
            self._logbook.update(flight, [notice.text for notice in flight.notices])
        while flight.notices:
            self._send_notice(flight.notices.popleft())
        self._events.update(flight.now_s)
        for message in flight.setup.due(flight):
            self._send(message)
        for number, result in flight.setup.answers_due(flight.now_s):
            self._acknowledge(number, result, self._setup_peer)
        for message in self._telemetry.due(flight):
            self._send(message)
        for message_id in self._owed:
            self._send_report(message_id)
        self._owed.clear()
        if self._traffic is not None:
            for message in self._traffic.due(flight):
                self._send(message)
        self.components.tick(flight)
        if self._reboot_tick is not None and self._ticks >= self._reboot_tick:
            self._reboot()

    def _owe_heartbeat(self) -> None:
        """Reports a mode change at the end of this tick, after the acknowledgement."""
        self._owed.append(mavlink.MAVLINK_MSG_ID_HEARTBEAT)

    def restart_soon(self) -> None:
        """Reboots without a request: at the next tick."""
        self._reboot_tick = self._ticks + 1

    def _reboot(self) -> None:
        old = self.flight
        self._reboot_tick = None
        self._boot_tick = self._ticks
        self._boot()
        self.flight.body.stand_where(old.body)
        self.flight.plans = old.plans
        self.flight.restart_controllers()

    # Messages in.

    def _handle(self, message: Message) -> None:
        name = message.get_type()
        sender = (message.get_srcSystem(), message.get_srcComponent())
        target = getattr(message, "target_system", 0)
        if target not in (0, self.settings.system_id):
            return
        flight = self.flight
        if name == "HEARTBEAT":
            flight.heartbeat_heard_s = flight.now_s
            if not self.settings.flavour.accepts_any_ground_station or message.type == mavlink.MAV_TYPE_GCS:
                self._ground_station_seen(sender[0])
        elif name in ("COMMAND_LONG", "COMMAND_INT"):
            component = self.components.of(message.target_component)
            refusal = next((one for failure, one in ONLY_SOME_MESSAGES.items() if failure in self.failures), ("", 0))
            if component is None and name == refusal[0]:
                self._acknowledge(message.command, refusal[1], sender)
            elif component is None and Failure.COMMAND_IN_PROGRESS in self.failures:
                self._at_work.append((flight.now_s + WORKS_FOR_S, flight.now_s, read_command(message), sender))
            elif component is None:
                self._handle_command(read_command(message), sender)
            else:
                component.receive(flight, read_command(message), sender)
        elif name in ("RC_CHANNELS_OVERRIDE", "MANUAL_CONTROL"):
            self._handle_sticks(message, sender[0])
        elif name.startswith("MISSION_"):
            self._handle_mission(message, sender)
        elif name.startswith(("LOG_REQUEST_", "LOG_ERASE")):
            self._logs.receive(message, sender)
        elif name.startswith("PARAM_"):
            self._handle_parameter(message)
        elif name == "FILE_TRANSFER_PROTOCOL":
            self._files.receive(message, sender)
        elif name.startswith("SET_POSITION_TARGET_"):
            receive_setpoint(flight, message)
        elif name == "LANDING_TARGET":
            flight.precision.receive(message, flight)
        elif name == "SET_MODE":
            if message.base_mode & SET_MODE_FLAG:
                self.settings.flavour.set_mode_number(flight, message.custom_mode)
        elif name == "REQUEST_DATA_STREAM":
            rate = message.req_message_rate if message.start_stop else 0
            self._telemetry.set_stream(message.req_stream_id, rate, flight.now_s)
        elif name == "SETUP_SIGNING" and self.settings.flavour.signs and not flight.armed:
            key = bytes(message.secret_key)
            self._codec.sign(key if any(key) or message.initial_timestamp else b"", message.initial_timestamp)
        elif name == "TIMESYNC":
            if message.tc1 == 0:
                self._send(mavlink.MAVLink_timesync_message(round(flight.now_s * 1e9), message.ts1))
        elif name == "REQUEST_EVENT":
            self._events.asked(message, sender)
        elif name == "PING" and message.target_system == 0 and message.target_component == 0:
            self._send(mavlink.MAVLink_ping_message(message.time_usec, message.seq, *sender))

    def _ground_station_seen(self, system_id: int) -> None:
        if self.flight.sticks.accepts(system_id):
            self.flight.failsafes.ground_station_seen_s = self.flight.now_s

    def _handle_sticks(self, message: Message, system_id: int) -> None:
        sticks, now_s = self.flight.sticks, self.flight.now_s
        if not sticks.accepts(system_id):
            return
        if message.get_type() == "RC_CHANNELS_OVERRIDE":
            sticks.override([getattr(message, f"chan{n}_raw") for n in range(1, 19)], now_s)
        elif message.target == self.settings.system_id:
            sticks.manual_control(x=message.x, y=message.y, z=message.z, r=message.r, now_s=now_s)
        else:
            return
        if not self.settings.flavour.accepts_any_ground_station:  # if any ground station counts, only its heartbeats do
            self._ground_station_seen(system_id)

    def _handle_mission(self, message: Message, sender: tuple[int, int]) -> None:
        name = message.get_type()
        if name == "MISSION_SET_CURRENT":
            if jump_to_item(self.flight, message.seq):
                self._send_report(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)
        elif hasattr(message, "mission_type") and hasattr(message, "target_system"):
            self._missions.receive(message, sender)

    def _handle_parameter(self, message: Message) -> None:
        name = message.get_type()
        if name == "PARAM_REQUEST_LIST":
            for line in self.settings.flavour.banner:
                self._notify(Severity.INFO, line)
            self._parameter_server.list_all()
        elif name == "PARAM_REQUEST_READ":
            self._parameter_server.read(str(message.param_id), message.param_index)
        elif name == "PARAM_SET":
            self._parameter_server.set(str(message.param_id), message.param_value, message.param_type)

    # Commands.

    def _handle_command(self, command: Command, sender: tuple[int, int]) -> None:
        gimbal = self.components.gimbal
        managed = gimbal.manage(command, sender) if gimbal is not None else None
        if self.settings.flavour.answers_modes_twice and command.number == mavlink.MAV_CMD_DO_SET_MODE:
            self._acknowledge(command.number, ACCEPTED, sender)
        result = self._carry_out(command) if managed is None else managed
        if result in (LATER, IN_PROGRESS):
            self._setup_peer = sender
        if result != LATER:
            self._acknowledge(command.number, result, sender)

    def _work_on(self, now_s: float) -> None:
        there, self._at_work = self._at_work, []
        for end_s, report_s, command, sender in there:
            if now_s >= end_s:
                self._handle_command(command, sender)
                continue
            if now_s >= report_s:
                self._acknowledge(command.number, IN_PROGRESS, sender)
                report_s = now_s + PROGRESS_EVERY_S
            self._at_work.append((end_s, report_s, command, sender))

    def _acknowledge(self, number: int, result: int, peer: tuple[int, int]) -> None:
        if Failure.COMMAND_ACK_MISSING not in self.failures:
            self._send(mavlink.MAVLink_command_ack_message(number, result, 0, 0, *peer))

    def _carry_out(self, command: Command) -> int:
        flight, first = self.flight, int(command.params[0])
        number = command.number
        if number == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            if self._telemetry.set_interval(first, command.params[1], flight.now_s):
                return ACCEPTED
            self._notify(Severity.INFO, f"No ap_message for mavlink id ({first})")
            return int(mavlink.MAV_RESULT_DENIED)
        if number == mavlink.MAV_CMD_GET_MESSAGE_INTERVAL:
            if not self._telemetry.knows(first):
                return FAILED
            interval = self._telemetry.interval_us(first)
            self._send(mavlink.MAVLink_message_interval_message(first, interval))
            return ACCEPTED
        if number == mavlink.MAV_CMD_REQUEST_MESSAGE:
            return self._promise(first)
        if number == mavlink.MAV_CMD_GET_HOME_POSITION:
            return self._promise(mavlink.MAVLINK_MSG_ID_HOME_POSITION)
        if number == mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
            return self._promise(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        if number == mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
            return self._plan_reboot(first)
        if number == mavlink.MAV_CMD_DO_SET_MODE and Failure.MODE_CHANGE_IGNORED in self.failures:
            return ACCEPTED
        if number == mavlink.MAV_CMD_DO_SET_MODE and Failure.MODE_CHANGE_SLOW in self.failures:
            self._slow.append((flight.now_s + SLOW_MODE_CHANGE_S, command))
            return ACCEPTED
        return self.settings.flavour.carry_out(flight, command)

    def _plan_reboot(self, what: int) -> int:
        if self.flight.armed:
            return FAILED
        if what not in (1, 3):
            return UNSUPPORTED
        self._reboot_tick = self._ticks + round(REBOOT_AFTER_S / TICK_S)
        return ACCEPTED

    # Messages out.

    def _promise(self, message_id: int) -> int:
        """Sends the report at the end of this tick, after the acknowledgement."""
        if self._report(message_id) is None:
            return FAILED
        self._owed.append(message_id)
        return ACCEPTED

    def _send_report(self, message_id: int) -> None:
        message = self._report(message_id)
        if message is not None:
            self._send(message)

    def _report(self, message_id: int) -> Message | None:
        gimbal = self.components.gimbal
        if message_id == COMPONENT_METADATA and self._metadata is not None:
            return self._metadata.named(ms(self.flight))
        managed = gimbal.manager_report(message_id, self.flight) if gimbal is not None else None
        return self._telemetry.report(message_id, self.flight) if managed is None else managed

    def _notify(self, severity: Severity, text: str) -> None:
        self._send_text(Notice(severity, text))

    def _send_notice(self, notice: Notice) -> None:
        if notice.event is not None:
            self._events.tell(notice.event, self.flight.now_s)
        if notice.text:
            self._send_text(notice)

    def _send_text(self, notice: Notice) -> None:
        self.said.append(notice.text)
        for message in self._texts.of(notice):
            self._send(message)

    def films_at(self, uri: str) -> None:
        """Sets the URI of the pictures, which its camera component, if it has one, reports."""
        self.video_uri = uri
        if self.components.camera is not None:
            self.components.camera.video_uri = uri

    def _send(self, message: Message, codec: Codec | None = None) -> None:
        """`codec`: of a component other than the autopilot."""
        self._sent += 1
        frame = (codec or self._codec).encode(message)
        if self.failures & {Failure.SILENT, Failure.MAVLINK_MUTE}:
            return
        if Failure.DROP_EVERY_TENTH in self.failures and self._sent % 10 == 0:
            return
        self._outbox.append(frame)
