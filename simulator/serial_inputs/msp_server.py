"""The server half of MSP: what a flight controller answers a configurator or an on-screen display.

It reads the vehicle through a snapshot and changes nothing but the raw sticks (MSP_SET_RAW_RC), which move switches too
if there are boxes. Answers come in the
version of the request.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from simulator.serial_inputs import boxes
from simulator.serial_inputs.boxes import Box
from simulator.serial_inputs.msp_frames import Direction, MspDecoder, MspFrame, encode

PROTOCOL_VERSION = 0
API_VERSION = (1, 46)
VARIANT = b"CTWR"
FIRMWARE_VERSION = (0, 3, 0)
BOARD = b"SIMU"
MAX_STICKS = 18


class Function(IntEnum):
    API_VERSION = 1
    FC_VARIANT = 2
    FC_VERSION = 3
    BOARD_INFO = 4
    NAME = 10
    MODE_RANGES = 34
    RX_MAP = 64
    STATUS = 101
    RAW_IMU = 102
    MOTOR = 104
    RC = 105
    RAW_GPS = 106
    ATTITUDE = 108
    ALTITUDE = 109
    ANALOG = 110
    BOX_NAMES = 116
    BOX_IDS = 119
    SET_RAW_RC = 200


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What the server tells. Angles in degrees, in the directions of MAVLink."""

    name: str = "drone"
    armed: bool = False
    cycle_us: int = 5000
    acceleration_mss: tuple[float, float, float] = (0.0, 0.0, -9.80665)
    rates_dps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    field_gauss: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    alt_m: float = 0.0
    climb_mps: float = 0.0
    lat_deg: float = 0.0
    lon_deg: float = 0.0
    alt_amsl_m: float = 0.0
    ground_speed_mps: float = 0.0
    course_deg: float = 0.0
    satellites: int = 0
    fix: bool = False
    voltage_v: float = 0.0
    current_a: float = 0.0
    used_mah: float = 0.0
    motors: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    """Shares of full speed."""
    sticks_us: tuple[int, ...] = ()
    """Roll, pitch, yaw, throttle, switches."""
    active: frozenset[Box] = frozenset()


def _clamped(value: float, low: int, high: int) -> int:
    return int(min(max(round(value), low), high))


def _i16(value: float) -> int:
    return _clamped(value, -32768, 32767)


def _u16(value: float) -> int:
    return _clamped(value, 0, 65535)


def _status(now: Snapshot, switches: Sequence[Box] = ()) -> bytes:
    """The first bit is the arming, with and without boxes."""
    sensors = 0b1111  # accelerometer, barometer, magnetometer, GPS
    flags = sum(1 << bit for bit, box in enumerate(switches) if box in now.active) | int(now.armed)
    return struct.pack("<HHHIB", _u16(now.cycle_us), 0, sensors, flags, 0)


def _raw_imu(now: Snapshot) -> bytes:
    """Accelerations in 1/512 g and with gravity positive at rest, as the protocol has them."""
    force = [_i16(value / 9.80665 * 512.0) for value in now.acceleration_mss]
    rates = [_i16(value) for value in now.rates_dps]
    field = [_i16(value * 1000.0) for value in now.field_gauss]
    return struct.pack("<9h", force[0], force[1], -max(force[2], -32767), *rates, *field)


def _motor(now: Snapshot) -> bytes:
    return struct.pack("<8H", *(_u16(1000.0 + 1000.0 * share) for share in now.motors), 0, 0, 0, 0)


def _rc(now: Snapshot) -> bytes:
    return struct.pack(f"<{len(now.sticks_us)}H", *map(_u16, now.sticks_us))


def _raw_gps(now: Snapshot) -> bytes:
    return struct.pack(
        "<BBiiHHH",
        2 if now.fix else 0,
        _clamped(now.satellites, 0, 255),
        _clamped(now.lat_deg * 1e7, -(2**31), 2**31 - 1),
        _clamped(now.lon_deg * 1e7, -(2**31), 2**31 - 1),
        _u16(now.alt_amsl_m),
        _u16(now.ground_speed_mps * 100.0),
        _u16(now.course_deg % 360.0 * 10.0),
    )


