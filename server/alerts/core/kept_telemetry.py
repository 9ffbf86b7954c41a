"""The newest messages of an autopilot that the rules of the alerts read, and their values.

The path of a frame only stores the frame. It is decoded when the rules are next evaluated, and only if another one has
come since: the rules run twice a second, however fast a drone sends.
"""

from collections import deque
from collections.abc import Callable
from math import isfinite, isnan
from struct import Struct
from typing import Any, Final, NamedTuple

from server.alerts.core.status_texts import StatusText, StatusTexts
from server.readiness.core.arming_texts import ArmingTexts
from wire.autopilots import registry
from wire.autopilots.failsafe_words import Failsafe
from wire.autopilots.profile import ArmingChecks
from wire.dialect import mavlink
from wire.firmware import Release, release_of
from wire.frames import payload

STATUSTEXT: Final = mavlink.MAVLINK_MSG_ID_STATUSTEXT
MAX_TEXTS: Final = 20
"""Texts between two evaluations. More is a flood: the newest stay."""
MAX_TEXT_FRAMES: Final = 3 * MAX_TEXTS
"""A text may come in chunks, one a frame."""
MAX_BATTERIES: Final = 8
GONE_S: Final = 60.0
"""A battery or a GPS that has not reported for this long is no longer there."""

_SYS_STATUS: Final = mavlink.MAVLINK_MSG_ID_SYS_STATUS
_BATTERY: Final = mavlink.MAVLINK_MSG_ID_BATTERY_STATUS
_GPS: Final = mavlink.MAVLINK_MSG_ID_GPS_RAW_INT
_GPS2: Final = mavlink.MAVLINK_MSG_ID_GPS2_RAW
_EKF: Final = mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT
_ESTIMATOR: Final = mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS
_VIBRATION: Final = mavlink.MAVLINK_MSG_ID_VIBRATION
_FENCE: Final = mavlink.MAVLINK_MSG_ID_FENCE_STATUS
ATTITUDE: Final = mavlink.MAVLINK_MSG_ID_ATTITUDE
REMOTE_ID_STATUS: Final = mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_ARM_STATUS
_ARM_STATUS_BYTES: Final = 51
MISSION_CURRENT: Final = mavlink.MAVLINK_MSG_ID_MISSION_CURRENT
KEPT: Final = frozenset(
    {_SYS_STATUS, _BATTERY, _GPS, _GPS2, _EKF, _ESTIMATOR, _VIBRATION, _FENCE, ATTITUDE, MISSION_CURRENT}
)
"""State messages that are kept, from the autopilot's own component."""

_SENSORS: Final = Struct("<III")
_REMAINING: Final = 30
_BATTERY_REMAINING: Final = 35
_CHARGE: Final = 40
_FIX: Final = 28
_FIX_2: Final = 32
_EKF_FIELDS: Final = Struct("<5fH")
_ESTIMATOR_FIELDS: Final = Struct("<Q8fH")
_VIBRATION_FIELDS: Final = Struct("<Q3f")
_BREACHED: Final = 6
_BREACH_TYPE: Final = 7
_AUTOPILOT: Final = 5
"""Offsets in the payloads, as the MAVLink specification orders them."""

