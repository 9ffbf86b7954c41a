"""One side of a link: seals and opens, answers pings, measures. Verbs as in aioquic, `now` passed in, no I/O.

The shell calls `receive` for each datagram and sends what `batch_frames` and `datagrams_to_send` hand out; at
`batch_due_at` it sends what `batch_due` hands out. What a side believes of the
content (the tag, the epoch) is its own rule and stands where that side is.
"""

from collections.abc import Sequence
from typing import NamedTuple

from wire.batching import Batch, Batcher
from wire.content import (
    FRAMES_HEADER_BYTES,
    Frames,
    Ping,
    Pong,
    Urgent,
    decode_content,
    encode_frames,
    encode_keepalive,
    encode_urgent,
)
from wire.ids import DroneId, Epoch, LinkId
from wire.keepalive import Keepalive
from wire.lateness import stamp_ms
from wire.sealing import LARGEST_CONTENT_BYTES, Opener, Sealer


class Received(NamedTuple):
    """An authentic datagram: frames, or an urgent message, or neither (a keep-alive)."""

    frames: Frames | None
    newest: bool
    urgent: bytes | None = None


class SealedLink:
    """Keys, counters and keep-alive of one link, seen from one side."""

    def __init__(self, *, link_id: LinkId, drone_id: DroneId, send_key: bytes, receive_key: bytes, now: float) -> None:
        self.link_id = link_id
        self.drone_id = drone_id
        self.keepalive = Keepalive(now)
        self._sealer = Sealer(send_key, link_id)
        self._opener = Opener(receive_key, link_id)
        self._batcher = Batcher(LARGEST_CONTENT_BYTES - FRAMES_HEADER_BYTES)
        self._answers: list[bytes] = []

    def receive(self, datagram: bytes, now: float) -> Received:
        """Opens one datagram. Raises wire.drops.Dropped with the first check that it fails."""
        content, newest = self._opener.open(datagram)
        self.keepalive.heard(now)
        decoded = decode_content(content)
        if isinstance(decoded, Frames):
            return Received(decoded, newest)
        if isinstance(decoded, Urgent):
            return Received(None, newest, decoded.text)
        if isinstance(decoded, Ping):
            self._answers.append(self._sealer.seal(encode_keepalive(Pong(*decoded))))
        else:
            self.keepalive.pong(decoded, now)
        return Received(None, newest)

    def batch_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> list[bytes]:
        """Datagrams to send now; frames that are not urgent may stay until `batch_due_at` (wire.batching)."""
        return self._seal_batches(self._batcher.add(epoch, frames, now), now)

    @property
    def batch_due_at(self) -> float | None:
        """When `batch_due` has something to send; None while nothing waits."""
        return self._batcher.due_at

    def batch_due(self, now: float) -> list[bytes]:
        """Datagrams with the frames that have waited long enough."""
        return self._seal_batches(self._batcher.due(now), now)

    def _seal_batches(self, batches: list[Batch], now: float) -> list[bytes]:
        return [datagram for epoch, frames in batches for datagram in self.seal_frames(epoch, frames, now)]

    def seal_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> list[bytes]:
        """Datagrams with these frames alone, in order, each as full as it may be, stamped with `now`."""
        seal = self._sealer.seal
        return [seal(content) for content in encode_frames(self.drone_id, epoch, stamp_ms(now), frames)]

    def seal_urgent(self, text: bytes) -> bytes:
        """One datagram with a message of the control channel. Raises ValueError if it is too long for one."""
        return self._sealer.seal(encode_urgent(text))

    def datagrams_to_send(self, now: float) -> list[bytes]:
        """Answers to pings, and a ping of our own where one is due."""
        datagrams, self._answers = self._answers, []
        ping = self.keepalive.ping_due(now)
        if ping is not None:
            datagrams.append(self._sealer.seal(encode_keepalive(ping)))
        return datagrams
