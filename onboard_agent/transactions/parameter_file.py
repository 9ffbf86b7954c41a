"""Parses ArduPilot's `@PARAM/param.pck`: all parameters, packed. Pure.

Source: ArduPilot, AP_Filesystem_Param. A header of three 16-bit numbers (a magic, the number of parameters in the file,
the number in total), then for each parameter: kind, length of the prefix shared with the previous name, rest of the
name, value. Zero bytes between parameters are padding.
"""

from dataclasses import dataclass
from math import isfinite
from struct import Struct
from typing import Final

from onboard_agent.transactions.parameter_encoding import NAME
from wire.parameters import MAX_ENTRIES, Parameter

FILE_NAME: Final = b"@PARAM/param.pck"

_MAGIC: Final = 0x671B
_HEAD: Final = Struct("<HHH")
_VALUES: Final = {1: Struct("<b"), 2: Struct("<h"), 3: Struct("<i"), 4: Struct("<f")}
"""By AP_PARAM_TYPE."""
_KINDS: Final = {1: 2, 2: 4, 3: 6, 4: 9}
"""MAV_PARAM_TYPE of each, as in its PARAM_VALUE."""
_FLOAT: Final = Struct("<f")


class BadParameterFile(ValueError):
    """The bytes are not a complete parameter file; the file may have changed while it was read."""


@dataclass(frozen=True, slots=True)
class PackedParameters:
    """`count`: as the autopilot counts them. `parameters` leaves out those whose value is not a number."""

    count: int
    parameters: tuple[Parameter, ...]


def read_count(head: bytes) -> int:
    """Reads the number of parameters from the header; 0 if there is none."""
    if len(head) < _HEAD.size:
        return 0
    magic, _, total = _HEAD.unpack_from(head)
    return int(total) if magic == _MAGIC else 0


def read_parameter_file(data: bytes) -> PackedParameters:
    """Raises BadParameterFile unless every parameter is present exactly once."""
    count = read_count(data)
    if not 0 < count <= MAX_ENTRIES or _HEAD.unpack_from(data)[1] != count:
        raise BadParameterFile("the head of the file is wrong")
    found: dict[str, Parameter | None] = {}
    name, at = "", _HEAD.size
    while at < len(data):
        if data[at] == 0:
            at += 1
            continue
        name, kind, value, at = _entry(data, at, name)
        if name in found:
            raise BadParameterFile(f"{name} is there twice")
        found[name] = Parameter(name, value, kind) if isfinite(value) else None
    if len(found) != count:
        raise BadParameterFile(f"{len(found)} of {count} parameters are in the file")
    return PackedParameters(count, tuple(one for one in found.values() if one is not None))


def _entry(data: bytes, at: int, before: str) -> tuple[str, int, float, int]:
    """Returns name, kind and value of the entry at `at`, and where it ends."""
    kind, lengths = data[at], data[at + 1] if at + 1 < len(data) else 0
    layout = _VALUES.get(kind)
    common, rest = lengths & 0x0F, (lengths >> 4) + 1
    end = at + 2 + rest
    if layout is None or common > len(before) or end + layout.size > len(data):
        raise BadParameterFile(f"an entry at byte {at} is broken")
    name = before[:common] + data[at + 2 : end].decode("ascii", "replace")
    if not NAME.fullmatch(name):
        raise BadParameterFile(f"a name at byte {at} is broken")
    (value,) = layout.unpack_from(data, end)
    # Convert as PARAM_VALUE does, so that both ways give the same table.
    return name, _KINDS[kind], float(_FLOAT.unpack(_FLOAT.pack(value))[0]), end + layout.size