MAX_VARIANCE: Final = 0.8
"""Of EKF_STATUS_REPORT: from here ArduPilot's own failsafe acts."""
MAX_RATIO: Final = 1.0
"""Of ESTIMATOR_STATUS: beyond it PX4 rejects the measurement."""
_NEEDED: Final = int(mavlink.ESTIMATOR_ATTITUDE | mavlink.ESTIMATOR_VELOCITY_VERT)
_PARTS: Final = ("speed", "position", "height", "compass")
_AHRS: Final = int(mavlink.MAV_SYS_STATUS_AHRS)
_GEOFENCE: Final = int(mavlink.MAV_SYS_STATUS_GEOFENCE)
_PREARM: Final = int(mavlink.MAV_SYS_STATUS_PREARM_CHECK)
_NO_COUNT: Final = 255
_3D_FIX: Final = int(mavlink.GPS_FIX_TYPE_3D_FIX)
_SENSORS_BY_NAME: Final = {
    "its gyroscope": int(mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO),
    "its accelerometer": int(mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL),
    "its compass": int(mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG),
    "its barometer": int(mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE),
    "its second gyroscope": int(mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO2),
    "its second accelerometer": int(mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL2),
    "its second compass": int(mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG2),
}
"""Sensors that are told by name. Rangefinders and optical flow are left out: they lose the ground with every climb."""
_BREACH_WORDS: Final = {
    int(mavlink.FENCE_BREACH_MINALT): "its minimum height",
    int(mavlink.FENCE_BREACH_MAXALT): "its maximum height",
    int(mavlink.FENCE_BREACH_BOUNDARY): "its boundary",
}
_LAST_CHARGE: Final = int(mavlink.MAV_BATTERY_CHARGE_STATE_UNHEALTHY)
"""7 is "charging", which is no trouble."""


class Battery(NamedTuple):
    """One BATTERY_STATUS. `charge`: MAV_BATTERY_CHARGE_STATE, 0: not reported."""

    charge: int
    percent: int | None
    at: float

    @property
    def badness(self) -> tuple[int, int]:
        """By its autopilot's own thresholds first."""
        return self.charge, 100 - (100 if self.percent is None else self.percent)


class Gps(NamedTuple):
    """`fix`: GPS_FIX_TYPE. `satellites`: None: not reported."""

    fix: int
    satellites: int | None
    at: float

    @property
    def goodness(self) -> tuple[int, int]:
        return self.fix, -1 if self.satellites is None else self.satellites


class RemoteId(NamedTuple):
    """What the Remote ID transmitter said last: why it is not ready; empty: it is."""

    problem: str
    at: float


