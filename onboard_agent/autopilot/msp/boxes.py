"""The boxes of a flight controller (its switches) as flight modes, and the switch positions that enter a mode. Pure.

Several boxes may be active at a time. The mode is the one that says most about who flies: the first below. The numbers
are those of the profile `wire/autopilots/msp_multicopter.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from onboard_agent.autopilot.msp.answers import ModeRange
from wire.autopilots.msp_multicopter import BOXES, NUMBERS

ARM: Final = "ARM"
LOW_US: Final = 1000
HIGH_US: Final = 2000


def plain(name: str) -> str:
    """Firmware spells `ALTHOLD`, `ALT HOLD` and `NAV ALTHOLD`."""
    return name.upper().replace(" ", "").replace("_", "").removeprefix("NAV")


class Boxes:
    """Feed it names, ids and ranges as they come."""

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        self.ids: tuple[int, ...] = ()
        self.ranges: tuple[ModeRange, ...] = ()

    def active(self, flags: int) -> tuple[str, ...]:
        """Names of the boxes whose bits are set."""
        return tuple(name for bit, name in enumerate(self.names) if flags >> bit & 1)

    def armed(self, flags: int) -> bool:
        """ARM is the first box, whether or not the names are known."""
        bit = next((bit for bit, name in enumerate(self.names) if plain(name) == ARM), 0)
        return bool(flags >> bit & 1)

    def mode(self, flags: int) -> int:
        """Returns the custom_mode: UNKNOWN without names, ACRO without any box that flies."""
        if not self.names:
            return NUMBERS["UNKNOWN"]
        there = {plain(name) for name in self.active(flags)}
        return next((NUMBERS[mode] for mode, boxes in BOXES.items() if there & boxes), NUMBERS["ACRO"])

    def switches(self, mode: str) -> Mapping[int, int] | None:
        """Returns pulses by auxiliary channel that activate a mode's box, and no other box that flies. None: no switch
        is set up for it."""
        wanted = self._ranges_of(BOXES.get(mode, frozenset()))
        others = [one for name, boxes in BOXES.items() if name != mode for one in self._ranges_of(boxes)]
        pulses: dict[int, int] = {}
        if mode != "ACRO":
            found = next((one for one in wanted), None)
            if found is None:
                return None
            pulses[found.channel] = (found.low_us + found.high_us) // 2
        for one in others:
            if one.channel not in pulses:
                out = outside(one.channel, others)
                if out is None:
                    return None
                pulses[one.channel] = out
        return pulses

    def arming(self, *, arm: bool) -> Mapping[int, int] | None:
        """Returns the pulse of the switch that arms, or of its other position. None: no switch is set up."""
        ranges = self._ranges_of(frozenset({ARM}))
        if not ranges:
            return None
        one = ranges[0]
        if arm:
            return {one.channel: (one.low_us + one.high_us) // 2}
        out = outside(one.channel, ranges)
        return None if out is None else {one.channel: out}

    def _ranges_of(self, boxes: frozenset[str]) -> list[ModeRange]:
        ids = {number for number, name in zip(self.ids, self.names, strict=False) if plain(name) in boxes}
        return [one for one in self.ranges if one.box_id in ids]


def outside(channel: int, ranges: Sequence[ModeRange]) -> int | None:
    """Returns a usual pulse that is in none of the channel's ranges; None if they cover all."""
    mine = [one for one in ranges if one.channel == channel]
    free = (pulse for pulse in (LOW_US, 1500, HIGH_US) if not any(one.low_us <= pulse <= one.high_us for one in mine))
    return next(free, None)
