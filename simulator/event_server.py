"""PX4's side of MAVLink's event interface (its sources, 1.16).

It numbers its events, from ten before zero on, and keeps the newest 20. Each 3 s, and at its first event, it names the
newest sequence. What is asked for is sent again; what is kept no more is named.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

from simulator.dialect import Event, EventError, EventSequence, Message, RequestEvent

KEPT = 20
FIRST = 65525
NAMED_EVERY_S = 3.0
SEQUENCES = 1 << 16


class EventServer:
    def __init__(self, send: Callable[[Message], None]) -> None:
        self._send = send
        self._kept: OrderedDict[int, Event] = OrderedDict()
        self._next = FIRST
        self._name_at_s = 0.0

    def tell(self, event: Event, now_s: float) -> None:
        """Numbers and sends a new event."""
        event.sequence, event.time_boot_ms = self._next, round(now_s * 1000)
        if not self._kept:
            self._name(event.sequence, now_s, is_reset=True)
        self._kept[event.sequence] = event
        if len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        self._next = (self._next + 1) % SEQUENCES
        self._send(event)

    def update(self, now_s: float) -> None:
        if self._kept and now_s >= self._name_at_s:
            self._name((self._next - 1) % SEQUENCES, now_s)

    def asked(self, request: RequestEvent, sender: tuple[int, int]) -> None:
        count = (request.last_sequence - request.first_sequence) % SEQUENCES + 1
        for number in range(min(count, KEPT * 2)):
            sequence = (request.first_sequence + number) % SEQUENCES
            event = self._kept.get(sequence)
            if event is not None:
                self._send(event)
            else:
                self._send(EventError(sequence, next(iter(self._kept), sequence), *sender))

    def _name(self, sequence: int, now_s: float, *, is_reset: bool = False) -> None:
        self._name_at_s = now_s + NAMED_EVERY_S
        self._send(EventSequence(sequence, is_reset=is_reset))