def _attitude(now: Snapshot) -> bytes:
    """Nose up is negative here."""
    return struct.pack("<3h", _i16(now.roll_deg * 10.0), _i16(-now.pitch_deg * 10.0), _i16(now.yaw_deg % 360.0))


def _altitude(now: Snapshot) -> bytes:
    return struct.pack("<ih", _clamped(now.alt_m * 100.0, -(2**31), 2**31 - 1), _i16(now.climb_mps * 100.0))


def _analog(now: Snapshot) -> bytes:
    tenths, amperes = _clamped(now.voltage_v * 10.0, 0, 255), _i16(now.current_a * 100.0)
    return struct.pack("<BHHhH", tenths, _u16(now.used_mah), 0, amperes, _u16(now.voltage_v * 100.0))


_ANSWERS: Mapping[Function, Callable[[Snapshot], bytes]] = {
    Function.API_VERSION: lambda _now: bytes((PROTOCOL_VERSION, *API_VERSION)),
    Function.FC_VARIANT: lambda _now: VARIANT,
    Function.FC_VERSION: lambda _now: bytes(FIRMWARE_VERSION),
    Function.BOARD_INFO: lambda _now: BOARD + struct.pack("<H", 0),
    Function.NAME: lambda now: now.name.encode("ascii", "replace")[:16],
    Function.RAW_IMU: _raw_imu,
    Function.MOTOR: _motor,
    Function.RC: _rc,
    Function.RAW_GPS: _raw_gps,
    Function.ATTITUDE: _attitude,
    Function.ALTITUDE: _altitude,
    Function.ANALOG: _analog,
}

AETR = (0, 1, 3, 2)
"""MSP_RX_MAP: where roll, pitch, yaw and throttle are in MSP_SET_RAW_RC."""
_BOX_ANSWERS: Mapping[Function, Callable[[Sequence[Box]], bytes]] = {
    Function.BOX_NAMES: boxes.names,
    Function.BOX_IDS: boxes.ids,
    Function.MODE_RANGES: boxes.ranges,
    Function.RX_MAP: lambda _boxes: bytes(AETR),
}


class MspServer:
    def __init__(
        self,
        snapshot: Callable[[], Snapshot],
        on_sticks: Callable[[tuple[int, ...]], None],
        switches: Sequence[Box] = (),
    ) -> None:
        """`on_sticks` receives pulse lengths in microseconds: roll, pitch, throttle, yaw, switches."""
        self._switches = switches
        self._snapshot = snapshot
        self._on_sticks = on_sticks
        self._decoder = MspDecoder()

    def receive(self, data: bytes) -> bytes:
        """Returns the answers. Answers and errors that arrive are ignored."""
        requests = self._decoder.receive(data)
        return b"".join(self._answer(frame) for frame in requests if frame.direction is Direction.REQUEST)

    def _answer(self, request: MspFrame) -> bytes:
        payload = self._payload(request)
        direction = Direction.ERROR if payload is None else Direction.ANSWER
        return encode(MspFrame(request.version, direction, request.function, payload or b""))

    def _payload(self, request: MspFrame) -> bytes | None:
        """Returns None for what is unknown or makes no sense."""
        if request.function == Function.SET_RAW_RC:
            count, odd = divmod(len(request.payload), 2)
            if odd or not 0 < count <= MAX_STICKS:
                return None
            self._on_sticks(struct.unpack(f"<{count}H", request.payload))
            return b""
        if self._switches and request.function in _BOX_ANSWERS:
            return _BOX_ANSWERS[Function(request.function)](self._switches)
        if request.function == Function.STATUS:
            return _status(self._snapshot(), self._switches)
        try:
            answer = _ANSWERS[Function(request.function)]
        except (ValueError, KeyError):
            return None
        return answer(self._snapshot())
