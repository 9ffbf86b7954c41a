"""Parses the general metadata file that COMPONENT_METADATA (397) names, and finds the parameters' file in it. Pure.

Source: mavlink.io, services/component_information; general.schema.json. A CRC is that of MAVLink FTP (CRC-32 that
begins with 0 and is not inverted at the end), either of the file as stored or as unpacked: PX4 gives the former for its
packed parameters, and the latter for its packed general file.
"""

import re
import zlib
from dataclasses import dataclass
from struct import Struct
from typing import Annotated, Final

import msgspec

from wire.frames import payload

PARAMETERS: Final = 1
"""COMP_METADATA_TYPE_PARAMETER."""
MAX_PATH_BYTES: Final = 200
_AUTOPILOT_COMPONENT: Final = 1
_MESSAGE: Final = Struct("<II100s")
"""COMPONENT_METADATA: milliseconds since boot, CRC of the file, address of the file."""
_ADDRESS: Final = re.compile(r"mftp://(?:\[;comp=(\d{1,3})\])?([\x21-\x7e]+)", re.IGNORECASE)
_Address = Annotated[str, msgspec.Meta(max_length=1000)]


class MetadataUnusable(Exception):
    """The vehicle offers no usable metadata. The message says why and follows on "the vehicle"."""


class MetadataDamaged(MetadataUnusable):
    """The file is damaged; a new read may succeed."""


@dataclass(frozen=True, slots=True)
class OfferedFile:
    """A file of the autopilot. `crc`: None if the vehicle gives none."""

    path: bytes
    crc: int | None


class _Offer(msgspec.Struct, frozen=True, rename="camel"):
    type: int
    uri: _Address
    file_crc: int | None = None
    uri_fallback: _Address = ""
    file_crc_fallback: int | None = None


class _General(msgspec.Struct, frozen=True, rename="camel"):
    version: Annotated[int, msgspec.Meta(ge=1)]
    metadata_types: Annotated[tuple[_Offer, ...], msgspec.Meta(max_length=100)]


_decoder: Final = msgspec.json.Decoder(_General)


def mavlink_crc32(data: bytes) -> int:
    """CRC-32 as used by MAVLink FTP and component metadata."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def file_at(address: str, crc: int | None) -> OfferedFile | None:
    """Returns None for a file elsewhere than on the autopilot: other components and the internet are not accessed."""
    found = _ADDRESS.fullmatch(address)
    if found is None or int(found[1] or _AUTOPILOT_COMPONENT) != _AUTOPILOT_COMPONENT:
        return None
    path = found[2].encode("ascii")
    return OfferedFile(path, crc or None) if len(path) <= MAX_PATH_BYTES else None


def general_file(frame: bytes) -> OfferedFile | None:
    """The file that a COMPONENT_METADATA frame names; None if the file is not on the autopilot."""
    _, crc, address = _MESSAGE.unpack(payload(frame).ljust(_MESSAGE.size, b"\0")[: _MESSAGE.size])
    return file_at(address.split(b"\0", 1)[0].decode("latin-1"), crc)


def parameters_file(general: bytes) -> OfferedFile:
    """The file that describes the parameters. Raises MetadataUnusable."""
    try:
        offers = _decoder.decode(general).metadata_types
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise MetadataUnusable("has a general file of metadata that is not in the form of version 1") from None
    for one in offers:
        if one.type == PARAMETERS:
            first = file_at(one.uri, one.file_crc)
            found = first or file_at(one.uri_fallback, one.file_crc_fallback)
            if found is None:
                raise MetadataUnusable("names metadata of its parameters that is not on board: it is not fetched")
            return found
    raise MetadataUnusable("has no metadata of its parameters")
