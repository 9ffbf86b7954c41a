"""The black box of a drone on the wire: which flights the agent has on its disk, and pieces of them. No I/O.

A piece is whole entries of a telemetry log (8 bytes of microseconds since 1970, big endian, then the frame), deflated.
The tower asks for one piece at a time and says where it begins, so a fetch goes on wherever it broke off. Neither side
sends these messages unless the other has listed BLACK_BOX in its hello or welcome.
"""

import zlib
from typing import Annotated, Final

import msgspec

BLACK_BOX: Final = "black_box"
"""The entry in `takes` of hello and welcome for the messages of this module."""
MAX_FLIGHTS: Final = 20
"""Reported, the newest. Older ones stay on the drone until their room is needed."""
MAX_PIECE_BYTES: Final = 12_000
"""Inflated. Some 8 kB in base64, so that messages queued behind it on a slow link do not wait long."""
MAX_DEFLATED_BYTES: Final = 16_000

FlightName = Annotated[str, msgspec.Meta(pattern=r"^[0-9A-Za-z-]{1,40}$")]
Microseconds = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
Offset = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
Words = Annotated[str, msgspec.Meta(max_length=200)]


class BlackBoxFlight(msgspec.Struct, frozen=True, kw_only=True):
    """`began_us`: of its first frame; `ended_us`: of its last one, None while it is recorded. By the agent's clock."""

    name: FlightName
    began_us: Microseconds
    ended_us: Microseconds | None = None


class BlackBoxState(msgspec.Struct, frozen=True, tag="black_box_state", tag_field="type", kw_only=True):
    """Agent to tower, after the welcome and on each change. `now_us`: the clock of the newest flight when this was
    sent. `problem`: why nothing is recorded, in words for people; empty: all is well."""

    now_us: Microseconds
    flights: Annotated[tuple[BlackBoxFlight, ...], msgspec.Meta(max_length=MAX_FLIGHTS)] = ()
    problem: Words = ""


class BlackBoxWanted(msgspec.Struct, frozen=True, tag="black_box_wanted", tag_field="type", kw_only=True):
    """Tower to agent: one piece, of the frames from `from_us` to `to_us`. `at`: where it begins in the file, as the
    last piece said; 0: at `from_us`. A new request takes the place of one that is not answered."""

    request: U32
    flight: FlightName
    from_us: Microseconds
    to_us: Microseconds
    at: Offset = 0


class BlackBoxPiece(msgspec.Struct, frozen=True, tag="black_box_piece", tag_field="type", kw_only=True):
    """Agent to tower, the answer. `next`: where the next piece begins. `last`: nothing follows. `words`: why there is
    nothing to have; empty: there is."""

    request: U32
    next: Offset
    last: bool
    data: Annotated[bytes, msgspec.Meta(max_length=MAX_DEFLATED_BYTES)] = b""
    words: Words = ""


BlackBoxToTower = BlackBoxState | BlackBoxPiece


def deflated(entries: bytes) -> bytes:
    """For `BlackBoxPiece.data`."""
    return zlib.compress(entries, 1)


def inflated(data: bytes) -> bytes:
    """Raises ValueError for what is no piece."""
    inflater = zlib.decompressobj()
    try:
        entries = inflater.decompress(data, MAX_PIECE_BYTES + 1)
    except zlib.error as error:
        raise ValueError(f"not deflated: {error}") from None
    if len(entries) > MAX_PIECE_BYTES or not inflater.eof:
        raise ValueError("cut off, or too much")
    return entries
