"""What towers tell each other on the bus: one header and several messages in each packet. No I/O.

Frames travel as in the browser's WebSocket: tagged, in binary messages. Packets are sealed with the keys of the towers
(server.towers.io.bus_seal), which whoever can only write to the bus does not have.
"""

from collections.abc import Iterator
from datetime import datetime
from struct import Struct
from typing import Final, NamedTuple

import msgspec

from server.airspace.core.aircraft.shared import SharedAircraft
from server.airspace.core.separation.elsewhere import DroneInAir
from server.kernel.people import Principal, SignInId, TokenId

TOWER_ID_BYTES: Final = 16
MAX_PACKET_BYTES: Final = 900_000
"""NATS takes a million bytes by default."""
MAX_BODY_BYTES: Final = 100_000
"""Of several messages in one packet: sticks wait behind one. A single message may be larger."""
BUS_VERSION: Final = 5
"""A tower tells it in its row. 0: knows no HandOver, and would break the stream; 1: no InAir, and it does not take over
the alerts of drones that come to it; 2: sends no video (video_messages.py); 3: seals nothing (bus_seal.py);
4: believes the role and scopes of an Attach."""
SEALS: Final = 4
"""From this version on towers seal what they say, and believe nothing else of each other."""
_HEADER: Final = Struct("<16sIIQ")


class Hello(msgspec.Struct, frozen=True, array_like=True, tag=0):
    """The first of each stream. `answers`: it was opened because the other side opened one."""

    answers: bool


class Beat(msgspec.Struct, frozen=True, array_like=True, tag=1):
    """Several times a second. `heard`: the stream of the other side that is open; `revision`: of the fleet."""

    heard: int
    reaches_database: bool
    revision: int


