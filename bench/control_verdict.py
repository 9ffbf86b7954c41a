"""Did a hold end safely, and was everybody notified in advance? Computed from a flight's record. No I/O.

The rule: a vehicle may descend only in a return or a landing that was announced before it began. Times are seconds of
one clock, heights metres above home.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from bench.tap import ModeSeen, Motion, Stick
from wire.autopilots import px4_multicopter

SETTLED_AFTER_S: Final = 6.0
"""After a full climb or descent the height is not settled before this."""
SUNK_M: Final = 2.0
GROUND_M: Final = 0.5
IN_THE_AIR_M: Final = 1.5
DRIFT_FOR_S: Final = 12.0
LEFT_M: Final = 20.0
"""A hold that is farther away after DRIFT_FOR_S has not stopped."""
DUE_WITHIN_S: Final = 3.0
"""How much earlier or later than announced a return may begin."""
COMES_DOWN: Final = frozenset({6, 9, 21})
"""RTL, LAND, SMART_RTL."""
HOLDS: Final = frozenset({2, 17, 4})
"""ALT_HOLD, BRAKE, GUIDED."""
STAYS: Final = frozenset({17, 4})
MODE_NAMES: Final = {
    0: "STABILIZE",
    2: "ALT_HOLD",
    3: "AUTO",
    4: "GUIDED",
    5: "LOITER",
    6: "RTL",
    9: "LAND",
    16: "POSHOLD",
    17: "BRAKE",
    21: "SMART_RTL",
}


@dataclass(frozen=True, slots=True)
class ModeTable:
    """The custom_modes of one autopilot: that may descend, in which a hold waits, and that need no sticks for it."""

    names: Mapping[int, str]
    comes_down: frozenset[int]
    holds: frozenset[int]
    stays: frozenset[int]

    def name(self, number: int) -> str:
        return self.names.get(number, str(number))


ARDUCOPTER: Final = ModeTable(MODE_NAMES, COMES_DOWN, HOLDS, STAYS)
_ALTCTL, _LOITER = 2 << 16, 4 << 16 | 3 << 24
_RTL, _LAND, _PRECLAND = (4 << 16 | sub << 24 for sub in (5, 6, 9))
PX4: Final = ModeTable(
    {mode.custom_mode: mode.name for mode in px4_multicopter.PROFILE.modes},
    frozenset({_RTL, _LAND, _PRECLAND}),
    frozenset({_ALTCTL, _LOITER}),
    frozenset({_LOITER}),
)


@dataclass(frozen=True, slots=True)
class Announcement:
    """The hold of the drone as reported to one person at this moment (the HoldView, or None)."""

    at: float
    who: str
    hold: dict[str, Any] | None


@dataclass(frozen=True, slots=True)
class Record:
    """One flight. `at`: the moment when the pilot stopped flying, in whatever way."""

    at: float
    motions: Sequence[Motion]
    modes: Sequence[ModeSeen]
    sticks: Sequence[Stick]
    reported: Sequence[Announcement]
    asked: Sequence[float]
    """Times at which the agent requested a mode."""
    present: frozenset[str]
    """The persons with a live connection afterwards, who must be notified."""
    old_holder: int | None
    """The holder whose sticks must not arrive afterwards (`bench.tap`)."""
    standing: bool = False
    """Everybody could read beforehand what the drone does without its tower: this announces it without a HoldView."""
    table: ModeTable = ARDUCOPTER
    has_agent: bool = True
    """Without one nobody can be told of a hold; that the drone is silent is told by the tower."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """`wrong` is empty if all is well. Times are seconds after the trigger; NaN if there is none."""

    wrong: tuple[str, ...]
    held_s: float
    stays_s: float
    drift_m: float
    """The farthest from where stage two began."""
    returned_s: float
    announced_s: float
    lowest_m: float
    end: str
    foreign_frames: int


def judge(record: Record) -> Verdict:
    """Judges everything recorded after `record.at`."""
    modes = [seen for seen in record.modes if seen.at >= record.at]
    motions = [motion for motion in record.motions if motion.at >= record.at]
    before = next((seen.custom_mode for seen in reversed(record.modes) if seen.at < record.at), -1)
    table = record.table
    held_at = _first(record, modes, table.holds)
    stays_at = _first(record, modes, table.stays)
    came_down_at = _came_down(modes, before, table)
    wrong = [*_sinking(record, motions, modes, before)]
    if motions and motions[0].alt_m < IN_THE_AIR_M:
        wrong.append("it was not in the air when its pilot was lost")
    wrong += _forgotten(record, modes) if record.has_agent else []
    announced = {who: _announced(record, who, came_down_at) for who in sorted(record.present)}
    if came_down_at is not None and not record.standing:
        wrong += [
            f"{who} was not told of the {_name(modes, came_down_at, table)}"
            for who, at in announced.items()
            if at is None
        ]
    if came_down_at is not None and not record.present and not record.standing:
        wrong.append("nobody was there to be told")
    if came_down_at is not None and not record.standing:
        wrong += _mistimed(record, came_down_at)
    drift_m = _drift(motions, stays_at, came_down_at)
    if drift_m > LEFT_M:
        wrong.append(f"went {drift_m:.1f} m away in a hold that stays")
    reported_at = min((at for at in announced.values() if at is not None), default=math.nan)
    last = motions[-1] if motions else None
    end_mode = table.name(modes[-1].custom_mode) if modes else "?"
    armed = modes[-1].armed if modes else False
    height = f"{last.alt_m:.1f} m" if last else "?"
    return Verdict(
        wrong=tuple(wrong),
        held_s=_after(held_at, record.at),
        stays_s=_after(stays_at, record.at),
        drift_m=drift_m,
        returned_s=_after(came_down_at, record.at),
        announced_s=max(reported_at - record.at, 0.0),
        lowest_m=min((motion.alt_m for motion in motions), default=math.nan),
        end=f"{end_mode} {height}{'' if armed else ', disarmed'}",
        foreign_frames=_foreign(record, held_at),
    )


def _first(record: Record, modes: Sequence[ModeSeen], wanted: frozenset[int]) -> float | None:
    """Returns when one of them was first seen after the agent requested a mode, because it may equal the mode flown
    before."""
    asked_at = next((at for at in record.asked if at >= record.at), math.inf)
    return next((seen.at for seen in modes if seen.custom_mode in wanted and seen.at >= asked_at), None)


def _came_down(modes: Sequence[ModeSeen], before: int, table: ModeTable) -> float | None:
    """Returns when it first changed to a mode that descends."""
    last = before
    for seen in modes:
        if seen.custom_mode in table.comes_down and last not in table.comes_down:
            return seen.at
        last = seen.custom_mode
    return None


def _sinking(record: Record, motions: Sequence[Motion], modes: Sequence[ModeSeen], before: int) -> list[str]:
    """Returns the descents that no return and no landing explains."""
    changes = [(record.at, before), *((seen.at, seen.custom_mode) for seen in modes)]
    reference_m: float | None = None
    number = 0
    for motion in motions:
        while number + 1 < len(changes) and changes[number + 1][0] <= motion.at:
            number += 1
        if changes[number][1] in record.table.comes_down:
            reference_m = None
            continue
        seconds = motion.at - record.at
        if modes and not _armed_at(modes, motion.at):
            continue
        mode = record.table.name(changes[number][1])
        if motion.alt_m < GROUND_M and motion.climb_mps < -0.3:
            return [f"hit the ground at {-motion.climb_mps:.1f} m/s after {seconds:.1f} s in {mode}"]
        if seconds < SETTLED_AFTER_S:
            continue
        reference_m = motion.alt_m if reference_m is None else reference_m
        if motion.alt_m < reference_m - SUNK_M:
            return [f"sank: {motion.alt_m:.1f} m after {seconds:.1f} s, was {reference_m:.1f} m, in {mode}"]
    return []


def _armed_at(modes: Sequence[ModeSeen], at: float) -> bool:
    return next((seen.armed for seen in reversed(modes) if seen.at <= at), True)


def announces(hold: dict[str, Any] | None) -> bool:
    """Returns whether a reader of this knows that the drone will return or land."""
    if hold is None:
        return False
    coming = hold.get("phase") in ("counting", "asking", "done") and hold.get("action") in ("return", "land")
    return bool(coming or hold.get("after_sticks") in ("returns", "lands"))


def _announced(record: Record, who: str, came_down_at: float | None) -> float | None:
    """Returns since when this person has known of it, at its beginning (or at the end); None if they do not, or no
    longer."""
    since: float | None = None
    for reported in record.reported:
        if reported.who == who and (came_down_at is None or reported.at <= came_down_at):
            since = (since or reported.at) if announces(reported.hold) else None
    return since


def _mistimed(record: Record, came_down_at: float) -> list[str]:
    """Reports a countdown that named another moment than that of the descent."""
    counted = [
        (one.at, one.hold["due_at"], one.hold["as_of"])
        for one in record.reported
        if one.at <= came_down_at and one.hold is not None and one.hold.get("due_at") and one.hold.get("as_of")
    ]
    if not counted:
        return []
    at, due, as_of = counted[-1]
    off_s = at + (datetime.fromisoformat(due) - datetime.fromisoformat(as_of)).total_seconds() - came_down_at
    return [f"came down {-off_s:+.1f} s after the announced moment"] if abs(off_s) > DUE_WITHIN_S else []


def _forgotten(record: Record, modes: Sequence[ModeSeen]) -> list[str]:
    """Reports persons who are present but not notified that the drone waits in a hold's mode without a pilot."""
    if not modes or not modes[-1].armed or modes[-1].custom_mode not in record.table.holds:
        return []
    newest = {reported.who: reported.hold for reported in record.reported}
    mode = record.table.name(modes[-1].custom_mode)
    return [
        f"waits in {mode}, and {who} is not told of a hold" for who in sorted(record.present) if not newest.get(who)
    ]


def _drift(motions: Sequence[Motion], since: float | None, came_down_at: float | None) -> float:
    """Excludes a return, which flies away from there."""
    if since is None:
        return math.nan
    until = min(since + DRIFT_FOR_S, came_down_at or math.inf)
    watched = [motion for motion in motions if since <= motion.at <= until]
    if not watched:
        return math.nan
    first = watched[0]
    return max(math.hypot(one.north_m - first.north_m, one.east_m - first.east_m) for one in watched)


def _foreign(record: Record, held_at: float | None) -> int:
    if record.old_holder is None or held_at is None:
        return 0
    return sum(1 for stick in record.sticks if stick.at > held_at and stick.who == record.old_holder)


def _after(at: float | None, trigger: float) -> float:
    return math.nan if at is None else at - trigger


def _name(modes: Sequence[ModeSeen], at: float, table: ModeTable) -> str:
    return next((table.name(seen.custom_mode) for seen in modes if seen.at >= at), "?")
