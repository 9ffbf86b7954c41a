"""Component metadata about the vehicle's parameters, served as files over MAVLink FTP.

Source: mavlink.io, services/component_information, general.schema.json and parameter.schema.json. As in PX4, the
parameter file is compressed with xz and its CRC covers the compressed bytes; the CRC in COMPONENT_METADATA covers the
text of the general file.
"""

from __future__ import annotations

import json
import lzma
import zlib
from collections.abc import Set
from typing import Any

from simulator.dialect import ComponentMetadata
from simulator.failure_modes import Failure
from simulator.metadata_facts import facts_of
from simulator.parameters import Kind, Parameters

GENERAL = "etc/extras/general.json"
PARAMETERS = "etc/extras/parameters.json.xz"
PARAMETER_TYPE = 1
"""COMP_METADATA_TYPE_PARAMETER."""
_TYPES = {Kind.INT8: "Int8", Kind.INT16: "Int16", Kind.INT32: "Int32", Kind.FLOAT: "Float"}


def mavlink_crc32(data: bytes) -> int:
    """Returns a CRC-32 with initial value 0 and no final inversion."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


class ComponentFiles:
    """`missing`, `damaged`: faults of the parameter file. The files are generated on the first request."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._files: dict[bytes, bytes] = {}
        self._general_crc = 0
        self.missing = False
        self.damaged = False

    def suffer(self, failures: Set[Failure]) -> None:
        self.missing = Failure.METADATA_MISSING in failures
        self.damaged = Failure.METADATA_DAMAGED in failures

    def named(self, time_boot_ms: int) -> ComponentMetadata:
        self._make()
        return ComponentMetadata(time_boot_ms, self._general_crc, f"mftp://{GENERAL}".encode())

    def file(self, name: bytes) -> bytes | None:
        self._make()
        content = self._files.get(name)
        if name != PARAMETERS.encode() or content is None:
            return content
        if self.missing:
            return None
        at = len(content) // 2
        return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :] if self.damaged else content

    def _make(self) -> None:
        if self._files:
            return
        packed = lzma.compress(json.dumps(parameter_document(self._parameters)).encode(), preset=1)
        offers = [{"type": PARAMETER_TYPE, "uri": f"mftp://{PARAMETERS}", "fileCrc": mavlink_crc32(packed)}]
        general = json.dumps({"version": 1, "vendorName": "tower-sim", "metadataTypes": offers}).encode()
        self._general_crc = mavlink_crc32(general)
        self._files = {GENERAL.encode(): general, PARAMETERS.encode(): packed}


def parameter_document(parameters: Parameters) -> dict[str, Any]:
    """Returns COMP_METADATA_TYPE_PARAMETER, version 1: type and default of each, and how the simulator uses some."""
    defaults = {name: value for name, _, value in parameters.table}
    entries = [
        {"name": one.name, "type": _TYPES[one.kind], "group": one.name.split("_")[0]}
        | ({"default": defaults[one.name]} if one.name in defaults else {})
        | facts_of(one.name)
        for one in parameters
    ]
    return {"version": 1, "parameters": entries}
