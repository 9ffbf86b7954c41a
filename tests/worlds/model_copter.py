"""A small model of an ArduCopter for control tests: modes, sticks, receiver, failsafes, height. One clock.

Written from the tables in docs/control.md, measured on a real ArduCopter. It is no simulator: it moves up and down and
knows its ground speed, but not its position. `changes` records why each mode began.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum, StrEnum
from typing import Any, Final, NamedTuple

from wire.dialect import build, decode, mavlink


class Receiver(StrEnum):
    """Output of the radio receiver while no override is active."""

    LOW = "low"
    """The throttle is at the bottom."""
    CENTRED = "centred"
    NONE = "none"


class Mode(IntEnum):
    """The ArduCopter modes that these tests use."""

    STABILIZE = 0
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    CIRCLE = 7
    LAND = 9
    POSHOLD = 16
    BRAKE = 17


class Change(NamedTuple):
    """A mode change. `why`: commanded, switched, radio failsafe or EKF failsafe. `by`: the sender's component."""

    at: float
    mode: Mode
    why: str
    by: int = 0


USES_STICKS: Final = frozenset({Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER, Mode.POSHOLD, Mode.CIRCLE})
NEEDS_POSITION: Final = frozenset(
    {Mode.AUTO, Mode.GUIDED, Mode.LOITER, Mode.RTL, Mode.POSHOLD, Mode.BRAKE, Mode.CIRCLE}
)
GOES_DOWN: Final = frozenset({Mode.RTL, Mode.LAND})

PARAMETERS: Final = {
    "SYSID_MYGCS": 255.0,
    "RC1_TRIM": 1500.0,
    "RC2_TRIM": 1500.0,
    "RC3_MIN": 1000.0,
    "RC3_MAX": 2000.0,
    "RC4_TRIM": 1500.0,
    "RC3_TRIM": 1000.0,
    "FS_GCS_ENABLE": 0.0,
    "FS_GCS_TIMEOUT": 5.0,
    "FS_THR_ENABLE": 1.0,
    "FS_OPTIONS": 16.0,
    "RC_OVERRIDE_TIME": 3.0,
    "RC_FS_TIMEOUT": 1.0,
    "RC_OPTIONS": 0.0,
    "SIM_SPEEDUP": 1.0,
}
"""Default parameters."""

RADIO_FAILSAFE_S: Final = 1.0
EKF_FAILSAFE_S: Final = 1.0
DISARM_DELAY_S: Final = 10.0
LANDED_DISARM_S: Final = 1.0
SPOOL_UP_S: Final = 2.0
WAY_HOME_S: Final = 8.0
FULL_CLIMB_M_S: Final = 2.5

_CONTINUES: Final = {Mode.AUTO: 1, Mode.GUIDED: 4, Mode.LAND: 8}
"""Maps a mode to the bit of FS_OPTIONS that lets it continue without a radio."""
_ARREST_M_S2: Final = 1.42
_BRAKING_ARREST_M_S2: Final = 0.82
_SLOW_DOWN_M_S2: Final = {Mode.ALT_HOLD: 1.2, Mode.STABILIZE: 1.2, Mode.BRAKE: 2.5, Mode.GUIDED: 3.0}
_DEAD_ZONE: Final = 50
_RELEASES: Final = 32767
_HEARTBEAT: Final = object()
"""Placeholder for a heartbeat, which is built with the state at the time it is sent."""
_EVERY_S: Final = {"heartbeat": 1.0, "motion": 0.1, "estimator": 1.0, "health": 0.5}


