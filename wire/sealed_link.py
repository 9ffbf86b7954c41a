"""One side of a link: seals and opens, answers pings, measures. Verbs as in aioquic, `now` passed in, no I/O.

The shell calls `receive` for each datagram and sends what `batch_frames` and `datagrams_to_send` return; at
`batch_due_at` it sends what `batch_due` returns. Each side applies its own rules for the content (tag, epoch)
elsewhere.
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
"""Pings travel with frames only while datagrams of this side are known to arrive. Otherwise frames may be stuck on
their way out (a stalled stream), and pings must not be."""

PINGS_AHEAD_S: Final = 0.25
"""A ping leaves at most this much early in order to travel with frames."""


class Probed(NamedTuple):
    """A probe was answered."""

    uplink: int | None
    datagram_bytes: int
    rtt_s: float


class Received(NamedTuple):
    """An authentic datagram: frames, an urgent message, or neither (a keep-alive)."""

    frames: Frames | None
    newest: bool
    """Whether to follow its source address."""
    urgent: bytes | None = None
    answer: bytes | None = None
    """A datagram to send back to the source address only. Never longer than the received one."""
    uplink: int | None = None
    """The uplink whose address this datagram reports."""
    probed: Probed | None = None
    proof: bool = False
    """Whether it shows that a datagram of this side has arrived."""


class SealedLink:
    """Keys, counters and keep-alive of one link, seen from one side. `leads`: it sends pings on its own
    (wire.keepalive)."""

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
        """The largest datagram known to pass to the other side."""
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
        """Takes the other side's report. Returns whether it proves that more of this side's datagrams arrived."""
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
        """Returns the uplink whose address this ping reports, unless a newer ping of that uplink has arrived."""
        if ping.purpose is not Purpose.UPLINK or ping.sequence <= self._newest_of_uplink.get(ping.uplink, 0):
            return None
        self._newest_of_uplink[ping.uplink] = ping.sequence
        return ping.uplink

    def fill_datagrams(self, datagram_bytes: int) -> None:
        """Sets the size of datagrams with frames from here on."""
        self.datagram_bytes = datagram_bytes
        self._batcher.room_bytes = datagram_bytes - OVERHEAD_BYTES - FRAMES_HEADER_BYTES

    def _check_size(self, now: float) -> None:
        """The side that does not probe limits its datagrams to the size still believed."""
        before = self._seen_mtu.datagram_bytes
        self._seen_mtu.check(now)
        if self._seen_mtu.datagram_bytes != before:
            self.fill_datagrams(self._seen_mtu.datagram_bytes)

    def keys_outlived(self, now: float) -> bool:
        """Returns whether this side's key is long overdue for a change (wire.rekeying)."""
        return self._rekeying.outlived(now)

    def unproven_s(self, now: float) -> float:
        """Seconds since the last proof that a datagram of this side arrived, less the extra interval at leisure."""
        return max(0.0, now - self._proven_at - self.keepalive.rests_s)

    def short_window_s(self) -> float:
        """The shortest meaningful window for the quality: four keep-alives, in both directions together."""
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
        """Returns datagrams to send now; frames that are not urgent may wait until `batch_due_at` (wire.batching)."""
        return self._seal_batches(self._batcher.add(epoch, frames, now), now)

    def batch_closely(self, closely: bool) -> None:
        """`closely`: batches wait for CLOSE_WAIT_S only, because somebody waits for every frame; else for
        MAX_WAIT_S."""
        self._batcher.wait_s = CLOSE_WAIT_S if closely else MAX_WAIT_S

    @property
    def batch_due_at(self) -> float | None:
        """When `batch_due` has something to send; None while nothing waits."""
        return self._batcher.due_at

    def batch_due(self, now: float) -> list[bytes]:
        """Returns datagrams with the frames that have waited long enough."""
        return self._seal_batches(self._batcher.due(now), now)

    def _seal_batches(self, batches: list[Batch], now: float) -> list[bytes]:
        return [datagram for epoch, frames in batches for datagram in self.seal_frames(epoch, frames, now)]

    def seal_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> list[bytes]:
        """Returns datagrams with only these frames, in order, each as full as possible, stamped with `now`."""
        seal = self._sealer.seal
        largest_bytes = self.datagram_bytes - OVERHEAD_BYTES
        ping = self._ping_along(frames, largest_bytes, now)
        contents = encode_frames(self.drone_id, epoch, stamp_ms(now), frames, largest_bytes=largest_bytes, ping=ping)
        return [seal(content) for content in contents]

    def _ping_along(self, frames: Sequence[bytes], largest_bytes: int, now: float) -> Ping | None:
        """Returns a ping to send with these frames if that saves a datagram: it would otherwise leave alone before the
        next frames, if they come at the interval of the last ones."""
        interval_s = min(now - self._frames_left_at, PINGS_AHEAD_S)
        self._frames_left_at = now
        if now + interval_s < self.keepalive.next_ping_at or self.unproven_s(now) > PINGS_ALONG_WHILE_PROVEN_S:
            return None
        if not frames or PING_BYTES + FRAMES_HEADER_BYTES + sum(map(len, frames)) > largest_bytes:
            return None
        return self.keepalive.ping(now)._replace(report=self._report(now))

    def seal_urgent(self, text: bytes) -> bytes:
        """Seals a message of the control channel in one datagram. Raises ValueError if it is too long."""
        return self._sealer.seal(encode_urgent(text))

    def seal_probe(self, now: float, *, uplink: int | None = None, datagram_bytes: int = 0) -> bytes:
        """Returns a ping that is answered to its source address: for one uplink, or to test a path or a size.

        `datagram_bytes`: padded to this size, if that is larger than a ping.
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
        """Returns whether `datagrams_to_send` has something."""
        return bool(self._answers) or now >= self.keepalive.next_ping_at

    def datagrams_to_send(self, now: float) -> list[bytes]:
        """Returns answers to pings, and a ping of this side if one is due. Keys change here too."""
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
