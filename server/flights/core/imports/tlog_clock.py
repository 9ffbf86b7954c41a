"""The time of a telemetry log's entries by the autopilot's clock. Pure.

A `.tlog` has the time of day of the computer that wrote it. That clock may be set in flight: by NTP, or by the first
fix. So each entry keeps its distance from the one before by the boot time in the autopilot's messages, and a jump of
the other clock is reported, and never part of a duration. The last clock counts: it is set because it was wrong.

- Within `TOLERANCE_US` the entries keep their own times: a link delays frames, and holds some of them up.
- The jump was at the greatest step of the written times between two messages with a boot time.
- A reboot, or a log without boot times, shows a jump only where the time goes back, or leaps by more than a day.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from struct import Struct
from typing import Final, NamedTuple

from wire.dialect import mavlink
from wire.frames import message_id, payload, source

TOLERANCE_US: Final = 3_000_000
MAX_STEP_US: Final = 24 * 3600 * 1_000_000
ANCHOR_US: Final = 60_000_000
"""The two clocks drift: they are compared anew this often."""
HELD_UP_US: Final = 60_000_000
"""Frames that were held up come all at once: two jumps so near each other are one, or none."""
OLDER_US: Final = 5_000_000
"""Messages may overtake each other; more than this is a reboot."""
MAX_JUMPS: Final = 20

_WRAP_US: Final = 2**32 * 1000
_MS: Final = Struct("<I")
_OFFSETS: Final = {
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: 8,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 0,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 0,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 0,
}
"""Where `time_boot_ms` is in the payload."""


class ClockJump(NamedTuple):
    """The clock of the computer that wrote the log was set. `at_us`: by the last clock; `by_s`: negative: back."""

    at_us: int
    by_s: float


class _Shift(NamedTuple):
    """From this entry on, `add_us` more is added to the written times."""

    first: int
    at_us: int
    add_us: int


class TlogClock:
    """Feed it the entries of one vehicle in order, then ask for `times` and `jumps`."""

    def __init__(self) -> None:
        self._shifts: list[_Shift] = []
        self._offset_us = 0
        self._count = 0
        self._stamp_us: int | None = None
        """Of the entry before."""
        self._anchor: tuple[int, int] | None = None
        """A time of the flight, and the boot time then, in microseconds."""
        self._newest_us = 0
        """Boot time."""
        self._step = (0, 0, 0)
        """The greatest step since the last boot time: its entry, its time before it, and how long it was."""

    def take(self, stamp_us: int, frame: bytes) -> None:
        """`stamp_us`: as it was written, microseconds since 1970."""
        index, before_us = self._count, self._stamp_us
        self._count += 1
        self._stamp_us = stamp_us
        if before_us is not None and abs(stamp_us - before_us) >= abs(self._step[2]):
            self._step = index, before_us + self._offset_us, stamp_us - before_us
        boot_us = _boot_us(frame)
        at_us = stamp_us + self._offset_us
        if boot_us is not None:
            self._compare(at_us, boot_us)
        elif self._anchor is None:
            self._check_step()

    def _compare(self, at_us: int, boot_us: int) -> None:
        is_another = _later_us(boot_us, self._newest_us) < -OLDER_US
        self._newest_us = boot_us
        if self._anchor is None or is_another:
            before_us = self._offset_us
            self._check_step()
            self._anchor = at_us + self._offset_us - before_us, boot_us
            return
        since_us = _later_us(boot_us, self._anchor[1])
        wrong_us = at_us - self._anchor[0] - since_us
        if abs(wrong_us) > TOLERANCE_US:
            self._shift(-wrong_us)
        elif since_us > ANCHOR_US:
            self._anchor = at_us, boot_us
        self._step = (self._count, 0, 0)

    def _check_step(self) -> None:
        """Without a boot time to compare with."""
        if not -TOLERANCE_US <= self._step[2] <= MAX_STEP_US:
            self._shift(-self._step[2])
        self._step = (self._count, 0, 0)

    def _shift(self, add_us: int) -> None:
        self._shifts.append(_Shift(self._step[0], self._step[1], add_us))
        self._offset_us += add_us

    def times(self, stamps_us: Iterable[int]) -> Iterator[int]:
        """Yields the time of each entry, never back. `stamps_us`: of the same entries."""
        offset_us, shifts, last_us = -self._offset_us, iter(self._shifts), 0
        following = next(shifts, None)
        for index, stamp_us in enumerate(stamps_us):
            while following is not None and index >= following.first:
                offset_us += following.add_us
                following = next(shifts, None)
            last_us = max(last_us, stamp_us + offset_us)
            yield last_us

    def jumps(self) -> list[ClockJump]:
        """In order, the first `MAX_JUMPS`."""
        found: list[tuple[int, int]] = []
        for _, at_us, add_us in self._shifts:
            if found and at_us - found[-1][0] <= HELD_UP_US:
                found[-1] = at_us, found[-1][1] + add_us
            else:
                found.append((at_us, add_us))
        real = [one for one in found if abs(one[1]) > TOLERANCE_US]
        return [ClockJump(at_us - self._offset_us, -add_us / 1e6) for at_us, add_us in real[:MAX_JUMPS]]


def _later_us(one_us: int, other_us: int) -> int:
    """The counter of boot times begins anew after 50 days."""
    return (one_us - other_us + _WRAP_US // 2) % _WRAP_US - _WRAP_US // 2


def _boot_us(frame: bytes) -> int | None:
    offset = _OFFSETS.get(message_id(frame))
    if offset is None or source(frame)[1] != mavlink.MAV_COMP_ID_AUTOPILOT1:
        return None
    (boot_ms,) = _MS.unpack_from(payload(frame).ljust(offset + _MS.size, b"\0"), offset)
    return 1000 * boot_ms if boot_ms else None
