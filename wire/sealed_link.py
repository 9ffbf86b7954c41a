"""One side of a link: seals and opens, answers pings, measures. Verbs as in aioquic, `now` passed in, no I/O.

The shell calls `receive` for each datagram and sends what `datagrams_to_send` hands out. What a side believes of the
content (the tag, the epoch) is its own rule and stands where that side is.
"""

from collections.abc import Sequence
from typing import NamedTuple

from wire.content import Frames, Ping, Pong, Urgent, decode_content, encode_frames, encode_keepalive, encode_urgent
from wire.ids import DroneId, Epoch, LinkId
from wire.keepalive import Keepalive
from wire.lateness import stamp_ms
from wire.sealing import Opener, Sealer


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

    def seal_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> list[bytes]:
        """Datagrams with the frames in order, each as full as it may be, stamped with `now`."""
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
