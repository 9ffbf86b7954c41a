"""Logs as other programs write them, made here: ArduPilot's dataflash and PX4's ULog of one short flight.

The drone stands for `TAKE_OFF_S`, climbs at 2 m/s and flies north at 5 m/s, armed all the while.
"""

import math
import struct
from collections.abc import Iterable, Sequence
from typing import Any, Final

HOME: Final = (47.3977, 8.5456)
HOME_MSL_M: Final = 488.0
BEGAN_S: Final = 1_780_000_000.0
"""Of boot, by UTC."""
TAKE_OFF_S: Final = 5.0
CLIMB_M_S: Final = 2.0
SPEED_M_S: Final = 5.0
YAW_DEG: Final = 90.0
ROLL_DEG: Final = 10.0
GPS_EPOCH_S: Final = 315_964_800
WEEK_S: Final = 604_800
LEAP_S: Final = 18
LONG_TEXT: Final = "PreArm: a text that is longer than the fifty bytes of one status text, and goes on"


def place(at_s: float) -> tuple[float, float, float]:
    """Latitude, longitude, and height above home."""
    flown_s = max(0.0, at_s - TAKE_OFF_S)
    return HOME[0] + SPEED_M_S * flown_s / 111_319.49, HOME[1], CLIMB_M_S * flown_s