class ModelCopter:
    """Give it frames with `receive`, advance it with `step`, and read what it sends from the result."""

    def __init__(
        self,
        now: float,
        *,
        receiver: Receiver = Receiver.LOW,
        parameters: dict[str, float] | None = None,
        height_m: float = 0.0,
        mode: Mode = Mode.LOITER,
    ) -> None:
        self.now = now
        self.receiver = receiver
        self.transmitter_lost = False
        """Its receiver receives nothing any more, and repeats its last values."""
        self.mode_switch = 1800
        self.parameters = PARAMETERS | (parameters or {})
        self.height_m = height_m
        self.armed = height_m > 0.0
        self.mode = mode
        self.climb_m_s = self.speed_m_s = self.tilt_deg = 0.0
        self.battery_percent = -1
        self.mission_state = mavlink.MISSION_STATE_ACTIVE
        """As MISSION_CURRENT shows it. A mission that is complete leaves it hovering in AUTO."""
        self.mute = False
        """True: nothing that it sends arrives."""
        self.ack_after_s = 0.003
        self.loses_acks = False
        self.refuses: frozenset[Mode] = frozenset()
        self.touched_m_s: float | None = None
        """Vertical speed at the last touchdown."""
        self.changes: list[Change] = []
        self.sticks_at = float("-inf")
        self.estimator_reported_at = now
        self.texts: list[str] = []
        self._x, self._z = 0, 0
        self._has_position = True
        self._lost_at: float | None = None
        self._ekf_acted = False
        self._radio_failsafe = receiver is Receiver.NONE and self._failsafe_action > 0
        self.mode_since = now
        self._landed_since: float | None = None if height_m > 0.0 else now
        self._takeoff_to_m: float | None = None
        self._goes_somewhere = False
        self._due: list[tuple[float, Any]] = []
        self._every_s = dict(_EVERY_S)
        self._next = dict.fromkeys(_EVERY_S, now)

    # Inputs

    @property
    def has_position(self) -> bool:
        return self._has_position

    @has_position.setter
    def has_position(self, there: bool) -> None:
        """The estimator's view, which changes some seconds after the satellites are lost. Reported at the requested
        rate."""
        self._has_position = there
        self._lost_at = None if there else self.now
        self._ekf_acted = False

    @property
    def flying(self) -> bool:
        return self.armed and self.height_m > 0.0

    @property
    def overridden(self) -> bool:
        """Whether sticks that were sent to it override the receiver."""
        return self.now - self.sticks_at < self.parameters["RC_OVERRIDE_TIME"]

    @property
    def throttle(self) -> int:
        """Throttle as the stick modes see it, 0 to 1000."""
        if self.overridden or not self._receives:
            return self._z
        return 0 if self.receiver is Receiver.LOW else 500

    @property
    def _ground_station(self) -> float:
        """System id of the ground station whose sticks it obeys: SYSID_MYGCS until 4.6, MAV_GCS_SYSID from 4.7 on."""
        return self.parameters.get("SYSID_MYGCS", self.parameters.get("MAV_GCS_SYSID", 255.0))

    @property
    def _failsafe_action(self) -> int:
        return int(self.parameters["FS_THR_ENABLE"])

    @property
    def _receives(self) -> bool:
        return self.receiver is not Receiver.NONE and not self.transmitter_lost

    def turn_switch(self, mode: Mode) -> None:
        """The person at the transmitter selects a mode."""
        self.mode_switch = 1000 if self.mode_switch > 1500 else 2000
        self.transmitter_lost = False
        self._radio_failsafe = False
        self.switch(mode)

    def switch(self, mode: Mode) -> None:
        """Changes the mode, as by the radio's switch or another ground station."""
        self._begin(mode, "switched")
        self._say(_HEARTBEAT)

    def receive(self, frames: Iterable[bytes]) -> None:
        """Handles frames from its serial line."""
        for frame in frames:
            message = decode(frame)
            if message is None:
                continue
            kind = message.get_type()
            if kind == "MANUAL_CONTROL" and message.get_srcSystem() == self._ground_station:
                if message.z == _RELEASES:
                    self.sticks_at = float("-inf")
                    continue
                self.sticks_at, self._x, self._z = self.now, message.x, message.z
                self._radio_failsafe = False
            elif kind in ("COMMAND_LONG", "COMMAND_INT"):
                self._command(message)
            elif kind == "TIMESYNC" and not message.tc1:
                self._say(mavlink.MAVLink_timesync_message(int(self.now * 1e9), message.ts1))
            elif kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
                value = self.parameters[message.param_id]
                self._say(mavlink.MAVLink_param_value_message(message.param_id.encode(), value, 9, 900, 1))

    def _command(self, message: Any) -> None:
        shows = False
        if message.command == mavlink.MAV_CMD_DO_SET_MODE:
            wanted = Mode(int(message.param2))
            good = not (self.armed and wanted in NEEDS_POSITION and not self.has_position)
            good = good and wanted not in self.refuses
            if good and wanted is not self.mode:
                self._begin(wanted, "commanded", message.get_srcComponent())
                shows = True
        elif message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            good = self._arm() if message.param1 else self._disarm()
        elif message.command == mavlink.MAV_CMD_NAV_TAKEOFF:
            good = self.armed and self.mode is Mode.GUIDED
            if good:
                self._takeoff_to_m = message.param7
                self.mode_since = self.now
        elif message.command == mavlink.MAV_CMD_DO_REPOSITION:
            good = self._goes_somewhere = self.mode is Mode.GUIDED and self.has_position
        else:
            good = message.command in (mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL)
            shows = message.command == mavlink.MAV_CMD_REQUEST_MESSAGE and message.param1 == 0
            if good and message.param1 == mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT and message.param2 > 0:
                self._every_s["estimator"] = message.param2 / 1e6
        if not self.loses_acks:
            result = mavlink.MAV_RESULT_ACCEPTED if good else mavlink.MAV_RESULT_FAILED
            target = message.get_srcSystem(), message.get_srcComponent()
            self._say(mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *target), self.ack_after_s)
        if shows:
            self._say(_HEARTBEAT, self.ack_after_s)

    def _arm(self) -> bool:
        none_come = self.receiver is Receiver.NONE and not self.overridden
        if self._radio_failsafe or none_come:
            self.texts.append("Arm: Radio failsafe on")
        elif self.throttle > 0:
            self.texts.append("Arm: Throttle (RC3) is not neutral")
        else:
            self.armed = True
            self._landed_since = self.now
            return True
        return False

    def _disarm(self) -> bool:
        if self.flying:
            return False
        self.armed = False
        return True

    def _begin(self, mode: Mode, why: str, by: int = 0) -> None:
        if mode is not self.mode:  # GUIDED again ends neither
            self._takeoff_to_m = None
            self._goes_somewhere = False
        self.mode = mode
        self.mode_since = self.now
        self.changes.append(Change(self.now, mode, why, by))

    # Time

    def step(self, now: float) -> list[bytes]:
        """Advances to `now` and returns the frames sent until then."""
        dt, self.now = now - self.now, now
        self._failsafes()
        if self.armed:
            self._fly(dt)
        self._speak()
        said = [message for at, message in self._due if at <= now]
        self._due = [(at, message) for at, message in self._due if at > now]
        return [] if self.mute else [self._pack(message) for message in said]

    def _pack(self, message: Any) -> bytes:
        if message is _HEARTBEAT:
            message = mavlink.MAVLink_heartbeat_message(2, 3, 0x81 if self.armed else 1, int(self.mode), 4, 3)
        return build(message, system_id=1, component_id=1, sequence=0)

    def _failsafes(self) -> None:
        silent = self.now - self.sticks_at >= RADIO_FAILSAFE_S
        if not self._receives and self._failsafe_action > 0 and silent and not self._radio_failsafe:
            self._radio_failsafe = True
            if self.armed and not self.flying:
                self.armed = False
            elif self.armed and not int(self.parameters["FS_OPTIONS"]) & _CONTINUES.get(self.mode, 0):
                lands = self._failsafe_action in (3, 5) or not self.has_position
                self._begin(Mode.LAND if lands else Mode.RTL, "radio failsafe")
                self._say(_HEARTBEAT)
        if self._lost_at is not None and self.now - self._lost_at >= EKF_FAILSAFE_S and not self._ekf_acted:
            self._ekf_acted = True
            if self.flying and self.mode in NEEDS_POSITION:
                self._begin(Mode.LAND, "EKF failsafe")
                self._say(_HEARTBEAT)

    def _fly(self, dt: float) -> None:
        wanted, arrest = self._wanted_climb(), _ARREST_M_S2 if self.mode in USES_STICKS else _BRAKING_ARREST_M_S2
        self.climb_m_s += max(-arrest * dt, min(arrest * dt, wanted - self.climb_m_s))
        if self.height_m <= 0.0 and self.climb_m_s <= 0.0:
            self._stand()
            return
        self._landed_since = None
        self.height_m += self.climb_m_s * dt
        if self.height_m <= 0.0:
            self.touched_m_s = -self.climb_m_s
            self.height_m = self.climb_m_s = self.speed_m_s = 0.0
            self._landed_since = self.now
        stick = abs(self._x) / 1000.0 if self.overridden and self.mode in USES_STICKS else 0.0
        fast = 5.0 if self.mode is Mode.AUTO or self._goes_somewhere else 8.0 * stick
        change = _SLOW_DOWN_M_S2.get(self.mode, 2.5) * dt
        self.speed_m_s += max(-change, min(change, fast - self.speed_m_s))
        brakes = self.mode in (Mode.BRAKE, Mode.GUIDED) and self.speed_m_s > fast + 1.0
        braking = 15.0 if brakes else 0.0
        self.tilt_deg += max(-100.0 * dt, min(100.0 * dt, 30.0 * stick + braking - self.tilt_deg))

    def _wanted_climb(self) -> float:
        if self.mode in USES_STICKS:
            stick = self.throttle - 500
            return 0.0 if abs(stick) <= _DEAD_ZONE else FULL_CLIMB_M_S * stick / 500.0
        since = self.now - self.mode_since
        if self.mode is Mode.GUIDED and self._takeoff_to_m is not None:
            left = self._takeoff_to_m - self.height_m
            return FULL_CLIMB_M_S * max(-1.0, min(1.0, left)) if since >= SPOOL_UP_S else 0.0
        if self.mode is Mode.LAND or (self.mode is Mode.RTL and since >= WAY_HOME_S):
            return -1.0 if self.height_m > 10.0 else -0.5
        return 0.0

    def _stand(self) -> None:
        self.climb_m_s = self.speed_m_s = self.tilt_deg = 0.0
        if self._landed_since is None:
            self._landed_since = self.now
        stands_s = self.now - self._landed_since
        lands = self.mode is Mode.LAND or (self.mode is Mode.RTL and self.now - self.mode_since >= WAY_HOME_S)
        rests = self.mode in USES_STICKS and self.throttle == 0
        if stands_s >= (LANDED_DISARM_S if lands else DISARM_DELAY_S) and (lands or rests):
            self.armed = False

    # Outputs

    def _say(self, message: Any, after_s: float = 0.0) -> None:
        """Queues a message. A delayed heartbeat reports the state when it is sent, because nothing overtakes on a
        serial line."""
        self._due.append((self.now + after_s, message))

    def _speak(self) -> None:
        for kind, every_s in self._every_s.items():
            if self.now >= self._next[kind]:
                self._next[kind] = self.now + every_s
                getattr(self, f"_say_{kind}")()

    def _say_heartbeat(self) -> None:
        self._say(_HEARTBEAT)

    def _say_motion(self) -> None:
        boot_ms = int(self.now * 1000)
        pitch = self.tilt_deg / 57.29578
        self._say(mavlink.MAVLink_attitude_message(boot_ms, 0.0, pitch, 0.0, 0.0, 0.0, 0.0))
        vx, vz = int(self.speed_m_s * 100), int(-self.climb_m_s * 100)
        height_mm = int(self.height_m * 1000)
        self._say(mavlink.MAVLink_global_position_int_message(boot_ms, 0, 0, height_mm, height_mm, vx, 0, vz, 0))

    def _say_estimator(self) -> None:
        self.estimator_reported_at = self.now
        flags = 0x33F if self.has_position else 0x0A7
        self._say(mavlink.MAVLink_ekf_status_report_message(flags, 0.1, 0.1, 0.1, 0.1, 0.1))

    def _say_health(self) -> None:
        none = self.receiver is Receiver.NONE
        channels = (1500 + self._x // 2, 1500, 1000 + self.throttle, 1500)
        values = channels if self.overridden or not none else (0, 0, 0, 0)
        count = 0 if none else 16
        switches = [0] * 4 if none else [self.mode_switch, 1000, 1000, 1800]
        self._say(mavlink.MAVLink_rc_channels_message(0, count, *values, *switches, *([0] * 10), 255))
        bit = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
        seen = bit if self.overridden or not none else 0
        sensors = seen, seen, seen if self.overridden or not self._radio_failsafe else 0
        self._say(mavlink.MAVLink_sys_status_message(*sensors, 0, 0, 0, self.battery_percent, 0, 0, 0, 0, 0, 0))
        landed = mavlink.MAV_LANDED_STATE_IN_AIR if self.height_m > 0.0 else mavlink.MAV_LANDED_STATE_ON_GROUND
        self._say(mavlink.MAVLink_extended_sys_state_message(0, landed))
        self._say(mavlink.MAVLink_mission_current_message(3, 3, self.mission_state, 1 if self.mode is Mode.AUTO else 2))
