"""The switches ("boxes") of a flight controller that speaks MSP, and the pulses of auxiliary channels that move them.

Names and permanent ids are those of INAV. Each channel leaves one of the usual positions 1000, 1500 and 2000 free of
boxes, so that a ground station can leave any box.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Final, NamedTuple

STEP_FROM_US, STEP_US = 900, 25


class Box(NamedTuple):
    """`channel`: 0 is the fifth of the receiver. No range: the box has no switch."""

    name: str
    permanent_id: int
    channel: int = 0
    low_us: int = STEP_FROM_US
    high_us: int = STEP_FROM_US

    def moved_by(self, aux_us: Sequence[int]) -> bool:
        return self.channel < len(aux_us) and self.low_us <= aux_us[self.channel] < self.high_us


ARM: Final = Box("ARM", 0, 0, 1700, 2100)
RETURN: Final = Box("NAV RTH", 10, 2, 1700, 2100)
MISSION: Final = Box("NAV WP", 28, 2, 1400, 1650)
POSITION: Final = Box("NAV POSHOLD", 11, 1, 1700, 2100)
HEIGHT: Final = Box("NAV ALTHOLD", 3, 1, 1400, 1650)
ANGLE: Final = Box("ANGLE", 1, 1, 1150, 1350)
FAILSAFE: Final = Box("FAILSAFE", 27)
FLYING: Final = (RETURN, MISSION, POSITION, HEIGHT, ANGLE)
"""If several are moved, the first decides."""
BOXES: Final = (ARM, *FLYING, FAILSAFE)
"""In the order of the bits of MSP_STATUS."""


def names(boxes: Sequence[Box]) -> bytes:
    """MSP_BOXNAMES."""
    return "".join(f"{box.name};" for box in boxes).encode("ascii")


def ids(boxes: Sequence[Box]) -> bytes:
    """MSP_BOXIDS."""
    return bytes(box.permanent_id for box in boxes)


def ranges(boxes: Sequence[Box]) -> bytes:
    """MSP_MODE_RANGES: id, channel, and steps of 25 us from 900 us."""
    return b"".join(
        struct.pack(
            "<4B",
            box.permanent_id,
            box.channel,
            (box.low_us - STEP_FROM_US) // STEP_US,
            (box.high_us - STEP_FROM_US) // STEP_US,
        )
        for box in boxes
        if box.high_us > box.low_us
    )