DATAFLASH: Final = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "MSG": (129, "QZ", "TimeUS,Message"),
    "MODE": (130, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ARM": (131, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
    "ATT": (132, "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF"),
    "POS": (133, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "GPS": (134, "QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"),
    "BAT": (135, "QBfffffcfB", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct"),
    "RCIN": (136, "QHHHH", "TimeUS,C1,C2,C3,C4"),
    "XKF1": (137, "QBfff", "TimeUS,C,VN,VE,VD"),
    "ORGN": (138, "QBLLe", "TimeUS,Type,Lat,Lng,Alt"),
    "RARE": (139, "Qd", "TimeUS,Nobody"),
}
_LETTERS: Final = {"M": "B", "n": "4s", "N": "16s", "Z": "64s", "L": "i", "c": "h", "e": "i"}


def dataflash_message(name: str, *values: Any) -> bytes:
    number, letters, _ = DATAFLASH[name]
    raw = [
        round(value * 1e7) if letter == "L" else round(value * 100) if letter in "ce" else value
        for letter, value in zip(letters, values, strict=True)
    ]
    packed = struct.pack("<" + "".join(_LETTERS.get(letter, letter) for letter in letters), *raw)
    return b"\xa3\x95" + bytes((number,)) + packed


def dataflash_formats() -> bytes:
    out = b""
    for name, (number, letters, labels) in DATAFLASH.items():
        size = 3 + struct.calcsize("<" + "".join(_LETTERS.get(letter, letter) for letter in letters))
        out += dataflash_message("FMT", number, size, name.encode(), letters.encode(), labels.encode())
    return out


def dataflash_log(lasts_s: float = 30.0, *, has_gps: bool = True) -> bytes:
    """With positions 10 times and attitudes 50 times a second."""
    out = [dataflash_formats()]

    def put(name: str, at_s: float, *values: Any) -> None:
        out.append(dataflash_message(name, round(at_s * 1e6), *values))

    put("MSG", 1.0, b"ArduPlane V4.6.0 (1234abcd)")
    put("MODE", 1.0, 10, 10, 1)
    put("ORGN", 1.0, 1, *HOME, HOME_MSL_M)
    put("ARM", 2.0, 1, 0, 0, 0)
    put("MSG", 2.0, LONG_TEXT[:64].encode())
    for step in range(round(50 * 2.0), round(50 * lasts_s)):
        at_s = step / 50
        lat, lon, height = place(at_s)
        put("ATT", at_s, 0, ROLL_DEG, 0, -3.0, 0, YAW_DEG, 3)
        put("RARE", at_s, 1.0)
        if step % 5 == 0:
            flies = height > 0
            put("XKF1", at_s, 0, SPEED_M_S * flies, 0, -CLIMB_M_S * flies)
            put("XKF1", at_s, 1, 99.0, 99.0, 99.0)  # another core of the estimator
            put("POS", at_s, lat, lon, HOME_MSL_M + height, height, height)
            put("RCIN", at_s, 1500, 1501, 1502, 1503)
            put("BAT", at_s, 0, 16.2, 16.2, 12.5, 0, 0, 0, 0, 81)
        if step % 10 == 0 and has_gps:
            gps_s = BEGAN_S + at_s - GPS_EPOCH_S + LEAP_S
            week, second = divmod(gps_s, WEEK_S)
            first = round(second * 1000), int(week), 14, 0.8, lat, lon, HOME_MSL_M + height, SPEED_M_S, 0, 0, 0, 1
            put("GPS", at_s, 0, 3, *first)
            put("GPS", at_s, 1, 3, *first[:4], 0.0, 0.0, 0.0, 0, 0, 0, 0, 0)  # a second receiver, in the sea
    put("MODE", lasts_s, 11, 11, 1)
    put("ARM", lasts_s, 0, 0, 0, 0)
    return b"".join(out)


ULOG: Final = {
    "inner": "float nobody;uint8_t[3] what",
    "vehicle_status": "uint64_t timestamp;inner[2] ignored;uint8_t arming_state;uint8_t nav_state;uint8_t system_type",
    "vehicle_attitude": "uint64_t timestamp;float[4] q;uint8_t quat_reset_counter;uint8_t[7] _padding0",
    "vehicle_global_position": "uint64_t timestamp;double lat;double lon;float alt",
    "vehicle_local_position": "uint64_t timestamp;float vx;float vy;float vz;float z",
    "sensor_gps": "uint64_t timestamp;uint64_t time_utc_usec;double latitude_deg;double longitude_deg;"
    "double altitude_msl_m;float hdop;float vel_m_s;float cog_rad;uint8_t fix_type;uint8_t satellites_used",
    "battery_status": "uint64_t timestamp;float voltage_v;float current_a;float remaining",
    "home_position": "uint64_t timestamp;double lat;double lon;float alt",
    "input_rc": "uint64_t timestamp;uint16_t[18] values;uint8_t channel_count",
    "vehicle_land_detected": "uint64_t timestamp;bool landed",
    "nobodys_topic": "uint64_t timestamp;float x",
}
_CODES: Final = {"vehicle_status": "Q14xBBB", "vehicle_attitude": "Q4fB", "vehicle_global_position": "Qddf"} | {
    "vehicle_local_position": "Qffff",
    "sensor_gps": "QQdddfffBB",
    "battery_status": "Qfff",
    "home_position": "Qddf",
    "input_rc": "Q18HB",
    "vehicle_land_detected": "Q?",
    "nobodys_topic": "Qf",
}


def ulog_message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog_log(lasts_s: float = 30.0, *, has_gps: bool = True, flags: bytes = bytes(40)) -> bytes:
    """With positions 10 times and attitudes 50 times a second."""
    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000), ulog_message("B", flags)]
    out += [ulog_message("F", f"{name}:{fields};".encode()) for name, fields in ULOG.items()]
    numbers = {name: number for number, name in enumerate(_CODES)}
    out += [ulog_message("A", struct.pack("<BH", 0, number) + name.encode()) for name, number in numbers.items()]
    out.append(ulog_message("A", struct.pack("<BH", 1, 99) + b"battery_status"))

    def put(name: str, at_s: float, *values: Any, number: int | None = None) -> None:
        body = struct.pack("<" + _CODES[name], round(at_s * 1e6), *values)
        out.append(ulog_message("D", struct.pack("<H", numbers[name] if number is None else number) + body))

    put("home_position", 1.0, *HOME, HOME_MSL_M)
    put("vehicle_status", 1.0, 1, 4, 13)
    put("vehicle_status", 2.0, 2, 4, 13)
    out.append(ulog_message("L", b"4" + struct.pack("<Q", 2_000_000) + LONG_TEXT.encode()))
    half = math.radians(YAW_DEG) / 2
    for step in range(round(50 * 2.0), round(50 * lasts_s)):
        at_s = step / 50
        lat, lon, height = place(at_s)
        put("vehicle_attitude", at_s, math.cos(half), 0, 0, math.sin(half), 0)
        put("nobodys_topic", at_s, 1.0)
        if step % 5 == 0:
            flies = height > 0
            put("vehicle_local_position", at_s, SPEED_M_S * flies, 0, -CLIMB_M_S * flies, -height)
            put("vehicle_global_position", at_s, lat, lon, HOME_MSL_M + height)
            put("input_rc", at_s, *range(1500, 1518), 8)
            put("battery_status", at_s, 16.2, 12.5, 0.81)
            put("battery_status", at_s, 1.0, 1.0, 0.01, number=99)
        if step % 10 == 0 and has_gps:
            utc_us = round((BEGAN_S + at_s) * 1e6)
            put("sensor_gps", at_s, utc_us, lat, lon, HOME_MSL_M + height, 0.8, SPEED_M_S, 0, 3, 14)
            put("vehicle_land_detected", at_s, height == 0)
    put("vehicle_status", lasts_s, 2, 5, 13)
    return b"".join(out)


def middle_replaced(log: bytes, junk: Sequence[int] | Iterable[int]) -> bytes:
    """A torn place in the middle of a log."""
    junk = bytes(junk)
    at = len(log) // 2
    return log[:at] + junk + log[at + len(junk) :]
