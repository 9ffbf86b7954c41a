"""All parameters in the format of ArduPilot's `@PARAM/param.pck` (AP_Filesystem_Param), for blocks of one size."""

from __future__ import annotations

import struct

from simulator.parameters import Kind, Parameters

MAGIC = 0x671B
_VALUES = {Kind.INT8: (1, "<b"), Kind.INT16: (2, "<h"), Kind.INT32: (3, "<i"), Kind.FLOAT: (4, "<f")}
"""ArduPilot's number of each type, and its layout."""
MAX_COMMON_CHARS = 15


def pack_parameters(parameters: Parameters, block_bytes: int) -> bytes:
    """Pads with zero bytes, so that no value crosses a block boundary."""
    packed = bytearray(struct.pack("<HHH", MAGIC, len(parameters), len(parameters)))
    before = b""
    for parameter in parameters:
        name = parameter.name.encode("ascii")
        common = 0
        while common < min(len(before), len(name) - 1, MAX_COMMON_CHARS) and before[common] == name[common]:
            common += 1
        kind, layout = _VALUES[parameter.kind]
        value = struct.pack(layout, parameter.value if parameter.kind is Kind.FLOAT else int(parameter.value))
        entry = bytes([kind, common | (len(name) - common - 1) << 4]) + name[common:] + value
        over = (len(packed) + len(entry)) % block_bytes
        if 0 < over < len(value):
            packed += bytes(len(value) - over)
        packed += entry
        before = name
    return bytes(packed)
