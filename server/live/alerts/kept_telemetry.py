"""The newest messages of an autopilot that the rules of the alerts read, and their values.

The path of a frame only stores the frame. It is decoded when the rules are next evaluated, and only if another one has
come since: the rules run twice a second, however fast a drone sends.
"""

from collections import deque
from collections.abc import Callable
from struct import Struct
from typing import Any, Final

from server.live.alerts.status_texts import StatusText, StatusTexts
from server.live.preflight.arming_texts import ArmingTexts
from wire.dialect import mavlink
from wire.frames import payload

STATUSTEXT: Final = mavlink.MAVLINK_MSG_ID_STATUSTEXT
MAX_TEXTS: Final = 20
"""Texts between two evaluations. More is a flood: the newest stay."""
MAX_TEXT_FRAMES: Final = 3 * MAX_TEXTS
"""A text may come in chunks, one a frame."""
MAX_BATTERIES: Final = 8

_SYS_STATUS: Final = mavlink.MAVLINK_MSG_ID_SYS_STATUS
_BATTERY: Final = mavlink.MAVLINK_MSG_ID_BATTERY_STATUS
_GPS: Final = mavlink.MAVLINK_MSG_ID_GPS_RAW_INT
_EKF: Final = mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT
_ESTIMATOR: Final = mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS
_VIBRATION: Final = mavlink.MAVLINK_MSG_ID_VIBRATION
_FENCE: Final = mavlink.MAVLINK_MSG_ID_FENCE_STATUS
KEPT: Final = frozenset({_SYS_STATUS, _BATTERY, _GPS, _EKF, _ESTIMATOR, _VIBRATION, _FENCE})
"""State messages that are kept, from the autopilot's own component."""

_SENSORS: Final = Struct("<III")
_REMAINING: Final = 30
_CHARGE: Final = 40
_FIX: Final = 28
_EKF_FIELDS: Final = Struct("<5fH")
_ESTIMATOR_FIELDS: Final = Struct("<Q8fH")
_VIBRATION_FIELDS: Final = Struct("<Q3f")
_BREACHED: Final = 6
_BREACH_TYPE: Final = 7
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
_BREACH_WORDS: Final = {
    int(mavlink.FENCE_BREACH_MINALT): "its minimum height",
    int(mavlink.FENCE_BREACH_MAXALT): "its maximum height",
    int(mavlink.FENCE_BREACH_BOUNDARY): "its boundary",
}
_LAST_CHARGE: Final = int(mavlink.MAV_BATTERY_CHARGE_STATE_UNHEALTHY)
"""7 is "charging", which is no trouble."""


