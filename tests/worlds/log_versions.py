"""Logs in the forms that other versions of ArduPilot and PX4 write: made here, after the structure of real ones."""

import struct
from collections.abc import Iterable, Mapping
from typing import Any, Final

_LETTERS: Final = {"M": "B", "n": "4s", "N": "16s", "Z": "64s", "L": "i", "c": "h", "C": "H", "e": "i", "E": "I"}
_HUNDREDTHS: Final = "cCeE"
Row = tuple[Any, ...]


def dataflash(formats: Mapping[str, tuple[str, str]], rows: Iterable[Row]) -> bytes:
    """`formats`: letters and labels by name. `rows`: a name, then its values in the units of the log."""
    numbers = {name: 130 + at for at, name in enumerate(formats)}
    out = [_format(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    out += [_format(numbers[name], name, *formats[name]) for name in formats]
    for name, *values in rows:
        letters = formats[name][0]
        raw = [
            round(value * 1e7) if letter == "L" else round(value * 100) if letter in _HUNDREDTHS else value
            for letter, value in zip(letters, values, strict=True)
        ]
        out.append(b"\xa3\x95" + bytes((numbers[name],)) + struct.pack(_codes(letters), *raw))
    return b"".join(out)


def _codes(letters: str) -> str:
    return "<" + "".join(_LETTERS.get(letter, letter) for letter in letters)


def _format(number: int, name: str, letters: str, labels: str) -> bytes:
    size = 3 + struct.calcsize(_codes(letters))
    body = struct.pack("<BB4s16s64s", number, size, name.encode(), letters.encode(), labels.encode())
    return b"\xa3\x95\x80" + body


COPTER_3_2: Final = {
    "GPS": ("BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T"),
    "CURR": ("IhIhhhf", "TimeMS,ThrOut,ThrInt,Volt,Curr,Vcc,CurrTot"),
    "MODE": ("Mh", "Mode,ThrCrs"),
    "EV": ("B", "Id"),
    "MSG": ("Z", "Message"),
    "ATT": ("IccccCCCC", "TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw"),
    "IMU": ("Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    "EKF1": ("IccCffffffccc", "TimeMS,Roll,Pitch,Yaw,VN,VE,VD,PN,PE,PD,GX,GY,GZ"),
    "RCOU": ("Ihhhhhhhh", "TimeMS,Chan1,Chan2,Chan3,Chan4,Chan5,Chan6,Chan7,Chan8"),
    "CTUN": ("Ihhhffecchh", "TimeMS,ThrIn,AngBst,ThrOut,DAlt,Alt,BarAlt,DSAlt,SAlt,DCRt,CRt"),
}
"""ArduCopter 3.2: milliseconds, GPS time beside the time since boot, and messages without a time."""

CURRENT: Final = {
    "MSG": ("QBBZ", "TimeUS,ID,Seq,Message"),
    "RTC": ("QQB", "TimeUS,Epoch,SourceType"),
    "ATT": ("QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF"),
    "POS": ("QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "NKF1": ("QBfff", "TimeUS,C,VN,VE,VD"),
    "XKF1": ("QBfff", "TimeUS,C,VN,VE,VD"),
    "XKF4": ("QBb", "TimeUS,C,PI"),
    "RCIN": ("Q" + "H" * 14, "TimeUS," + ",".join(f"C{number}" for number in range(1, 15))),
    "RCI2": ("QHHHB", "TimeUS,C15,C16,OMask,Flags"),
    "RCOU": ("Q" + "H" * 14, "TimeUS," + ",".join(f"C{number}" for number in range(1, 15))),
    "RCO2": ("QHHHH", "TimeUS,C15,C16,C17,C18"),
}
"""ArduPilot 4.7: texts in pieces, a clock, several cores of the estimator, channels from 15 on apart."""

PLANE: Final = {
    "MSG": ("QBBZ", "TimeUS,ID,Seq,Message"),
    "CTUN": ("QccccffffBfi", "TimeUS,NavRoll,Roll,NavPitch,Pitch,ThO,RdO,ThD,As,AsT,E2T,GU"),
    "POS": ("QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "ARSP": ("QBf", "TimeUS,I,Airspeed"),
}


class Ulog:
    """A log that is written message by message. `formats`: fields and codes of `struct` by topic."""

    def __init__(
        self, formats: Mapping[str, tuple[str, str]], *, began_us: int = 1_000_000, flags: bytes = bytes(40)
    ) -> None:
        self._codes = {name: "<" + codes for name, (_, codes) in formats.items()}
        self._numbers = {name: number for number, name in enumerate(formats)}
        self.log = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", began_us))
        self.message("B", flags)
        for name, (fields, _) in formats.items():
            self.message("F", f"{name}:{fields};".encode())
        for name, number in self._numbers.items():
            self.message("A", struct.pack("<BH", 0, number) + name.encode())

    def message(self, kind: str, body: bytes) -> None:
        self.log += struct.pack("<HB", len(body), ord(kind)) + body

    def put(self, name: str, *values: Any) -> None:
        self.message("D", struct.pack("<H", self._numbers[name]) + struct.pack(self._codes[name], *values))


PX4_ATTITUDE_1_7: Final = (
    "uint64_t timestamp;float rollspeed;float pitchspeed;float yawspeed;float[4] q;uint8_t[4] _padding0",
    "Q7f",
)
PX4_LOCAL: Final = (
    "uint64_t timestamp;double ref_lat;double ref_lon;float x;float y;float z;float vx;float vy;float vz;"
    "float ref_alt;bool xy_global;bool z_global",
    "Qdd7f??",
)
PX4_GPS_1_13: Final = (
    "uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;int32_t lon;int32_t alt;float hdop;float vel_m_s;"
    "float cog_rad;int32_t timestamp_time_relative;uint8_t fix_type;uint8_t satellites_used",
    "QQiiifffiBB",
)
PX4_BATTERY: Final = ("uint64_t timestamp;float voltage_v;float current_a;float remaining", "Qfff")
PX4_HOME: Final = ("uint64_t timestamp;double lat;double lon;float alt;bool valid_alt;bool valid_hpos", "Qddf??")
PX4_STATUS: Final = ("uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;uint8_t system_type", "QBBB")
