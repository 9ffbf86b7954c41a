"""A vehicle's metadata about its own parameters: file format, packed bytes, and the messages that carry it. No I/O.

The format is that of MAVLink's component metadata, COMP_METADATA_TYPE_PARAMETER, version 1 (mavlink.io, services/
component_information; parameter.schema.json). An agent reads the vehicle's file, leaves out what does not match this
format, and sends the rest gzipped, in pieces. Neither side sends any of these messages unless the other has listed
PARAMETER_METADATA in its hello or welcome.
"""

import zlib
from hashlib import sha256
from typing import Annotated, Final

import msgspec

PARAMETER_METADATA: Final = "parameter_metadata"
"""The entry in `takes` of hello and welcome for the messages of this module."""

MAX_PACKED_BYTES: Final = 256 * 1024
MAX_TEXT_BYTES: Final = 3 * 1024 * 1024
"""Unpacked: twice the metadata of PX4's 1,800 parameters."""
MAX_PARAMETERS: Final = 8192
MAX_COMMAS: Final = 400_000
"""In the text. A list of single characters would need fifty times its size while it is read."""
MAX_PIECE_BYTES: Final = 12_000
"""16 kB in base64, so that messages queued behind it on a slow link do not wait long."""
VERSION: Final = 1

_GZIP: Final = 31
"""`wbits` for zlib. The header has no time stamp: the same text has the same bytes."""
_NO_METADATA: Final = "no metadata of parameters"

Hash = Annotated[str, msgspec.Meta(min_length=16, max_length=16)]
_Title = Annotated[str, msgspec.Meta(max_length=400)]
_Text = Annotated[str, msgspec.Meta(max_length=8000)]


class MetadataChoice(msgspec.Struct, frozen=True):
    """A named value of a parameter."""

    value: float
    description: _Title


class MetadataBit(msgspec.Struct, frozen=True):
    """A bit of a bit-mask parameter. `index`: 0 is the lowest."""

    index: Annotated[int, msgspec.Meta(ge=0, le=63)]
    description: _Title


class MetadataEntry(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """One parameter, or a numbered family (`{n}` in its name). Absent fields are not known."""

    name: Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.{}-]{1,20}$")]
    type: Annotated[str, msgspec.Meta(max_length=16)] = ""
    short_desc: _Title = ""
    long_desc: _Text = ""
    units: Annotated[str, msgspec.Meta(max_length=40)] = ""
    default: float | None = None
    decimal_places: Annotated[int, msgspec.Meta(ge=0, le=20)] | None = None
    min: float | None = None
    max: float | None = None
    increment: float | None = None
    reboot_required: bool = False
    group: _Title = ""
    category: _Title = ""
    volatile: bool = False
    read_only: bool = False
    values: Annotated[tuple[MetadataChoice, ...], msgspec.Meta(max_length=1024)] = ()
    bitmask: Annotated[tuple[MetadataBit, ...], msgspec.Meta(max_length=64)] = ()


class MetadataDocument(msgspec.Struct, frozen=True, kw_only=True):
    """All metadata of a vehicle's parameters."""

    version: int = VERSION
    parameters: Annotated[tuple[MetadataEntry, ...], msgspec.Meta(max_length=MAX_PARAMETERS)]


class MetadataKnown(msgspec.Struct, frozen=True, tag="parameter_metadata", tag_field="type", kw_only=True):
    """Agent to tower, on each link and on each change. `hash`: of the packed bytes; `size_bytes`: their length. None:
    there is no metadata, and `words` gives the reason. A tower that lacks it requests it with MetadataWanted."""

    hash: Hash | None
    size_bytes: Annotated[int, msgspec.Meta(ge=0, le=MAX_PACKED_BYTES)] = 0
    words: Annotated[str, msgspec.Meta(max_length=300)] = ""


class MetadataPiece(msgspec.Struct, frozen=True, tag="parameter_metadata_piece", tag_field="type", kw_only=True):
    """Agent to tower: the bytes from `offset` on, in order."""

    hash: Hash
    offset: Annotated[int, msgspec.Meta(ge=0, le=MAX_PACKED_BYTES)]
    data: Annotated[bytes, msgspec.Meta(min_length=1, max_length=MAX_PIECE_BYTES)]


class MetadataWanted(msgspec.Struct, frozen=True, tag="parameter_metadata_wanted", tag_field="type", kw_only=True):
    """Tower to agent: send the pieces of this metadata, from the first on."""

    hash: Hash


MetadataToTower = MetadataKnown | MetadataPiece

_encoder: Final = msgspec.json.Encoder()
_decoder: Final = msgspec.json.Decoder(MetadataDocument)


def metadata_hash(packed: bytes) -> str:
    """Returns 16 hexadecimal digits: the first 8 bytes of SHA-256."""
    return sha256(packed).hexdigest()[:16]


def encode_metadata(document: MetadataDocument) -> bytes:
    """Returns JSON."""
    return _encoder.encode(document)


def pack_text(text: bytes) -> bytes:
    """Gzips; the same text gives the same bytes."""
    packer = zlib.compressobj(6, zlib.DEFLATED, _GZIP)
    return packer.compress(text) + packer.flush()


def unpack_text(packed: bytes) -> bytes:
    """Unpacks what `pack_text` returns. Raises ValueError for anything else, and for more than MAX_TEXT_BYTES."""
    unpacker = zlib.decompressobj(_GZIP)
    try:
        text = unpacker.decompress(packed, MAX_TEXT_BYTES)
    except zlib.error as error:
        raise ValueError(f"{_NO_METADATA}: {error}") from None
    if not unpacker.eof or unpacker.unused_data:
        raise ValueError(f"{_NO_METADATA}: cut off, or too large")
    return text


def read_metadata(text: bytes) -> MetadataDocument:
    """Parses the JSON document. Raises ValueError for anything else, and for text beyond the limits."""
    if len(text) > MAX_TEXT_BYTES or text.count(b",") > MAX_COMMAS:
        raise ValueError(f"{_NO_METADATA}: too large")
    try:
        document = _decoder.decode(text)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{_NO_METADATA}: {error}") from None
    if document.version != VERSION:
        raise ValueError(f"{_NO_METADATA}: version {document.version}")
    return document
