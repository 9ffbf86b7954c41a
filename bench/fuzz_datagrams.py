"""Mutated datagrams of one live link, each with its expected result.

A table of mutations: the name, and the drop reasons that are right for it (`None` is "accepted"). Those below the seal
must never be accepted; those inside it (sealed with the right key, as a hostile agent or tower would) reach the inner
parsers.
"""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from fastcrc.crc16 import mcrf4xx

from bench.fuzz_bytes import Mutator
from wire.content import Ping, Pong, encode_frames, encode_keepalive, encode_urgent
from wire.dialect import CRC_EXTRA, mavlink
from wire.drops import DropReason as Reason
from wire.ids import DroneId, Epoch
from wire.sealed_link import SealedLink
from wire.sealing import HEADER_BYTES, MAX_CONTENT_BYTES, MAX_DATAGRAM_BYTES

Outcomes = frozenset[Reason | None]
_ACCEPTED: Final[Outcomes] = frozenset({None})
_UNSEALED: Final[Outcomes] = frozenset(
    {
        Reason.TOO_SHORT,
        Reason.TOO_LONG,
        Reason.BAD_VERSION,
        Reason.UNKNOWN_LINK,
        Reason.BAD_KEY_PHASE,
        Reason.NOT_AUTHENTIC,
    }
)
_INSIDE: Final[Outcomes] = frozenset(
    {
        None,
        Reason.BAD_CONTENT,
        Reason.BAD_FRAME,
        Reason.FOREIGN_TAG,
        Reason.STALE_EPOCH,
        Reason.NOT_ALLOWED,
        Reason.OTHER_VEHICLE,
    }
)
_HELD: Final = 32
"""Genuine datagrams held back and released at random: some after the replay window has passed them, some before."""

_MESSAGE_IDS: Final = tuple(CRC_EXTRA)
_PASSING_IDS: Final = tuple(msgid for msgid in _MESSAGE_IDS if msgid != mavlink.MAVLINK_MSG_ID_SETUP_SIGNING)
_MAX_FRAMES: Final = 4


class Fuzzed(NamedTuple):
    """One datagram to deliver."""

    mutation: str
    datagram: bytes
    outcomes: Outcomes
    """The expected results; one of them must occur."""
    authentic: bool
    """Whether the receiver may answer at all."""


