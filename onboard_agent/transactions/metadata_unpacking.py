"""Converts the bytes of a vehicle's file to the form for the tower, in small steps. No I/O.

Each function is a generator that does a small part of the work per step and returns the result, because it shares a
thread with sticks and holds. A file is untrusted input: the output is bounded, and so is the memory for it.
Raises MetadataUnusable.
"""

import zlib
from collections.abc import Generator
from types import ModuleType
from typing import Any, Final

import msgspec

from onboard_agent.transactions.metadata_general import MetadataDamaged, MetadataUnusable, mavlink_crc32
from wire.parameter_metadata import (
    MAX_COMMAS,
    MAX_PACKED_BYTES,
    MAX_PARAMETERS,
    MAX_TEXT_BYTES,
    VERSION,
    MetadataEntry,
)

lzma: ModuleType | None
try:
    import lzma
except ImportError:  # Python was built without lzma
    lzma = None

MAX_GENERAL_BYTES: Final = 64 * 1024
MAX_UNPACKER_BYTES: Final = 80 * 1024 * 1024
"""PX4 packs with a dictionary of 64 MiB; only as much of it is touched as there is output."""
STEP_BYTES: Final = 64 * 1024
STEP_ENTRIES: Final = 64

_MAGIC: Final = b"\xfd7zXZ\0"
_GZIP: Final = 31
_TOO_LARGE: Final = "has a file of metadata that is too large"
_NOT_THE_FORM: Final = "has metadata of its parameters that is not in the form of version 1"

Steps = Generator[None, None, bytes]


class _File(msgspec.Struct, frozen=True):
    version: int
    parameters: list[msgspec.Raw]


_file_decoder: Final = msgspec.json.Decoder(_File)
_entry_decoder: Final = msgspec.json.Decoder(MetadataEntry)
_encoder: Final = msgspec.json.Encoder()


def unpacked(data: bytes, crc: int | None, *, max_bytes: int) -> Steps:
    """The text of a file, unpacked if it is xz. `crc`: of the file, packed or not; None: not given."""
    text = data
    if data.startswith(_MAGIC):
        text = yield from _out_of_xz(data, max_bytes)
    if len(text) > max_bytes:
        raise MetadataUnusable(_TOO_LARGE)
    if crc is not None and crc not in (mavlink_crc32(data), mavlink_crc32(text)):
        raise MetadataDamaged("has a file of metadata that is damaged: its CRC is another")
    return text


def packed_parameters(data: bytes, crc: int | None) -> Steps:
    """Packs the parameters of a file that match `wire.parameter_metadata`, in the form for the tower."""
    text = yield from unpacked(data, crc, max_bytes=MAX_TEXT_BYTES)
    if text.count(b",") > MAX_COMMAS:
        raise MetadataUnusable(_TOO_LARGE)
    try:
        entries = _file_decoder.decode(text).parameters
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise MetadataUnusable(_NOT_THE_FORM) from None
    yield
    packer = zlib.compressobj(6, zlib.DEFLATED, _GZIP)
    out = packer.compress(b'{"version":%d,"parameters":[' % VERSION)
    count = 0
    for at, raw in enumerate(entries):
        if at % STEP_ENTRIES == STEP_ENTRIES - 1:
            yield
        entry = _entry(raw)
        if entry is not None and count < MAX_PARAMETERS:
            out += packer.compress((b"," if count else b"") + _encoder.encode(entry))
            count += 1
    out += packer.compress(b"]}") + packer.flush()
    if not count:
        raise MetadataUnusable(_NOT_THE_FORM)
    if len(out) > MAX_PACKED_BYTES:
        raise MetadataUnusable(_TOO_LARGE)
    return out


def _entry(raw: msgspec.Raw) -> MetadataEntry | None:
    """Returns None for an invalid entry; the others are still useful."""
    try:
        return _entry_decoder.decode(raw)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None


def _out_of_xz(data: bytes, max_bytes: int) -> Steps:
    if lzma is None:
        raise MetadataUnusable("has metadata packed with xz, which this computer cannot unpack")
    unpacker: Any = lzma.LZMADecompressor(lzma.FORMAT_XZ, MAX_UNPACKER_BYTES)
    out = bytearray()
    try:
        out += unpacker.decompress(data, STEP_BYTES)
        while not unpacker.eof:
            if len(out) > max_bytes:
                raise MetadataUnusable(_TOO_LARGE)
            if unpacker.needs_input:
                raise MetadataDamaged("has a file of metadata that is cut off")
            yield
            out += unpacker.decompress(b"", STEP_BYTES)
    except lzma.LZMAError:
        raise MetadataDamaged("has a file of metadata that is damaged: xz cannot unpack it") from None
    return bytes(out)