class KeptTelemetry:
    """For one drone. Every value is None before its first message on the present link."""

    __slots__ = (
        "_armed",
        "_arrived",
        "_batteries",
        "_decoded",
        "_gps_units",
        "_system_percent",
        "_texts",
        "arming_ok",
        "arming_texts",
        "autopilot",
        "battery_charge",
        "battery_number",
        "battery_percent",
        "checks",
        "estimator_fault",
        "failsafe_told",
        "fence_breach",
        "gps_fix",
        "gps_lost",
        "gps_number",
        "newest",
        "now",
        "remote_id",
        "satellites",
        "sensor_fault",
        "texts",
        "vibration_m_s2",
    )

    def __init__(self) -> None:
        self.texts: deque[StatusText] = deque(maxlen=MAX_TEXTS)
        """Complete texts of the armed autopilot that nobody has read yet."""
        self._texts = StatusTexts()
        self.now = 0.0
        """Of the last look."""
        self.autopilot = 0
        """MAV_AUTOPILOT of its newest heartbeat."""
        self._armed = False
        """When the newest text came."""
        self._arrived: deque[tuple[bytes, float, bool]] = deque(maxlen=MAX_TEXT_FRAMES)
        self.arming_texts = ArmingTexts()
        self.forget()

    def forget(self) -> None:
        """The link is gone: what comes on the next one is new."""
        self.newest: dict[tuple[int, int], bytes] = {}
        """The newest frame by message id and instance. Only the path of frames writes it."""
        self._decoded: dict[tuple[int, int], bytes] = {}
        self._batteries: dict[int, Battery] = {}
        self._system_percent: int | None = None
        self.battery_percent: int | None = None
        """Of the worst battery, with its charge state and, of several, its number from 1."""
        self.battery_charge: int | None = None
        self.battery_number: int | None = None
        self._gps_units: dict[int, Gps] = {}
        self.gps_fix: int | None = None
        """Of the worst GPS, with its satellites and, of several, its number from 1."""
        self.gps_number: int | None = None
        self.gps_lost: bool | None = None
        """No GPS has a position."""
        self.sensor_fault: str | None = None
        """Which sensors are enabled and not healthy; empty: none."""
        self.satellites: int | None = None
        self.arming_ok: bool | None = None
        self.arming_texts.forget()
        self.estimator_fault: str | None = None
        self.checks: ArmingChecks | None = None
        """Arming checks that come as events."""
        self.failsafe_told: Failsafe | None = None
        """The last one that an event told of."""
        self.vibration_m_s2: float | None = None
        self.fence_breach: str | None = None
        self.remote_id: RemoteId | None = None

    def remote_id_status(self, frame: bytes, now: float) -> None:
        """Takes an OPEN_DRONE_ID_ARM_STATUS frame."""
        body = payload(frame).ljust(_ARM_STATUS_BYTES, b"\0")
        words = body[1:_ARM_STATUS_BYTES].split(b"\0")[0].decode("utf-8", "replace").strip()
        is_ready = body[0] == mavlink.MAV_ODID_ARM_STATUS_GOOD_TO_ARM
        self.remote_id = RemoteId("" if is_ready else words or "it gives no reason", now)

    def text(self, frame: bytes, now: float, *, armed: bool) -> None:
        """Takes a STATUSTEXT frame. Those of a disarmed autopilot are reasons against arming, and no alerts."""
        self._arrived.append((frame, now, armed))

    def release_of(self, firmware: int) -> Release | None:
        """The newest release whose features this firmware of the autopilot surely has."""
        family = registry.FAMILIES.get(self.autopilot)
        return release_of(firmware) if family is None else family.release_of(firmware)

    def event(self, frame: bytes) -> None:
        """Takes an EVENT frame."""
        family = registry.FAMILIES.get(self.autopilot)
        if family is None or family.make_checks is None:
            return
        self.checks = self.checks or family.make_checks()
        if self.checks.take(frame):
            self.failsafe_told = family.read_failsafe(frame) or self.failsafe_told
        self.fence_breach = self.checks.fence_breach

    def decode(self, now: float) -> None:
        """Reads what has come since the last call."""
        while self._arrived:
            frame, at, self._armed = self._arrived.popleft()
            self._add_texts(self._texts.take(frame, at), at)
        self._add_texts(self._texts.overdue(now), now)
        decoded, self.now = self._decoded, now
        for key, frame in self.newest.items():
            if decoded.get(key) is not frame and key[0] in _READERS:
                decoded[key] = frame
                _READERS[key[0]](self, payload(frame), key[1])
        self._judge_batteries(now)
        self._judge_gps(now)

    def _add_texts(self, texts: list[StatusText], now: float) -> None:
        if self._armed:
            self.texts.extend(texts)
        for one in texts:
            self.arming_texts.take(one.text, now)

    def _system(self, content: bytes, _: int) -> None:
        content = content.ljust(31, b"\0")
        percent = content[_REMAINING]
        self._system_percent = percent if percent <= 100 else None
        _, enabled, health = _SENSORS.unpack_from(content)
        family = registry.FAMILIES.get(self.autopilot)
        tells = enabled & _PREARM or (family is not None and family.prearm_by_health)
        self.arming_ok = bool(health & _PREARM) if tells else None
        ill = [name for name, bit in _SENSORS_BY_NAME.items() if enabled & bit and not health & bit]
        self.sensor_fault = " and ".join(ill)
        has_ekf = any(one in self.newest for one in ((_EKF, 0), (_ESTIMATOR, 0)))
        if enabled & _AHRS and not has_ekf:
            self.estimator_fault = "" if health & _AHRS else "not healthy"
        if enabled & _GEOFENCE and self.checks is None and (_FENCE, 0) not in self.newest:
            self.fence_breach = "" if health & _GEOFENCE else "its fence"

    def _battery(self, content: bytes, number: int) -> None:
        if number not in self._batteries and len(self._batteries) >= MAX_BATTERIES:
            return
        content = content.ljust(_CHARGE + 1, b"\0")
        percent, charge = content[_BATTERY_REMAINING], content[_CHARGE]
        is_state = 0 < charge <= _LAST_CHARGE
        self._batteries[number] = Battery(charge if is_state else 0, percent if percent <= 100 else None, self.now)

    def _judge_batteries(self, now: float) -> None:
        """The worst counts, with its own numbers. One that reports no more is gone."""
        for number in [number for number, one in self._batteries.items() if now - one.at > GONE_S]:
            del self._batteries[number]
        worst = max(self._batteries, key=lambda number: self._batteries[number].badness, default=None)
        if worst is None:
            self.battery_percent, self.battery_charge, self.battery_number = self._system_percent, None, None
            return
        one, is_only = self._batteries[worst], len(self._batteries) == 1
        self.battery_percent = self._system_percent if one.percent is None and is_only else one.percent
        self.battery_charge = one.charge or None
        self.battery_number = None if is_only else worst + 1

    def _gps(self, content: bytes, _: int) -> None:
        self._gps_unit(1, content.ljust(_FIX + 2, b"\0")[_FIX : _FIX + 2])

    def _gps2(self, content: bytes, _: int) -> None:
        self._gps_unit(2, content.ljust(_FIX_2 + 2, b"\0")[_FIX_2 : _FIX_2 + 2])

    def _gps_unit(self, number: int, fix_and_count: bytes) -> None:
        fix, count = fix_and_count
        self._gps_units[number] = Gps(fix, count if count < _NO_COUNT else None, self.now)

    def _judge_gps(self, now: float) -> None:
        units = self._gps_units
        for number in [number for number, one in units.items() if now - one.at > GONE_S]:
            del units[number]
        worst = min(units, key=lambda number: units[number].goodness, default=None)
        self.gps_fix = self.satellites = self.gps_number = self.gps_lost = None
        if worst is not None:
            self.gps_fix, self.satellites = units[worst].fix, units[worst].satellites
            self.gps_number = worst if len(units) > 1 else None
            self.gps_lost = all(one.fix < _3D_FIX for one in units.values())

    def _ekf(self, content: bytes, _: int) -> None:
        *ratios, _, flags = _EKF_FIELDS.unpack_from(content.ljust(_EKF_FIELDS.size, b"\0"))
        self.estimator_fault = _fault(ratios, flags, MAX_VARIANCE)

    def _estimator(self, content: bytes, _: int) -> None:
        fields = _ESTIMATOR_FIELDS.unpack_from(content.ljust(_ESTIMATOR_FIELDS.size, b"\0"))
        self.estimator_fault = _fault(list(fields[1:5]), fields[-1], MAX_RATIO)

    def _vibration(self, content: bytes, _: int) -> None:
        _, *axes = _VIBRATION_FIELDS.unpack_from(content.ljust(_VIBRATION_FIELDS.size, b"\0"))
        self.vibration_m_s2 = max(filter(isfinite, axes), default=None)

    def _fence(self, content: bytes, _: int) -> None:
        content = content.ljust(9, b"\0")
        self.fence_breach = _BREACH_WORDS.get(content[_BREACH_TYPE], "its fence") if content[_BREACHED] else ""


def autopilot_of(heartbeat: bytes) -> int:
    """MAV_AUTOPILOT in a HEARTBEAT frame."""
    content = payload(heartbeat)
    return content[_AUTOPILOT] if len(content) > _AUTOPILOT else 0


def _fault(ratios: list[float], flags: int, limit: float) -> str:
    if flags & _NEEDED != _NEEDED:
        return "no attitude or height"
    ratios = [0.0 if isnan(ratio) else ratio for ratio in ratios]  # PX4's word for what it does not measure
    worst = max(range(len(_PARTS)), key=lambda index: ratios[index])
    return f"bad {_PARTS[worst]}" if ratios[worst] >= limit else ""


_READERS: Final[dict[int, Callable[[KeptTelemetry, bytes, int], Any]]] = {
    _SYS_STATUS: KeptTelemetry._system,
    _BATTERY: KeptTelemetry._battery,
    _GPS: KeptTelemetry._gps,
    _GPS2: KeptTelemetry._gps2,
    _EKF: KeptTelemetry._ekf,
    _ESTIMATOR: KeptTelemetry._estimator,
    _VIBRATION: KeptTelemetry._vibration,
    _FENCE: KeptTelemetry._fence,
}
"""How each kept message is read."""