class DatagramFuzzer:
    """`sender` is the genuine other end of the link; `urgent` a message that the receiver accepts, as JSON."""

    def __init__(
        self,
        chance: random.Random,
        *,
        sender: SealedLink,
        urgent: dict[str, Any],
        epoch: Callable[[], int],
        fenced: bool,
        senders: Sequence[tuple[int, int]] = ((1, 1), (1, 190), (255, 190)),
    ) -> None:
        """`epoch`: what the receiver accepts now; `fenced`: whether it refuses an older one. `senders`: systems and
        components of its frames."""
        self._senders = senders
        self._chance = chance
        self._mutator = Mutator(chance)
        self._sender = sender
        self._urgent = urgent
        self._epoch = epoch
        self._fenced = fenced
        self._delivered = b""
        self._before = self.genuine()
        self._held = [self.genuine() for _ in range(_HELD)]
        self.reflected = b""
        """A datagram sealed by the receiver itself."""
        self._table: tuple[tuple[str, Outcomes, bool, Callable[[], bytes]], ...] = (
            ("genuine", _ACCEPTED, True, self.genuine),
            ("noise", _UNSEALED, False, lambda: self._mutator.noise(2 * MAX_DATAGRAM_BYTES)),
            ("truncated", frozenset({Reason.TOO_SHORT, Reason.NOT_AUTHENTIC}), False, self._truncated),
            ("extended", frozenset({Reason.TOO_LONG, Reason.NOT_AUTHENTIC}), False, self._extended),
            ("bits flipped", _UNSEALED, False, lambda: self._mutator.flip_bits(self.genuine())),
            ("bytes mutated", _UNSEALED, False, lambda: self._mutator.differently(self.genuine())),
            ("header mutated", _UNSEALED, False, self._header_mutated),
            ("spliced", frozenset({Reason.NOT_AUTHENTIC}), False, self._spliced),
            ("reflected", _UNSEALED, False, lambda: self.reflected),
            ("replayed", frozenset({Reason.REPLAYED}), False, lambda: self._delivered),
            ("late", frozenset({None, Reason.REPLAYED, Reason.STALE_EPOCH}), True, self._late),
            ("sealed noise", _INSIDE, True, lambda: self.seal(self._mutator.noise(MAX_CONTENT_BYTES) or b"\0")),
            ("sealed mutation", _INSIDE, True, self._sealed_mutation),
            ("foreign tag", frozenset({Reason.FOREIGN_TAG}), True, self._foreign_tag),
            ("old epoch", frozenset({Reason.STALE_EPOCH} if fenced else {None}), True, self._old_epoch),
            ("mutated frames", _INSIDE, True, self._mutated_frames),
            ("any message", _ACCEPTED, True, self._any_message),
            ("forbidden message", frozenset({Reason.NOT_ALLOWED}), True, self._forbidden_message),
            ("mutated urgent", frozenset({None, Reason.BAD_CONTENT}), True, self._mutated_urgent),
            ("nested urgent", frozenset({Reason.BAD_CONTENT}), True, self._nested_urgent),
            ("keep-alive", _ACCEPTED, True, self._keepalive),
        )

    @property
    def mutations(self) -> list[str]:
        """Returns the names of the mutations."""
        return [row[0] for row in self._table]

    def next(self) -> Fuzzed:
        """Returns one of the table, all equally likely; the first datagram is genuine."""
        name, outcomes, authentic, make = self._chance.choice(self._table) if self._delivered else self._table[0]
        datagram = make()
        if authentic:
            self._delivered = datagram
        return Fuzzed(name, datagram, outcomes, authentic)

    def seal(self, content: bytes) -> bytes:
        """Seals any content with the right key and the next counter: only a hostile owner of the key can do this."""
        return self._sender._sealer.seal(content)

    def genuine(self) -> bytes:
        """Returns a datagram that must be accepted."""
        return self.seal(self._genuine_content())

    def _genuine_content(self) -> bytes:
        pick = self._chance.random()
        if pick < 0.15:
            return encode_keepalive(Ping(self._u32(), trip_us=self._u32()))
        if pick < 0.25:
            return encode_urgent(json.dumps(self._urgent).encode())
        return self.frames_content([self._frame() for _ in range(self._chance.randint(1, _MAX_FRAMES))])

    def frames_content(self, frames: list[bytes], *, drone_id: int | None = None, epoch: int | None = None) -> bytes:
        """Returns the content with these frames, at most a datagram's worth; tag and epoch are the right ones unless
        given."""
        tag = self._sender.drone_id if drone_id is None else DroneId(drone_id)
        known = Epoch(self._epoch() if epoch is None else epoch)
        return encode_frames(tag, known, self._u32(), frames)[0]

    def _frame(self, message_id: int | None = None) -> bytes:
        """Returns a frame with a valid checksum, of any message except the one that never passes, with any payload."""
        msgid = self._chance.choice(_PASSING_IDS) if message_id is None else message_id
        payload = self._chance.randbytes(self._chance.choice((0, 1, 9, 30, 51, 255)))
        sources = bytes((self._chance.randrange(256), *self._chance.choice(self._senders)))
        if msgid < 256 and self._chance.random() < 0.2:
            head = bytes((0xFE, len(payload))) + sources + bytes((msgid,))
        else:
            head = bytes((0xFD, len(payload), 0, 0)) + sources + msgid.to_bytes(3, "little")
        body = head + payload
        return body + mcrf4xx(body[1:] + bytes((CRC_EXTRA[msgid],))).to_bytes(2, "little")

    def _truncated(self) -> bytes:
        datagram = self.genuine()
        return datagram[: self._chance.randrange(len(datagram))]

    def _extended(self) -> bytes:
        return self.genuine() + self._chance.randbytes(self._chance.randint(1, MAX_DATAGRAM_BYTES))

    def _header_mutated(self) -> bytes:
        datagram = self.genuine()
        header = self._mutator.differently(datagram[:HEADER_BYTES])[:HEADER_BYTES].ljust(HEADER_BYTES, b"\0")
        return (header if header != datagram[:HEADER_BYTES] else b"\xff" + header[1:]) + datagram[HEADER_BYTES:]

    def _spliced(self) -> bytes:
        before, self._before = self._before, self.genuine()
        return self._before[:HEADER_BYTES] + before[HEADER_BYTES:]

    def _late(self) -> bytes:
        """Returns a datagram that was held back; a fresh one takes its place."""
        at = self._chance.randrange(_HELD)
        late, self._held[at] = self._held[at], self.genuine()
        return late

    def _sealed_mutation(self) -> bytes:
        return self.seal(self._mutator.mutate(self._genuine_content())[:MAX_CONTENT_BYTES] or b"\0")

    def _foreign_tag(self) -> bytes:
        foreign = self._u32()
        return self.seal(self.frames_content([self._frame()], drone_id=foreign ^ (foreign == self._sender.drone_id)))

    def _old_epoch(self) -> bytes:
        newest = self._epoch()
        return self.seal(self.frames_content([self._frame()], epoch=self._chance.randrange(max(newest, 1))))

    def _mutated_frames(self) -> bytes:
        frames = [self._frame() for _ in range(self._chance.randint(1, _MAX_FRAMES))]
        at = self._chance.randrange(len(frames))
        frames[at] = self._mutator.mutate(frames[at])
        return self.seal(self.frames_content(frames)[:MAX_CONTENT_BYTES])

    def _any_message(self) -> bytes:
        return self.seal(self.frames_content([self._frame()]))

    def _forbidden_message(self) -> bytes:
        return self.seal(self.frames_content([self._frame(mavlink.MAVLINK_MSG_ID_SETUP_SIGNING)]))

    def _mutated_urgent(self) -> bytes:
        text = self._mutator.mutate(json.dumps(self._urgent).encode())
        return self.seal(encode_urgent(text[: MAX_CONTENT_BYTES - 1] or b"{"))

    def _nested_urgent(self) -> bytes:
        kind = json.dumps({**self._urgent, "more": 0})[:-2].encode()
        opening = self._chance.choice((b"[", b'{"a":'))
        return self.seal(encode_urgent((kind + opening * MAX_CONTENT_BYTES)[: MAX_CONTENT_BYTES - 1]))

    def _keepalive(self) -> bytes:
        kind = self._chance.choice((Ping, Pong))
        return self.seal(encode_keepalive(kind(self._chance.choice((0, 1, self._u32())))))

    def _u32(self) -> int:
        return self._chance.choice((0, 1, self._chance.getrandbits(32), 0xFFFFFFFF))
