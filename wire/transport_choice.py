"""Chooses the transport of an agent's datagrams: UDP, or the control channel's WebSocket if UDP is blocked. No I/O.

What counts is proof that a datagram of the agent arrived: an answer to a ping, or a report with a higher count than the
last. Received datagrams alone prove one direction only. Time and proof decide (less the extra ping interval at
leisure):

    transport    what                                                        next
    UDP          no proof for FALL_BACK_AFTER_S                              WebSocket
    WebSocket    as many probes in a row answered over UDP as `needed`       UDP
    WebSocket    one answered, and no proof over the WebSocket yet, or not   UDP
                 for IN_DOUBT_AFTER_S

While the WebSocket gives no proof either, datagrams use both (`both`): after a total outage UDP works again at once,
while TCP still waits for its next retry. The first copy to arrive counts.

`needed` doubles each time UDP fails again soon after a return, so that the choice does not follow every change of an
unstable path.
"""

from enum import StrEnum
from typing import Final

FALL_BACK_AFTER_S: Final = 1.5
"""Some six proofs are due in this time, including those of the probes sent in doubt."""

IN_DOUBT_AFTER_S: Final = 0.75
PROBE_IN_DOUBT_S: Final = 0.2
PROBE_S: Final = 0.5

ANSWERS_IN_A_ROW_WITHIN_S: Final = 1.5
"""A longer gap between two answered probes restarts the count."""

MIN_NEEDED: Final = 2
MAX_NEEDED: Final = 32
"""16 s of answers."""

SOON_S: Final = 60.0


class Transport(StrEnum):
    """The names used for browsers."""

    UDP = "udp"
    WEBSOCKET = "websocket"


class TransportChoice:
    """One for each link, at the agent. Begins with UDP."""

    def __init__(self, now: float) -> None:
        self.transport = Transport.UDP
        self.needed = MIN_NEEDED
        self._proven_at: float | None = now
        """Of the transport in use; None: not yet since the change."""
        self._changed_at = now
        self._returned_at: float | None = None
        self._next_probe = now
        self._row = 0
        self._answered_at = now

    def proven(self, transport: Transport, now: float, *, rests_s: float = 0.0) -> None:
        """Notes that a datagram sent by this transport has arrived. `rests_s`: the extra ping interval at present, in
        which no further proof is due (wire.keepalive)."""
        if transport is self.transport:
            self._proven_at = now + rests_s

    def probe_answered(self, now: float, *, rests_s: float = 0.0) -> None:
        """Notes that a probe over UDP was answered."""
        self.proven(Transport.UDP, now, rests_s=rests_s)
        if self.transport is Transport.UDP:
            return
        self._row = self._row + 1 if now - self._answered_at <= ANSWERS_IN_A_ROW_WITHIN_S else 1
        self._answered_at = now
        if self._row >= self.needed or self.both(now):
            self._change(Transport.UDP, now)
            self._returned_at = now

    def both(self, now: float) -> bool:
        """Returns whether to send over UDP as well as over the WebSocket."""
        doubtful = self._proven_at is None or self._without_proof_s(now) > IN_DOUBT_AFTER_S
        return self.transport is Transport.WEBSOCKET and doubtful

    def tick(self, now: float) -> None:
        """Applies the passage of time; call it several times per second."""
        if self.transport is Transport.UDP and self._without_proof_s(now) > FALL_BACK_AFTER_S:
            soon = self._returned_at is not None and now - self._returned_at < SOON_S
            self.needed = min(2 * self.needed, MAX_NEEDED) if soon else MIN_NEEDED
            self._change(Transport.WEBSOCKET, now)

    def probe_due(self, now: float) -> bool:
        """Returns whether to send a probe over UDP now. True once for each due probe."""
        if now < self._next_probe:
            return False
        in_doubt = self.both(now) or self._without_proof_s(now) > IN_DOUBT_AFTER_S
        if self.transport is Transport.UDP and not in_doubt:
            return False
        self._next_probe = now + (PROBE_IN_DOUBT_S if in_doubt else PROBE_S)
        return True

    def _without_proof_s(self, now: float) -> float:
        return now - (self._changed_at if self._proven_at is None else self._proven_at)

    def _change(self, transport: Transport, now: float) -> None:
        self.transport = transport
        self._changed_at = now
        self._proven_at = now if transport is Transport.UDP else None
        self._row = 0
