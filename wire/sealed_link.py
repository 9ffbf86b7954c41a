"""One side of a link: seals and opens, answers pings, measures. Verbs as in aioquic, `now` passed in, no I/O.

The shell calls `receive` for each datagram and sends what `batch_frames` and `datagrams_to_send` return; at
`batch_due_at` it sends what `batch_due` returns. Each side has its own rules for trusting the content (tag, epoch).
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

from wire.batching import CLOSE_WAIT_S, MAX_WAIT_S, Batch, Batcher
from wire.content import (
    FRAMES_HEADER_BYTES,
    PING_BYTES,
    Frames,
    Ping,
    Pong,
    Purpose,
    Report,
    Urgent,
    decode_content,
    encode_frames,
    encode_keepalive,
    encode_urgent,
)
from wire.ids import DroneId, Epoch, LinkId
from wire.keepalive import ANSWER_WITHIN_S, PING_INTERVAL_S, PROBE_SEQUENCES, Keepalive
from wire.lateness import stamp_ms
from wire.link_quality import SHORT_WINDOW_S, LinkQuality
from wire.path_mtu import SAFE_DATAGRAM_BYTES, SeenMtu
from wire.rekeying import Rekeying, Retiring
from wire.sealing import OVERHEAD_BYTES, Opener, Sealer

PINGS_ALONG_WHILE_PROVEN_S: Final = 0.75
"""A ping goes along with frames only while what this side sends is known to arrive: where it is not, frames may be kept
back on their way out (a stream that has stalled) and pings must not."""

PINGS_AHEAD_S: Final = 0.25
"""By no more than this a ping goes before its time to go along with frames."""


class Probed(NamedTuple):
    """A probe was answered."""

    uplink: int | None
    datagram_bytes: int
    rtt_s: float


class Received(NamedTuple):
    """An authentic datagram: frames, or an urgent message, or neither (a keep-alive)."""

    frames: Frames | None
    newest: bool
    """Whether the address that it came from is to be followed."""
    urgent: bytes | None = None
    answer: bytes | None = None
    """A datagram to send back to where this one came from, and to nowhere else. Never longer than this one was."""
    uplink: int | None = None
    """The uplink whose address this datagram tells."""
    probed: Probed | None = None
    proof: bool = False
    """Whether it shows that something which this side sent has arrived."""


class SealedLink:
    """Keys, counters and keep-alive of one link, seen from one side. `leads`: it pings on its own (wire.keepalive)."""

    def __init__(
        self,
        *,
        link_id: LinkId,
        drone_id: DroneId,
        send_key: bytes,
        receive_key: bytes,
        now: float,
        leads: bool = True,
    ) -> None:
        self.link_id = link_id
        self.drone_id = drone_id
        self.keepalive = Keepalive(now, leads=leads)
        self.quality = LinkQuality(now)
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        """The largest datagram that is known to pass to the other side."""
        self._sealer = Sealer(send_key, link_id)
        self._opener = Opener(receive_key, link_id)
        self._batcher = Batcher(SAFE_DATAGRAM_BYTES - OVERHEAD_BYTES - FRAMES_HEADER_BYTES)
        self._seen_mtu = SeenMtu()
        self._answers: list[bytes] = []
        self._probes: dict[int, tuple[float, int | None, int]] = {}
        """Sequence number to (when sent, uplink, size)."""
        self._probe_sequence = PROBE_SEQUENCES
        self._newest_of_uplink: dict[int, int] = {}
        self._arrived = 0
        self._proven_at = now
        self._frames_left_at = now
        self._reported_counter = 0
        self._rekeying = Rekeying(now)
        self._retiring = Retiring()

    def receive(self, datagram: bytes, now: float) -> Received:
        """Opens one datagram. Raises wire.drops.Dropped with the first check that it fails."""
        content = self._opener.open(datagram)
        newest = self._opener.newest
        self.keepalive.heard_at = now
        decoded = decode_content(content)
        if isinstance(decoded, Frames):
            if decoded.ping is None:
                return Received(decoded, newest)
            proof = self._receive_report(decoded.ping.report, now)
            self._answers.append(self._answer(decoded.ping, now))
            return Received(decoded, newest, proof=proof)
        if isinstance(decoded, Urgent):
            return Received(None, newest, decoded.text)
        proof = self._receive_report(decoded.report, now)
        if isinstance(decoded, Pong):
            return Received(None, newest, probed=self._pong(decoded, now), proof=proof)
        answer = self._answer(decoded, now)
        if decoded.purpose is Purpose.KEEPALIVE:
            self._answers.append(answer)
            return Received(None, newest, proof=proof)
        self._seen_mtu.probe_came(decoded.uplink, len(datagram), now)
        self.fill_datagrams(self._seen_mtu.datagram_bytes)
        return Received(None, False, answer=answer, uplink=self._uplink(decoded), proof=proof)

    def _receive_report(self, report: Report, now: float) -> bool:
        """What the other side has received. Whether it proves that something more of ours arrived."""
        self.quality.receive_report(report, now)
        if report.expected > self._reported_counter:
            self._reported_counter = report.expected
        if report.received <= self._arrived:
            return False
        self._arrived = report.received
        self._proven_at = now
        return True

    def _answer(self, ping: Ping, now: float) -> bytes:
        if ping.purpose is Purpose.KEEPALIVE:
            trip_s = self.keepalive.receive_ping(ping, now)
            if trip_s is not None:
                self.quality.round_trip(trip_s, now)
        return self._sealer.seal(encode_keepalive(Pong(ping.sequence, self._report(now))))

    def _uplink(self, ping: Ping) -> int | None:
        """The uplink whose address this ping tells: none that is older than another of the same uplink."""
        if ping.purpose is not Purpose.UPLINK or ping.sequence <= self._newest_of_uplink.get(ping.uplink, 0):
            return None
        self._newest_of_uplink[ping.uplink] = ping.sequence
        return ping.uplink

    def fill_datagrams(self, datagram_bytes: int) -> None:
        """From here on datagrams with frames are as large as this."""
        self.datagram_bytes = datagram_bytes
        self._batcher.room_bytes = datagram_bytes - OVERHEAD_BYTES - FRAMES_HEADER_BYTES

    def _check_size(self, now: float) -> None:
        """The side that does not probe fills its datagrams as far as what it saw is still believed."""
        before = self._seen_mtu.datagram_bytes
        self._seen_mtu.check(now)
        if self._seen_mtu.datagram_bytes != before:
            self.fill_datagrams(self._seen_mtu.datagram_bytes)

    def keys_outlived(self, now: float) -> bool:
        """Whether this side's key should have been changed long ago (wire.rekeying)."""
        return self._rekeying.outlived(now)

    def unproven_s(self, now: float) -> float:
        """Seconds since it was last shown that something which this side sent has arrived, beyond those that the pings
        rest."""
        return max(0.0, now - self._proven_at - self.keepalive.rests_s)

    def short_window_s(self) -> float:
        """The shortest meaningful window: four keep-alives, both directions together."""
        return SHORT_WINDOW_S * (1.0 + self.keepalive.rests_s / PING_INTERVAL_S)

    def _pong(self, pong: Pong, now: float) -> Probed | None:
        if pong.sequence < PROBE_SEQUENCES:
            rtt_s = self.keepalive.pong(pong, now)
            if rtt_s is not None:
                self.quality.round_trip(rtt_s, now)
            return None
        sent = self._probes.pop(pong.sequence, None)
        return None if sent is None else Probed(sent[1], sent[2], now - sent[0])

    def _report(self, now: float) -> Report:
        report = Report(*self._opener.so_far())
        self.quality.counted(report, now)
        return report

    def batch_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> list[bytes]:
        """Datagrams to send now; frames that are not urgent may stay until `batch_due_at` (wire.batching)."""
        return self._seal_batches(self._batcher.add(epoch, frames, now), now)

    def batch_closely(self, closely: bool) -> None:
        """Whether every frame is awaited: frames are then collected for CLOSE_WAIT_S, otherwise for MAX_WAIT_S."""
        self._batcher.wait_s = CLOSE_WAIT_S if closely else MAX_WAIT_S

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
        largest_bytes = self.datagram_bytes - OVERHEAD_BYTES
        ping = self._ping_along(frames, largest_bytes, now)
        contents = encode_frames(self.drone_id, epoch, stamp_ms(now), frames, largest_bytes=largest_bytes, ping=ping)
        return [seal(content) for content in contents]

    def _ping_along(self, frames: Sequence[bytes], largest_bytes: int, now: float) -> Ping | None:
        """A ping to go with these frames, if that saves a datagram: it would have to leave alone before the next
        frames, at their present interval."""
        interval_s = min(now - self._frames_left_at, PINGS_AHEAD_S)
        self._frames_left_at = now
        if now + interval_s < self.keepalive.next_ping_at or self.unproven_s(now) > PINGS_ALONG_WHILE_PROVEN_S:
            return None
        if not frames or PING_BYTES + FRAMES_HEADER_BYTES + sum(map(len, frames)) > largest_bytes:
            return None
        return self.keepalive.ping(now)._replace(report=self._report(now))

    def seal_urgent(self, text: bytes) -> bytes:
        """One datagram with a message of the control channel. Raises ValueError if it is too long for one."""
        return self._sealer.seal(encode_urgent(text))

    def seal_probe(self, now: float, *, uplink: int | None = None, datagram_bytes: int = 0) -> bytes:
        """A ping that is answered where it comes from: for one uplink, or to try out a way or a size.

        `datagram_bytes`: filled up to this size, if it is larger than a ping is.
        """
        for sequence, (sent_at, _, _) in list(self._probes.items()):
            if now - sent_at > ANSWER_WITHIN_S:
                del self._probes[sequence]
        self._probe_sequence = (self._probe_sequence + 1) % PROBE_SEQUENCES + PROBE_SEQUENCES
        padding_bytes = max(0, datagram_bytes - OVERHEAD_BYTES - PING_BYTES)
        purpose = Purpose.PROBE if uplink is None else Purpose.UPLINK
        ping = Ping(self._probe_sequence, self._report(now), purpose, uplink or 0, padding_bytes=padding_bytes)
        datagram = self._sealer.seal(encode_keepalive(ping))
        self._probes[self._probe_sequence] = (now, uplink, len(datagram))
        return datagram

    def has_to_send(self, now: float) -> bool:
        """Whether `datagrams_to_send` has something."""
        return bool(self._answers) or now >= self.keepalive.next_ping_at

    def datagrams_to_send(self, now: float) -> list[bytes]:
        """Answers to pings, and a ping of our own where one is due. Also the moment at which keys are changed."""
        if self._rekeying.due(sealed=self._sealer.sealed, arrived=self._reported_counter, now=now):
            self._sealer.next_key()
        self._check_size(now)
        if self._retiring.due(phase=self._opener.phase, now=now):
            self._opener.retire_last_key()
        datagrams, self._answers = self._answers, []
        ping = self.keepalive.ping_due(now)
        if ping is not None:
            datagrams.append(self._sealer.seal(encode_keepalive(ping._replace(report=self._report(now)))))
        return datagrams
