"""What an autopilot does with one number of a plan item: keeps, rounds, drops or refuses it. Pure.

A rule covers one field of one command; an autopilot's table (`wire/autopilots/*_plans.py`) combines rules.
Numbers are those of MISSION_ITEM_INT, 32 bits wide; None is NaN ("as the autopilot likes").
"""

import struct
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Final, NamedTuple, Protocol

from wire.plan_room import Room
from wire.plans import PlanItem, PlanKind, as_float32


class Effect(IntEnum):
    """The consequence of a number that is not kept as sent. The larger, the worse."""

    SAME = 0
    """The number is kept."""
    QUIET = 1
    """Another number with the same meaning, or a field without meaning in this command."""
    FLIGHT = 2
    """The autopilot does not do what was requested: the pilot is told before the plan is sent."""
    REFUSED = 3
    """The autopilot refuses it, or has no room for it and its behaviour is unknown."""


class Kept(NamedTuple):
    """One field. `value` must come back (REFUSED: the value sent, which cannot come back).

    `within`: tolerance for arithmetic that differs between processors. `is_angle`: degrees, 360 is 0.
    """

    value: float | None
    effect: Effect
    within: float = 0.0
    is_angle: bool = False

    def comes_back_as(self, got: float | None, *, within: float = 0.0) -> bool:
        """Returns whether `got` is that value."""
        if self.value is None or got is None:
            return self.value is got
        off = abs(self.value - got)
        if self.is_angle:
            off = min(off % 360.0, 360.0 - off % 360.0)
        return off <= max(self.within, within)


class ItemKept(NamedTuple):
    """An item as it comes back: all fields of a PlanItem, param1 to param4 separately.

    `height_step_m`: tolerance of the height if the autopilot acknowledged the item.
    """

    fields: Mapping[str, Kept]
    height_step_m: float = 0.0


class KeptFields(Protocol):
    """The table of one autopilot."""

    @property
    def name(self) -> str:
        """The autopilot's name for people."""

    @property
    def room(self) -> Room:
        """How many items it has room for."""

    @property
    def lacks(self) -> frozenset[int]:
        """Mission commands that other releases of it know and this one refuses."""

    def to_send(self, kind: PlanKind, item: PlanItem) -> PlanItem:
        """Adapts an item so that it loses as little as possible."""

    def kept(self, kind: PlanKind, item: PlanItem) -> ItemKept:
        """Returns what the autopilot keeps of an item that is sent unchanged."""


Rule = Callable[[float | None], Kept]
_ZERO: Final = Kept(0.0, Effect.SAME)


def becomes(sent: float | None, value: float | None, effect: Effect = Effect.FLIGHT) -> Kept:
    """`value` in place of `sent`, with this effect if they differ."""
    return Kept(value, Effect.SAME if sent == value else effect)


def refused(sent: float | None) -> Kept:
    return Kept(sent, Effect.REFUSED)


def same(sent: float | None) -> Kept:
    """A float; NaN is refused."""
    return refused(sent) if sent is None else becomes(sent, sent)


def same_or_open(sent: float | None) -> Kept:
    """A float, or NaN."""
    return becomes(sent, sent)


def unused(sent: float | None) -> Kept:
    """Without meaning for this command: 0 comes back. NaN is refused."""
    return refused(sent) if sent is None else becomes(sent, 0.0, Effect.QUIET)


def unused_or_open(sent: float | None) -> Kept:
    return becomes(sent, 0.0, Effect.QUIET)


def dropped(sent: float | None) -> Kept:
    """Has a meaning in MAVLink but none for this autopilot: 0 comes back. NaN is refused."""
    return refused(sent) if sent is None else becomes(sent, 0.0)


def dropped_or_open(sent: float | None) -> Kept:
    return dropped(sent) if sent is not None else Kept(0.0, Effect.QUIET)


def dropped_but(*meaningless: float) -> Rule:
    """`dropped`, except that these numbers request nothing."""

    def rule(sent: float | None) -> Kept:
        return Kept(0.0, Effect.QUIET) if sent in meaningless else dropped(sent)

    return rule


def whole(least: int, most: int) -> Rule:
    """A whole number, truncated towards 0. Refused outside the range: it would wrap or saturate, depending on the
    processor."""

    def rule(sent: float | None) -> Kept:
        if sent is None or not least <= int(sent) <= most:
            return refused(sent)
        return becomes(sent, float(int(sent)))

    return rule


BYTE: Final = whole(0, 0xFF)
SIGNED_BYTE: Final = whole(-0x80, 0x7F)
WORD: Final = whole(0, 0xFFFF)
SIGNED_WORD: Final = whole(-0x8000, 0x7FFF)


def flag(sent: float | None) -> Kept:
    """1 for numbers above 0, else 0. NaN is refused."""
    return refused(sent) if sent is None else becomes(sent, 1.0 if sent > 0.0 else 0.0)


def flag_or_open(sent: float | None) -> Kept:
    return flag(sent) if sent is not None else Kept(0.0, Effect.QUIET)


def in_hundredths(sent: float | None) -> Kept:
    """Whole hundredths in 16 bits, unsigned."""
    if sent is None or not 0 <= (stored := int(as_float32(sent * 100.0))) <= 0xFFFF:
        return refused(sent)
    return becomes(sent, as_float32(stored * as_float32(0.01)))


def half_float(sent: float | None) -> Kept:
    """A 16-bit float."""
    if sent is None or abs(sent) > 65_504.0:
        return refused(sent)
    (value,) = struct.unpack("<e", struct.pack("<e", sent))
    return becomes(sent, value)._replace(within=abs(sent) * 2**-10)


MAX_TURN_DEG: Final = 3600.0
"""Beyond ten turns, single precision in radians loses thousandths of a degree."""


def heading_or_open(sent: float | None) -> Kept:
    """Degrees, converted to radians from 0 to 2 pi and back: the same direction, but not exactly the same number."""
    if sent is None:
        return Kept(None, Effect.SAME)
    if abs(sent) > MAX_TURN_DEG:
        return refused(sent)
    effect = Effect.SAME if 0.0 <= sent < 360.0 else Effect.QUIET
    return Kept(sent % 360.0, effect, within=1e-3, is_angle=True)


def always(value: float) -> Rule:
    """The autopilot knows only this value."""

    def rule(sent: float | None) -> Kept:
        return becomes(sent, value)

    return rule


def fields_of(item: PlanItem) -> dict[str, float | None]:
    """Keyed by the published field names: command, frame, param1 to param4, x, y, z, autocontinue."""
    p1, p2, p3, p4 = item.params
    return {
        "command": float(item.command),
        "frame": float(item.frame),
        "param1": p1,
        "param2": p2,
        "param3": p3,
        "param4": p4,
        "x": float(item.x),
        "y": float(item.y),
        "z": item.z,
        "autocontinue": float(item.autocontinue),
    }


def item_of(fields: Mapping[str, float | None]) -> PlanItem:
    """The inverse of `fields_of`."""

    def number(name: str) -> float:
        value = fields[name]
        return 0.0 if value is None else value

    return PlanItem(
        int(number("command")),
        int(number("frame")),
        (fields["param1"], fields["param2"], fields["param3"], fields["param4"]),
        int(number("x")),
        int(number("y")),
        number("z"),
        int(number("autocontinue")),
    )
