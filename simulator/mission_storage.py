"""What is left of an item that ArduCopter has stored: it packs each into a few bytes, by its command.

So a plan that is read back differs from the one that was sent, though nothing went wrong: parameters that a command has
no use for are 0, heights are whole centimetres (of rally points whole metres), frames are 0 or 3 (10 over terrain),
items without a place have none, autocontinue is 1.

Read in ArduPilot's source (a 4.x before 4.6), not measured on one. By the same arithmetic a height that is read and
sent back comes back a centimetre nearer to 0, once in four.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

from simulator.mission_plan import Item, PlanKind

WAYPOINT_LIKE = frozenset({16, 17, 18, 19, 21, 22, 82, 179, 189, 195, 201})
"""Commands that are stored with a place."""
DIGICAM_CONTROL = 203
RELATIVE = frozenset({3, 6})
OVER_TERRAIN = frozenset({10, 11})

Keep = Callable[[float], float]


def _lost(_value: float) -> float:
    return 0.0


def _whole(low: int, high: int) -> Keep:
    return lambda value: float(min(max(int(value), low), high))


def _same(value: float) -> float:
    return value


def _sign(value: float) -> float:
    return -1.0 if value < 0 else 1.0


def _flag(value: float) -> float:
    return 1.0 if value > 0 else 0.0


def _radius(value: float) -> float:
    """One byte, in tens of metres above 255."""
    size = min(int(abs(value)), 2550)
    size = size if size <= 255 else size // 10 * 10
    return float(-size if value < 0 else size)


_BYTE, _WORD, _SHORT = _whole(0, 255), _whole(0, 65535), _whole(-32768, 32767)
_FIRST = (_WORD, _lost, _lost, _lost)
_NONE = (_lost,) * 4

KEPT: dict[int, tuple[Keep, Keep, Keep, Keep]] = {
    16: _FIRST,
    17: (_lost, _lost, _SHORT, _lost),
    18: (_BYTE, _lost, _radius, _flag),
    19: (_WORD, _lost, _sign, _flag),
    20: _NONE,
    21: (_WORD, _lost, _lost, _sign),
    22: _FIRST,
    82: _FIRST,
    93: (_same, _SHORT, _SHORT, _SHORT),
    112: (_same, _lost, _lost, _lost),
    114: (_same, _lost, _lost, _lost),
    115: (_same, _same, _whole(-128, 127), _BYTE),
    177: (_WORD, _SHORT, _lost, _lost),
    178: (_BYTE, _same, _same, _lost),
    179: _FIRST,
    181: (_BYTE, _BYTE, _lost, _lost),
    183: (_BYTE, _WORD, _lost, _lost),
    184: (_BYTE, _WORD, _SHORT, _same),
    189: _NONE,
    195: _NONE,
    197: _NONE,
    201: _FIRST,
    203: (_BYTE, _BYTE, _whole(-128, 127), _BYTE),
    205: (_same, _same, _same, _lost),
    206: (_same, _lost, _BYTE, _lost),
    207: _FIRST,
    211: (_BYTE, _BYTE, _lost, _lost),
    212: _FIRST,
    222: (_WORD, _same, _same, _same),
}
"""By command, what becomes of each parameter. Those that are not here are kept as they are."""


def packed(item: Item, kind: PlanKind) -> Item:
    """The item as it will be read back."""
    if kind is PlanKind.FENCE:
        first = item.number(0)
        return replace(item, frame=0, params=(first, 0.0, 0.0, 0.0), z=0.0, autocontinue=1)
    if kind is PlanKind.RALLY:
        frame = 3 if item.frame in RELATIVE else 0
        return replace(item, frame=frame, params=(0.0,) * 4, z=float(int(item.z)), autocontinue=1)
    keep = KEPT.get(item.command, (_same,) * 4)
    first, second, third, fourth = (how(item.number(i)) for i, how in enumerate(keep))
    item = replace(item, params=(first, second, third, fourth), autocontinue=1)
    if item.command in WAYPOINT_LIKE:
        frame = 10 if item.frame in OVER_TERRAIN else 3 if item.frame in RELATIVE else 0
        return replace(item, frame=frame, z=_centimetres(item.z))
    if item.command == DIGICAM_CONTROL:
        return replace(item, frame=0, z=0.0)
    return replace(item, frame=0, x=0, y=0, z=0.0)


def _centimetres(height_m: float) -> float:
    """Cut, not rounded, as a cast to a whole number does it; then back in single precision."""
    centimetres = int(_single(_single(height_m) * 100.0))
    return _single(centimetres * _single(0.01))


def _single(value: float) -> float:
    number: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return number
