"""By which way an agent's datagrams go: UDP, or the control channel's WebSocket where UDP is blocked. No I/O.

What counts is proof that something of ours arrived: an answer to a ping, or a report that counts more than the last one
did. What merely comes in proves one direction only. Time and proof decide (the time for which pings rest is left out):

    transport    what                                                        next
    UDP          no proof for FALL_BACK_AFTER_S                              WebSocket
    WebSocket    as many probes in a row answered over UDP as `needed`       UDP
    WebSocket    one answered, and no proof over the WebSocket yet, or not   UDP
                 for IN_DOUBT_AFTER_S

While the WebSocket gives no proof either, datagrams go both ways (`both`): after a black-out of everything UDP is back
at once, where TCP still waits for its next try. Whichever copy comes first counts.

`needed` doubles each time that UDP fails again soon after a return, so that a way that comes and goes is not taken at
each of its turns.
"""

from enum import StrEnum
from typing import Final

FALL_BACK_AFTER_S: Final = 1.5
"""Some six proofs are due in this time, with those of the probes that are sent in doubt."""

IN_DOUBT_AFTER_S: Final = 0.75
PROBE_IN_DOUBT_S: Final = 0.2
PROBE_S: Final = 0.5

ANSWERS_IN_A_ROW_WITHIN_S: Final = 1.5
"""A longer gap between two answered probes begins the row again."""

MIN_NEEDED: Final = 2
MAX_NEEDED: Final = 32
"""16 s of answers."""

SOON_S: Final = 60.0


class Transport(StrEnum):
    """The state for browsers."""

    UDP = "udp"
    WEBSOCKET = "websocket"


class TransportChoice:
    """One for each link, at the agent. Begins with UDP."""

    def __init__(self, now: float) -> None:
        self.transport = Transport.UDP
        self.needed = MIN_NEEDED
        self._proven_at: float | None = now
        """Of the present transport; None: none since the change."""
        self._changed_at = now
        self._returned_at: float | None = None
        self._next_probe = now
        self._row = 0
        self._answered_at = now

    def proven(self, transport: Transport, now: float, *, rests_s: float = 0.0) -> None:
        """Something sent by this transport is known to have arrived. `rests_s`: pings now pause this much longer than
        usual, so that no further proof is due (wire.keepalive)."""
        if transport is self.transport:
            self._proven_at = now + rests_s

    def probe_answered(self, now: float, *, rests_s: float = 0.0) -> None:
        """A probe over UDP was answered."""
        self.proven(Transport.UDP, now, rests_s=rests_s)
        if self.transport is Transport.UDP:
            return
        self._row = self._row + 1 if now - self._answered_at <= ANSWERS_IN_A_ROW_WITHIN_S else 1
        self._answered_at = now
        if self._row >= self.needed or self.both(now):
            self._change(Transport.UDP, now)
            self._returned_at = now

    def both(self, now: float) -> bool:
        """Whether to send over UDP as well as over the WebSocket."""
        doubtful = self._proven_at is None or self._without_proof_s(now) > IN_DOUBT_AFTER_S
        return self.transport is Transport.WEBSOCKET and doubtful

    def tick(self, now: float) -> None:
        """Time has passed: several times a second."""
        if self.transport is Transport.UDP and self._without_proof_s(now) > FALL_BACK_AFTER_S:
            soon = self._returned_at is not None and now - self._returned_at < SOON_S
            self.needed = min(2 * self.needed, MAX_NEEDED) if soon else MIN_NEEDED
            self._change(Transport.WEBSOCKET, now)

    def probe_due(self, now: float) -> bool:
        """Whether to send a probe over UDP now. True once for each time that it is."""
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
