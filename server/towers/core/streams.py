"""The order of what two towers tell each other over a bus that may lose, repeat and delay messages.

Each tower numbers what it sends to another one: a stream, and a sequence in it. The receiver takes a stream in order or
not at all. A gap, a silence and a late message break it; nothing of a broken stream is taken any more, and what it had
established is dropped. The sender then opens another one and says everything again.

Sans-I/O: `now` is passed in.
"""

from dataclasses import dataclass
from typing import Final

from wire.lateness import Lateness

BEAT_EVERY_S: Final = 0.2
SILENT_AFTER_S: Final = 1.0
"""A tower that was not heard for this long counts as lost: five beats in a row are missing."""
LATE_AFTER_S: Final = 0.5
"""A message this late breaks its stream: a bus that lags must not look alive. As late as sticks may be."""
REOPEN_EVERY_S: Final = 0.5


@dataclass(frozen=True)
class Taken:
    """What became of a received message."""

    taken: bool
    """It is to be acted upon."""
    opened: bool = False
    """It is the first of a new stream: what the last one had established is void."""
    broke: bool = False
    """The present stream has ended with it: what it had established is void."""


IGNORED: Final = Taken(False)


class IncomingStream:
    """What one other tower sends."""

    def __init__(self) -> None:
        self._number = 0
        self._next = 0
        self._heard_at = float("-inf")
        self._lateness = Lateness()
        self.is_open = False
        self.late_s = 0.0
        """How much longer than the fastest one the newest message was under way."""

    @property
    def heard(self) -> int:
        """The number of the open stream, for the sender; 0: none."""
        return self._number if self.is_open else 0

    def receive(self, number: int, sequence: int, sent_ms: int, now: float) -> Taken:
        """Judges one message by its header."""
        self.late_s = self._lateness.late_by(sent_ms, now)
        is_late = self.late_s > LATE_AFTER_S
        broke = self.check(now)
        if number > self._number and sequence == 0 and not is_late:
            broke = broke or self.is_open
            self._number, self._next, self._heard_at, self.is_open = number, 1, now, True
            return Taken(True, opened=True, broke=broke)
        if number != self._number or not self.is_open or sequence < self._next:
            return Taken(False, broke=broke)
        if sequence > self._next or is_late:
            self.is_open = False
            return Taken(False, broke=True)
        self._next += 1
        self._heard_at = now
        return Taken(True, broke=broke)

    def check(self, now: float) -> bool:
        """Whether the open stream has just ended in silence. Call it several times a second."""
        if self.is_open and now - self._heard_at > SILENT_AFTER_S:
            self.is_open = False
            return True
        return False


class OutgoingStream:
    """What this tower sends to one other."""

    def __init__(self) -> None:
        self.number = 0
        self._sequence = 0
        self._opened_at = float("-inf")
        self._confirmed = False

    def open(self, now: float) -> None:
        """Begins another stream. What was established by the last one is to be said again."""
        self.number += 1
        self._sequence = 0
        self._opened_at = now
        self._confirmed = False

    def next(self) -> int:
        """The sequence of the next message."""
        sequence = self._sequence
        self._sequence += 1
        return sequence

    def reported(self, heard: int) -> None:
        """The receiver tells which stream it has open."""
        self._confirmed = heard == self.number

    def must_open(self, now: float) -> bool:
        """Whether the receiver does not have the present stream, and has had the time to."""
        return not self._confirmed and now - self._opened_at >= REOPEN_EVERY_S
