"""An autopilot's parameters as tables: their bytes and their hash. No I/O, independent of the MAVLink protocol.

A table holds each parameter once, by name. A value is the plain number: a PARAM_VALUE has been read according to its
kind (ArduPilot's numbers as they are, PX4's integers from the bits of a float).
"""

import zlib
from collections.abc import Iterable
from hashlib import sha256
from itertools import pairwise
from math import isfinite
from struct import Struct
from typing import Annotated, Final

import msgspec

MAX_ENTRIES: Final = 4096
"""More parameters than any autopilot has."""
MAX_TABLE_BYTES: Final = MAX_ENTRIES * 64

_HASHED: Final = Struct("<16sBd")
_NO_TABLE: Final = "no table of parameters"


class Parameter(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One parameter. `kind`: MAV_PARAM_TYPE, 1 to 10. `value`: finite; 32 bits wide, except for kinds 7, 8 and 10."""

    name: Annotated[str, msgspec.Meta(min_length=1, max_length=16, pattern="^[A-Za-z0-9_]+$")]
    value: float
    kind: Annotated[int, msgspec.Meta(ge=1, le=10)]

    def __post_init__(self) -> None:
        if not isfinite(self.value):
            raise ValueError(f"{self.name} has no number")


Table = tuple[Parameter, ...]

_encoder: Final = msgspec.json.Encoder()
_decoder: Final[msgspec.json.Decoder[Table]] = msgspec.json.Decoder(
    Annotated[Table, msgspec.Meta(max_length=MAX_ENTRIES)]
)


def by_name(parameters: Iterable[Parameter]) -> Table:
    """Sorts by name. Raises ValueError if a name occurs twice."""
    table = tuple(sorted(parameters, key=lambda one: one.name))
    for one, following in pairwise(table):
        if one.name == following.name:
            raise ValueError(f"{one.name} comes twice")
    return table


def table_hash(table: Table) -> str:
    """Returns 16 hexadecimal digits: the first 8 bytes of SHA-256 over name (16 bytes, zero-padded), kind u8, value f64
    each.

    `table`: sorted, from `by_name`.
    """
    digest = sha256()
    for one in table:
        digest.update(_HASHED.pack(one.name.encode("ascii"), one.kind, one.value + 0.0))
    return digest.hexdigest()[:16]


def pack_table(table: Table) -> bytes:
    """Returns zlib-compressed JSON `[[name, value, kind], ...]`. 1,400 parameters take some 15 kB."""
    return zlib.compress(_encoder.encode(table), 6)


def unpack_table(packed: bytes) -> Table:
    """Unpacks what `pack_table` returns, sorted by name. Raises ValueError for anything else, and for oversized
    input."""
    unpacker = zlib.decompressobj()
    try:
        text = unpacker.decompress(packed, MAX_TABLE_BYTES)
        if not unpacker.eof or unpacker.unused_data:
            raise ValueError(_NO_TABLE)
        return by_name(_decoder.decode(text))
    except (zlib.error, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{_NO_TABLE}: {error}") from None