class KeptTelemetry:
    """For one drone. Every value is None before its first message on the present link."""

    __slots__ = (
        "_arrived",
        "_charges",
        "_decoded",
        "_texts",
        "arming_ok",
        "arming_texts",
        "battery_charge",
        "battery_percent",
        "estimator_fault",
        "fence_breach",
        "gps_fix",
        "newest",
        "satellites",
        "texts",
        "vibration_m_s2",
    )

    def __init__(self) -> None:
        self.texts: deque[StatusText] = deque(maxlen=MAX_TEXTS)
        """Complete texts that nobody has read yet."""
        self._texts = StatusTexts()
        self._arrived: deque[tuple[bytes, float]] = deque(maxlen=MAX_TEXT_FRAMES)
        self.arming_texts = ArmingTexts()
        self.forget()

    def forget(self) -> None:
        """The link is gone: what comes on the next one is new."""
        self.newest: dict[tuple[int, int], bytes] = {}
        """The newest frame by message id and instance. Only the path of frames writes it."""
        self._decoded: dict[tuple[int, int], bytes] = {}
        self._charges: dict[int, int] = {}
        self.battery_percent: int | None = None
        self.battery_charge: int | None = None
        self.gps_fix: int | None = None
        self.satellites: int | None = None
        self.arming_ok: bool | None = None
        self.arming_texts.forget()
        self.estimator_fault: str | None = None
        self.vibration_m_s2: float | None = None
        self.fence_breach: str | None = None

    def text(self, frame: bytes, now: float) -> None:
        """Takes a STATUSTEXT frame."""
        self._arrived.append((frame, now))

    def decode(self, now: float) -> None:
        """Reads what has come since the last call."""
        while self._arrived:
            frame, at = self._arrived.popleft()
            self._add_texts(self._texts.take(frame, at), at)
        self._add_texts(self._texts.overdue(now), now)
        decoded = self._decoded
        for key, frame in self.newest.items():
            if decoded.get(key) is not frame:
                decoded[key] = frame
                _READERS[key[0]](self, payload(frame), key[1])

    def _add_texts(self, texts: list[StatusText], now: float) -> None:
        self.texts.extend(texts)
        for one in texts:
            self.arming_texts.take(one.text, now)

    def _system(self, content: bytes, _: int) -> None:
        content = content.ljust(31, b"\0")
        percent = content[_REMAINING]
        self.battery_percent = percent if percent <= 100 else None
        _, enabled, health = _SENSORS.unpack_from(content)
        self.arming_ok = bool(health & _PREARM) if enabled & _PREARM else None
        has_ekf = any(one in self.newest for one in ((_EKF, 0), (_ESTIMATOR, 0)))
        if enabled & _AHRS and not has_ekf:
            self.estimator_fault = "" if health & _AHRS else "not healthy"
        if enabled & _GEOFENCE and (_FENCE, 0) not in self.newest:
            self.fence_breach = "" if health & _GEOFENCE else "its fence"

    def _battery(self, content: bytes, number: int) -> None:
        charge = content[_CHARGE] if len(content) > _CHARGE else 0
        if number not in self._charges and len(self._charges) >= MAX_BATTERIES:
            return
        self._charges[number] = charge
        known = [one for one in self._charges.values() if 0 < one <= _LAST_CHARGE]
        self.battery_charge = max(known, default=None)

    def _gps(self, content: bytes, _: int) -> None:
        self.gps_fix = content[_FIX] if len(content) > _FIX else 0
        count = content[_FIX + 1] if len(content) > _FIX + 1 else 0
        self.satellites = count if count < _NO_COUNT else None

    def _ekf(self, content: bytes, _: int) -> None:
        *ratios, _, flags = _EKF_FIELDS.unpack_from(content.ljust(_EKF_FIELDS.size, b"\0"))
        self.estimator_fault = _fault(ratios, flags, MAX_VARIANCE)

    def _estimator(self, content: bytes, _: int) -> None:
        fields = _ESTIMATOR_FIELDS.unpack_from(content.ljust(_ESTIMATOR_FIELDS.size, b"\0"))
        self.estimator_fault = _fault(list(fields[1:5]), fields[-1], MAX_RATIO)

    def _vibration(self, content: bytes, _: int) -> None:
        _, *axes = _VIBRATION_FIELDS.unpack_from(content.ljust(_VIBRATION_FIELDS.size, b"\0"))
        self.vibration_m_s2 = max(axes)

    def _fence(self, content: bytes, _: int) -> None:
        content = content.ljust(9, b"\0")
        self.fence_breach = _BREACH_WORDS.get(content[_BREACH_TYPE], "its fence") if content[_BREACHED] else ""


def _fault(ratios: list[float], flags: int, limit: float) -> str:
    if flags & _NEEDED != _NEEDED:
        return "no attitude or height"
    worst = max(range(len(_PARTS)), key=lambda index: ratios[index])
    return f"bad {_PARTS[worst]}" if ratios[worst] >= limit else ""


_READERS: Final[dict[int, Callable[[KeptTelemetry, bytes, int], Any]]] = {
    _SYS_STATUS: KeptTelemetry._system,
    _BATTERY: KeptTelemetry._battery,
    _GPS: KeptTelemetry._gps,
    _EKF: KeptTelemetry._ekf,
    _ESTIMATOR: KeptTelemetry._estimator,
    _VIBRATION: KeptTelemetry._vibration,
    _FENCE: KeptTelemetry._fence,
}
"""How each kept message is read."""
