"""Encoding of a parameter: reads PARAM_VALUE, builds PARAM_SET, and rejects values that cannot be sent. Pure.

Every value travels in the four bytes of a float. ArduPilot casts the number to a float; PX4 copies the bytes of an
integer there. This module reads and writes the bytes directly: a Python float would corrupt some of PX4's integers,
those with the bytes of a signalling NaN.
"""

import re
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite
from struct import Struct, error
from typing import Any, Final

from onboard_agent.autopilot.parameters import INTEGERS
from wire.autopilots.registry import FAMILIES
from wire.dialect import CRC_EXTRA, mavlink
from wire.frames import payload
from wire.parameters import Parameter

UNNUMBERED: Final = 0xFFFF
"""The index of a value that is not sent as part of a list."""
HASH_NAME: Final = "_HASH_CHECK"
"""PX4: not a parameter but the hash of all parameters, sent and requested like one."""

_VALUE: Final = Struct("<4sHH16sB")
_SET: Final = Struct("<4sBB16sB")
_AUTOPILOT_COMPONENT: Final = 1
NAME: Final = re.compile("[A-Za-z0-9_]{1,16}")

_FLOAT_KIND: Final = 9
"""MAV_PARAM_TYPE. INTEGERS are 1 to 6; types 7, 8 and 10 do not fit into four bytes."""
_FLOAT: Final = Struct("<f")
_RANGES: Final = {
    1: (0, 255),
    2: (-128, 127),
    3: (0, 65535),
    4: (-32768, 32767),
    5: (0, 2**32 - 1),
    6: (-(2**31), 2**31 - 1),
}


def words_of(value: float) -> str:
    """Returns the shortest decimal that an autopilot reads as this value: 4.3 for 4.30000019."""
    for digits in range(6, 9):
        text = f"{value:.{digits}g}"
        if _FLOAT.pack(float(text)) == _FLOAT.pack(value):
            return text
    return f"{value:.9g}"


class Encoding(StrEnum):
    """How an integer is stored in the four bytes."""

    CAST = "cast"
    BYTES = "bytes"


def encoding_of(autopilot_kind: int, capabilities: int) -> Encoding:
    """`capabilities`: of AUTOPILOT_VERSION, 0 if unknown. If they do not say, PX4 is taken to copy bytes."""
    if capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST:
        return Encoding.CAST
    if capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE:
        return Encoding.BYTES
    family = FAMILIES.get(autopilot_kind)
    return Encoding.BYTES if family is not None and family.bytes_in_parameters else Encoding.CAST


@dataclass(frozen=True, slots=True)
class ParamValue:
    """The content of a PARAM_VALUE. `count`: number of parameters in the autopilot's list. `parameter`: None if a table
    cannot hold the name or the value (NaN, 64 bits, other characters in the name)."""

    name: str
    index: int
    count: int
    kind: int
    raw: bytes
    parameter: Parameter | None


def read_param_value(frame: bytes, encoding: Encoding) -> ParamValue:
    """`frame`: a whole PARAM_VALUE. The name may fill its 16 bytes without a terminating zero."""
    raw, count, index, name_bytes, kind = _VALUE.unpack_from(payload(frame).ljust(_VALUE.size, b"\0"))
    name = name_bytes.split(b"\0", 1)[0].decode("ascii", "replace")
    layout = INTEGERS.get(kind) if encoding is Encoding.BYTES else None
    value = float((layout or _FLOAT).unpack_from(raw)[0])
    good = NAME.fullmatch(name) and isfinite(value) and (kind in INTEGERS or kind == _FLOAT_KIND)
    return ParamValue(name, index, count, kind, raw, Parameter(name, value, kind) if good else None)


def as_kept(value: float, kind: int) -> float:
    """Returns the value that an autopilot stores: rounded to 32 bits unless the parameter is an integer."""
    return float(value) if kind in INTEGERS else float(_FLOAT.unpack(_FLOAT.pack(value))[0])


def why_not(value: float, kind: int, encoding: Encoding) -> str | None:
    """Returns a sentence if a parameter of this kind cannot be set to `value`."""
    if not isfinite(value):
        return "It takes a number."
    if kind == _FLOAT_KIND:
        try:
            _FLOAT.pack(value)
        except (OverflowError, error):
            return "The number is too large."
        return None
    if kind not in INTEGERS:
        return "It is of a kind that this protocol cannot carry."
    if value != int(value):
        return "Whole numbers only."
    lowest, highest = _RANGES[kind]
    if not lowest <= value <= highest:
        return f"It takes whole numbers from {lowest} to {highest}."
    if encoding is Encoding.CAST and _FLOAT.unpack(_FLOAT.pack(value))[0] != value:
        return "The autopilot's protocol cannot carry this number exactly."
    return None


class ParameterSetting:
    """A PARAM_SET with its bytes unchanged; packs like a message of the dialect."""

    def __init__(self, target_system: int, name: str, value: float, kind: int, encoding: Encoding) -> None:
        """`value`: `why_not` must return None for it."""
        layout = INTEGERS.get(kind) if encoding is Encoding.BYTES else None
        raw = _FLOAT.pack(value) if layout is None else layout.pack(int(value)).ljust(4, b"\0")
        self._payload = _SET.pack(raw, target_system, _AUTOPILOT_COMPONENT, name.encode("ascii"), kind)

    def pack(self, packer: Any) -> Any:
        """Packs in the way that `wire.dialect.build` expects."""
        number = mavlink.MAVLINK_MSG_ID_PARAM_SET
        return mavlink.MAVLink_message(number, "PARAM_SET")._pack(packer, CRC_EXTRA[number], self._payload)
