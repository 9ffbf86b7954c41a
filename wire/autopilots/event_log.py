"""The newest events of one autopilot, each once (MAVLink's event interface). Pure.

Events are numbered one by one, modulo 65536, anew at each start of the autopilot. Who misses one asks for it, and it
comes late; who asks for what it has gets it twice.
"""

from struct import Struct
from typing import Final, NamedTuple

from wire.frames import payload

KEPT: Final = 64
_EVENT: Final = Struct("<IIHBBB40s")
_SEQUENCES: Final = 1 << 16


class LoggedEvent(NamedTuple):
    """`number`: of its kind. `time_ms`: since the autopilot started. `arguments`: packed."""

    number: int
    time_ms: int
    arguments: bytes


def read_event(frame: bytes) -> tuple[int, LoggedEvent]:
    """The sequence, and the event of an EVENT frame."""
    body = payload(frame)[: _EVENT.size].ljust(_EVENT.size, b"\0")
    number, time_ms, sequence, _, _, _, arguments = _EVENT.unpack(body)
    return sequence, LoggedEvent(number, time_ms, arguments)


def ahead(sequence: int, other: int) -> int:
    """How far `sequence` is after `other`; negative: before it."""
    return (sequence - other + _SEQUENCES // 2) % _SEQUENCES - _SEQUENCES // 2


def before(sequence: int, count: int = 1) -> int:
    """The sequence `count` events earlier."""
    return (sequence - count) % _SEQUENCES


class EventLog:
    """Feed it EVENT frames."""

    def __init__(self) -> None:
        self._events: dict[int, LoggedEvent] = {}
        self.newest: int | None = None

    def __contains__(self, sequence: int) -> bool:
        return sequence in self._events

    def get(self, sequence: int) -> LoggedEvent | None:
        """The event with this sequence, if it has come and is still kept."""
        return self._events.get(sequence)

    def forget(self) -> None:
        """The autopilot counts anew."""
        self._events.clear()
        self.newest = None

    def take(self, frame: bytes) -> bool:
        """Whether the event is new here. One that another event contradicts shows that the autopilot has restarted."""
        sequence, event = read_event(frame)
        if self._events.get(sequence) == event:
            return False
        if self.newest is not None:
            further = ahead(sequence, self.newest)
            restarted = further > 0 and event.time_ms < self._events[self.newest].time_ms
            if restarted or sequence in self._events or further <= -KEPT:
                self.forget()
        self._events[sequence] = event
        if self.newest is None or ahead(sequence, self.newest) > 0:
            self.newest = sequence
            for old in [one for one in self._events if ahead(one, sequence) <= -KEPT]:
                del self._events[old]
        return True
