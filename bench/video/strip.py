"""The clock strip in the simulator's pictures, as read back by a page: its time, and the age of a picture (no I/O).

The strip is 20 cells: black, white, 16 bits of Gray code (the highest first) of the Unix time in ms modulo 65,536 when
the picture was rendered, the parity of these bits, its complement.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

CELLS: Final = 20
WRAP_MS: Final = 1 << 16
AHEAD_MS: Final = 1000
"""A picture may appear to be this far in the future, if the clocks of two programs differ."""
_BITS: Final = 16


def encode(unix_ms: int) -> int:
    """Returns the cells of a picture rendered then, as a number: cell 0 is the highest of 20 bits, white is 1."""
    clock = unix_ms % WRAP_MS
    gray = clock ^ clock >> 1
    parity = gray.bit_count() & 1
    return 1 << 18 | gray << 2 | parity << 1 | (1 - parity)


def clock_ms(cells: int) -> int | None:
    """Decodes these cells, 0..65535; None if they are no strip."""
    if cells >> 18 != 1 or (cells >> 1 & 1) == (cells & 1):
        return None
    gray = cells >> 2 & (1 << _BITS) - 1
    if gray.bit_count() & 1 != cells >> 1 & 1:
        return None
    clock, shift = gray, 1
    while shift < _BITS:
        clock ^= clock >> shift
        shift <<= 1
    return clock


class Sight(NamedTuple):
    """A picture when it was first seen, by Unix time in ms."""

    seen_ms: float
    rendered_ms: float

    @property
    def delay_ms(self) -> float:
        return self.seen_ms - self.rendered_ms


def sight(seen_ms: float, clock: int) -> Sight:
    """Resolves the clock to a time from 64.5 s before it was seen to a second after."""
    age = (seen_ms - clock + AHEAD_MS) % WRAP_MS - AHEAD_MS
    return Sight(seen_ms, seen_ms - age)


@dataclass
class Screen:
    """What a page saw: `take` its readings (Unix ms, cells) in their order."""

    sights: list[Sight] = field(default_factory=list)
    """Each picture once, when it was first seen."""
    misread: int = 0
    """Readings that are no strip: a torn or missing picture."""
    backward: int = 0
    """Pictures seen after a newer one."""
    _seen: set[int] = field(default_factory=set)
    _newest_ms: float = 0.0

    def take(self, readings: Iterable[tuple[float, int]]) -> None:
        for seen_ms, cells in readings:
            clock = clock_ms(cells)
            if clock is None:
                self.misread += 1
                continue
            one = sight(seen_ms, clock)
            if round(one.rendered_ms) in self._seen:
                continue
            self._seen.add(round(one.rendered_ms))
            if one.rendered_ms < self._newest_ms:
                self.backward += 1
            self._newest_ms = max(self._newest_ms, one.rendered_ms)
            self.sights.append(one)

    def between(self, begin_ms: float, end_ms: float) -> list[Sight]:
        """Returns those seen in this time."""
        return [one for one in self.sights if begin_ms <= one.seen_ms < end_ms]
