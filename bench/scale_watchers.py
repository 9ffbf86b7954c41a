"""What the browsers of the scale benchmark read: one every frame, the others only what must not be lost."""

from __future__ import annotations

import time
from collections import Counter
from struct import Struct
from typing import Final

from bench.load_frames import EVENT_KINDS, STATE_KINDS

_EVENT_KINDS: Final = frozenset(EVENT_KINDS)
_STATE_KINDS: Final = frozenset(STATE_KINDS)
_TAG: Final = Struct("<I")
_STAMP: Final = Struct("<QI")
_STAMP_AT: Final = 14
"""Behind tag and header."""
_AGE_STEP_MS: Final = 1.0


class EventsOnly:
    """Counts the transactional frames of each drone, which are numbered 1, 2, 3, ..."""

    def __init__(self) -> None:
        self.events = 0
        self.out_of_order = 0
        """Frames whose number does not follow the last: after a gap, repeated, or late."""
        self.losses_reported = 0
        self._last: dict[int, int] = {}

    def begin(self) -> None:
        """Called when the flight begins."""

    def reported(self, text: bytes) -> None:
        """Takes a text message."""
        if text.startswith(b'{"type":"lost"'):
            self.losses_reported += 1

    def came(self, message: bytes) -> None:
        """Takes a binary message."""
        at, end = 0, len(message)
        while at < end:
            if message[at + 11] | message[at + 12] << 8 in _EVENT_KINDS:
                self._event(message, at)
            at += message[at + 5] + 16

    def _event(self, message: bytes, at: int) -> None:
        (drone_id,) = _TAG.unpack_from(message, at)
        _, number = _STAMP.unpack_from(message, at + _STAMP_AT)
        self.events += 1
        if number != self._last.get(drone_id, 0) + 1:
            self.out_of_order += 1
        self._last[drone_id] = number


class Everything(EventsOnly):
    """Also measures the age of each state frame on arrival, and the greatest age of a drone's known state."""

    def __init__(self) -> None:
        super().__init__()
        self._ages: Counter[int] = Counter()
        self._newest_us: dict[int, int] = {}
        self._stalest_us = 0.0

    def begin(self) -> None:
        self._ages.clear()
        self._newest_us.clear()
        self._stalest_us = 0.0

    def came(self, message: bytes) -> None:
        now_us = int(time.monotonic() * 1e6)
        at, end = 0, len(message)
        newest = self._newest_us
        while at < end:
            kind = message[at + 11] | message[at + 12] << 8
            if kind in _EVENT_KINDS:
                self._event(message, at)
            elif kind in _STATE_KINDS:
                (drone_id,) = _TAG.unpack_from(message, at)
                sent_us, _ = _STAMP.unpack_from(message, at + _STAMP_AT)
                self._ages[int((now_us - sent_us) / 1e3 / _AGE_STEP_MS)] += 1
                before_us = newest.get(drone_id)
                if before_us is not None:
                    self._stalest_us = max(self._stalest_us, now_us - before_us)
                if before_us is None or sent_us > before_us:
                    newest[drone_id] = sent_us
            at += message[at + 5] + 16

    def ages_ms(self) -> list[float]:
        """Of every state frame, in steps of a millisecond."""
        return [step * _AGE_STEP_MS for step, count in sorted(self._ages.items()) for _ in range(count)]

    def stalest_ms(self) -> float:
        """The greatest age of the newest known data of a drone, just before newer data arrived.

        Includes the interval between two frames of a drone.
        """
        return self._stalest_us / 1e3
