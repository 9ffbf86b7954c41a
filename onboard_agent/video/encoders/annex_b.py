"""H.264 as a sequence of NAL units with start codes (ITU-T H.264, annex B; no I/O)."""

import re
from typing import Final

_START_CODE: Final = re.compile(rb"\x00\x00\x01")

IDR: Final = 5
SEQUENCE_PARAMETERS: Final = 7
PICTURE_PARAMETERS: Final = 8


def nal_types(stream: bytes) -> list[int]:
    """The types of the NAL units, in order."""
    return [stream[found.end()] & 0x1F for found in _START_CODE.finditer(stream) if found.end() < len(stream)]


def with_parameter_sets(access_unit: bytes, parameter_sets: bytes) -> bytes:
    """Returns the access unit with the parameter sets in front, unless it has its own. Raises ValueError if it is not
    annex B, or if no parameter sets are available."""
    types = nal_types(access_unit)
    if not types:
        raise ValueError("H.264 without start codes")
    if SEQUENCE_PARAMETERS in types and PICTURE_PARAMETERS in types:
        return access_unit
    known = nal_types(parameter_sets)
    if SEQUENCE_PARAMETERS not in known or PICTURE_PARAMETERS not in known:
        raise ValueError("H.264 without parameter sets")
    return parameter_sets + access_unit
