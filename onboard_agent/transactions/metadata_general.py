"""What COMPONENT_METADATA (397) names: a file about other files, and among them that of the parameters. Pure.

Source: mavlink.io, services/component_information; general.schema.json. A CRC is that of MAVLink FTP (CRC-32 that
begins with 0 and is not inverted at the end), of the file as it lies there or as it is unpacked: PX4 gives the one for
its packed parameters, and the other for its packed general file.
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
"""COMPONENT_METADATA: milliseconds since boot, the CRC of the file, its address."""
_ADDRESS: Final = re.compile(r"mftp://(?:\[;comp=(\d{1,3})\])?([\x21-\x7e]+)", re.IGNORECASE)
_Address = Annotated[str, msgspec.Meta(max_length=1000)]


class MetadataUnusable(Exception):
    """What the vehicle offers is none, or cannot be had. Says why in words that follow on "the vehicle"."""


class MetadataDamaged(MetadataUnusable):
    """It may be whole when it is read again."""


@dataclass(frozen=True, slots=True)
class OfferedFile:
    """A file of the autopilot's. `crc`: None where it gives none."""

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
    """As MAVLink FTP and component metadata have it."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def file_at(address: str, crc: int | None) -> OfferedFile | None:
    """None where it does not lie on the autopilot: nothing is fetched from the internet, or of another component."""
    found = _ADDRESS.fullmatch(address)
    if found is None or int(found[1] or _AUTOPILOT_COMPONENT) != _AUTOPILOT_COMPONENT:
        return None
    path = found[2].encode("ascii")
    return OfferedFile(path, crc or None) if len(path) <= MAX_PATH_BYTES else None


def general_file(frame: bytes) -> OfferedFile | None:
    """What a whole COMPONENT_METADATA frame names; None where that does not lie on the autopilot."""
    _, crc, address = _MESSAGE.unpack(payload(frame).ljust(_MESSAGE.size, b"\0")[: _MESSAGE.size])
    return file_at(address.split(b"\0", 1)[0].decode("latin-1"), crc)


def parameters_file(general: bytes) -> OfferedFile:
    """The file about the parameters. Raises MetadataUnusable."""
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