class Homes(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """Drones whose home the sender is, each with the number of its claim."""

    homes: list[tuple[int, int]]


class Attach(msgspec.Struct, frozen=True, array_like=True, tag=3):
    """A browser has connected to the sender, signed in by this session or API token.

    The receiver looks up name, role and scopes (`FleetChanges.principal_of`). `name`, `role` and `scopes` are here for
    towers of bus version 4 and before, which believe them; nobody else reads them.
    """

    number: int
    user_id: int
    name: str
    role: str
    signed_in_by: int
    by_token: bool
    expires_at: datetime
    scopes: list[str]
    address: str


class Detach(msgspec.Struct, frozen=True, array_like=True, tag=4):
    """A browser of the sender has gone."""

    number: int


class Request(msgspec.Struct, frozen=True, array_like=True, tag=5):
    """A text message of a browser, as it came."""

    number: int
    text: str


class FramesDown(msgspec.Struct, frozen=True, array_like=True, tag=6):
    """A binary message of a browser: its stamp, and the tagged frames for drones of the receiver."""

    number: int
    message: bytes


class SessionsEnded(msgspec.Struct, frozen=True, array_like=True, tag=7):
    """These sign-ins have ended."""

    sessions: list[int]
    tokens: list[int]
    why: str


class UserEnded(msgspec.Struct, frozen=True, array_like=True, tag=8):
    """Every connection of this account is to end."""

    user_id: int
    why: str


class EventUp(msgspec.Struct, frozen=True, array_like=True, tag=9):
    """A text message for a browser, as it is to go."""

    number: int
    text: bytes


class FramesUp(msgspec.Struct, frozen=True, array_like=True, tag=10):
    """Tagged frames for a browser."""

    number: int
    message: bytes


class PingBrowser(msgspec.Struct, frozen=True, array_like=True, tag=11):
    """To be answered by the browser with a pong."""

    number: int
    sequence: int


class CloseBrowser(msgspec.Struct, frozen=True, array_like=True, tag=12):
    """This browser is to be closed."""

    number: int
    code: int
    why: str


class Ask(msgspec.Struct, frozen=True, array_like=True, tag=13):
    """An HTTP request about a drone of the receiver, as it came. `known`: who sends it, as far as the sender has had it
    from the database when the fleet was at `revision`; for a receiver that does not reach it now."""

    number: int
    method: str
    path: str
    query: bytes
    headers: list[tuple[bytes, bytes]]
    client: str
    body: bytes
    known: Attach | None = None
    revision: int = 0
    request_id: str = ""


class Answer(msgspec.Struct, frozen=True, array_like=True, tag=14):
    """A part of the answer to an Ask; the first has status and headers, the last has `more` false."""

    number: int
    status: int
    headers: list[tuple[bytes, bytes]]
    body: bytes
    more: bool


class HandOver(msgspec.Struct, frozen=True, array_like=True, tag=15):
    """The sender, which is the home of this drone by this claim, has asked its agent to link to another tower. It is
    flown by hand, or nobody flies it: all is well with it. For whoever claims it next."""

    drone_id: int
    claim: int
    epoch: int


class InAir(msgspec.Struct, frozen=True, array_like=True, tag=16):
    """All drones that the sender has in the air, twice a second, and the aircraft that they have heard."""

    drones: list[DroneInAir]
    aircraft: list[SharedAircraft]


Message = (
    Hello
    | Beat
    | Homes
    | Attach
    | Detach
    | Request
    | FramesDown
    | SessionsEnded
    | UserEnded
    | EventUp
    | FramesUp
    | PingBrowser
    | CloseBrowser
    | Ask
    | Answer
    | HandOver
    | InAir
)


class Packet(NamedTuple):
    """Sender, its stream and sequence, its clock, and what it says."""

    sender: str
    stream: int
    sequence: int
    sent_ms: int
    body: bytes


class MalformedPacket(ValueError):
    """Bytes that no tower of this version sends."""


_encoder: Final = msgspec.msgpack.Encoder()
_decoder: Final[msgspec.msgpack.Decoder[list[Message]]] = msgspec.msgpack.Decoder(list[Message])


def encode_bodies(messages: list[Message]) -> Iterator[bytes]:
    """The messages in order, in packets that the bus takes: as few as there can be, if it is not much."""
    body = _encoder.encode(messages)
    if len(body) <= MAX_BODY_BYTES or len(messages) == 1:
        yield body
        return
    middle = len(messages) // 2
    yield from encode_bodies(messages[:middle])
    yield from encode_bodies(messages[middle:])


def encode_packet(sender: str, stream: int, sequence: int, sent_ms: int, body: bytes) -> bytes:
    """`sender`: a tower's number, 32 hexadecimal digits."""
    return _HEADER.pack(bytes.fromhex(sender), stream, sent_ms, sequence) + body


def read_header(packet: bytes) -> Packet:
    """Reads the header; the body stays as it is. Raises MalformedPacket."""
    if len(packet) < _HEADER.size:
        raise MalformedPacket("too short")
    sender, stream, sent_ms, sequence = _HEADER.unpack_from(packet)
    return Packet(sender.hex(), stream, sequence, sent_ms, packet[_HEADER.size :])


def decode_messages(body: bytes) -> list[Message]:
    """Raises MalformedPacket."""
    try:
        return _decoder.decode(body)
    except msgspec.MsgspecError as error:
        raise MalformedPacket(str(error)) from None


def attach_of(number: int, viewer: Principal, address: str) -> Attach:
    signed_in_by = viewer.session_id
    return Attach(
        number=number,
        user_id=viewer.user_id,
        name=viewer.name,
        role=viewer.role.value,
        signed_in_by=signed_in_by.id if isinstance(signed_in_by, TokenId) else signed_in_by,
        by_token=isinstance(signed_in_by, TokenId),
        expires_at=viewer.expires_at,
        scopes=sorted(scope.value for scope in viewer.scopes),
        address=address,
    )


def sign_in_of(attach: Attach) -> SignInId:
    return TokenId(attach.signed_in_by) if attach.by_token else attach.signed_in_by
