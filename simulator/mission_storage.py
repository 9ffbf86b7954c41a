"""How ArduPilot stores an item: in 15 bytes by its command, from which it reconstructs what it sends back.

Items are packed and unpacked as there: a command number, 16 bits (`p1`), and a position (latitude, longitude, whole
centimetres, a byte of flags) or the fields of the command's structure. Values that do not fit are truncated as a
processor does it (x86-64: towards 0, then the lowest bits).

Read in ArduPilot's source (4.7-dev of July 2025): AP_Mission, AC_PolyFence_loader, AP_Rally and their
MissionItemProtocol. Compared with what ArduCopter of that source gave back (tests/unit/simulator/kept_by_arducopter).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from simulator.dialect import mavlink
from simulator.mission_plan import Item, PlanKind

RELATIVE, OVER_TERRAIN, ABSOLUTE = frozenset({3, 6}), frozenset({10, 11}), frozenset({0, 2, 5})
MAX_ALT_M = 83_000.0
COUNTER_CLOCKWISE, BY_TANGENT, TENS, FRACTION = 1, 2, 4, 8
"""Flags stored with a position."""
JUMP = 177

Four = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Stored:
    """The 16 bits of `p1` and the flags of a command with a position."""

    p1: int
    flags: int = 0


def _cast(value: float, code: str) -> float:
    """Casts a float as C does to that type of the struct module."""
    if code in "fe":
        try:
            number: float = struct.unpack("<" + code, struct.pack("<" + code, value))[0]
        except OverflowError:
            return math.copysign(math.inf, value)
        return number
    whole = int(value) if abs(value) < 2**31 else -(2**31)
    size = struct.calcsize("<" + code)
    return int.from_bytes((whole & (256**size - 1)).to_bytes(size, "little"), "little", signed=code.islower())


def single(value: float) -> float:
    return _cast(value, "f")


def _p1(item: Item, of: int = 0) -> int:
    return int(_cast(item.params[of], "H"))


def _just_p1(item: Item) -> Stored:
    return Stored(_p1(item))


def _nothing(_item: Item) -> Stored:
    return Stored(0)


def _radius(of: int) -> Callable[[Item], Stored]:
    def store(item: Item) -> Stored:
        radius = item.params[of]
        tangent = BY_TANGENT if of == 1 and item.params[3] > 0 else 0
        return Stored(int(_cast(abs(radius), "H")), tangent | (COUNTER_CLOCKWISE if radius < 0 else 0))

    return store


def _turns(item: Item) -> Stored:
    turns, _, radius, tangent = item.params
    flags = (COUNTER_CLOCKWISE if radius < 0 else 0) | (BY_TANGENT if tangent > 0 else 0)
    if 0 < turns < 1:
        turns, flags = turns * 256, flags | FRACTION
    size = abs(radius)
    if size > 255:
        size, flags = min(255.0, single(size * single(0.1))), flags | TENS
    return Stored(int(_cast(min(255.0, turns), "H")) | int(size) << 8, flags)


def _time(item: Item) -> Stored:
    flags = (COUNTER_CLOCKWISE if item.params[2] < 0 else 0) | (BY_TANGENT if item.params[3] > 0 else 0)
    return Stored(_p1(item), flags)


def _land(item: Item) -> Stored:
    return Stored(_p1(item), COUNTER_CLOCKWISE if item.params[3] <= -(2**-23) else 0)


def _payload(item: Item) -> Stored:
    return Stored(int(_cast(single(item.params[0] * 100.0), "H")))


def _turned(value: float, flags: int) -> float:
    return -value if flags & COUNTER_CLOCKWISE else value


def _read_back_p1(one: Stored) -> Four:
    return float(one.p1), 0.0, 0.0, 0.0


def _read_back_nothing(_one: Stored) -> Four:
    return 0.0, 0.0, 0.0, 0.0


def _read_back_turns(one: Stored) -> Four:
    turns, radius = float(one.p1 & 0xFF), float(one.p1 >> 8)
    turns = turns / 256 if one.flags & FRACTION else turns
    radius = radius * 10 if one.flags & TENS else radius
    return turns, 0.0, _turned(radius, one.flags), float(bool(one.flags & BY_TANGENT))


PLACED: dict[int, tuple[Callable[[Item], Stored], Callable[[Stored], Four]]] = {
    **dict.fromkeys((16, 22, 30, 82, 85, 92, 179, 195, 201), (_just_p1, _read_back_p1)),
    **dict.fromkeys((84, 188, 189, 191), (_nothing, _read_back_nothing)),
    17: (_radius(2), lambda one: (0.0, 0.0, _turned(float(one.p1), one.flags), 0.0)),
    18: (_turns, _read_back_turns),
    19: (_time, lambda one: (float(one.p1), 0.0, _turned(1.0, one.flags), float(bool(one.flags & BY_TANGENT)))),
    21: (_land, lambda one: (float(one.p1), 0.0, 0.0, _turned(1.0, one.flags))),
    31: (
        _radius(1),
        lambda one: (0.0, _turned(float(one.p1), one.flags), 0.0, float(bool(one.flags & BY_TANGENT))),
    ),
    94: (_payload, lambda one: (single(one.p1 * single(0.01)), 0.0, 0.0, 0.0)),
}
"""By command: what is stored of its parameters besides the position, and how it is read back."""

P1_ALONE = frozenset({193, 194, 197, 207, 208, 210, 212, 215, 216, 2001})
"""Commands without a position that store only 16 bits of param1."""

STRUCTURES: dict[int, tuple[str, str]] = {
    20: ("", ""),
    83: ("ffB", "123"),
    93: ("fbbb", "1234"),
    112: ("f", "1"),
    114: ("f", "1"),
    115: ("ffbB", "1234"),
    177: ("Hh", "12"),
    178: ("Bff", "123"),
    181: ("BB", "12"),
    182: ("Bhf", "123"),
    183: ("BH", "12"),
    184: ("BHhf", "1234"),
    202: ("BHBHBBf", "1234xyz"),
    203: ("BBbBBB", "1234xy"),
    205: ("fff", "123"),
    206: ("fB", "13"),
    211: ("BB", "12"),
    213: ("ffB", "123"),
    217: ("Hfff", "1234"),
    218: ("HB", "12"),
    222: ("Hfff", "1234"),
    531: ("Bf", "12"),
    532: ("Bf", "12"),
    534: ("BBB", "123"),
    600: ("H", "1"),
    601: ("Hh", "12"),
    1000: ("bhbbBB", "1234xz"),
    2000: ("BfHH", "1234"),
    2500: ("B", "1"),
    2501: ("B", "1"),
    3000: ("B", "1"),
    42600: ("BBff", "1234"),
    42702: ("BBeehh", "1234xy"),
}
"""The other commands: the types of their structure, and the message fields that it stores."""

OPEN = {16: (3,), 17: (3,), 21: (3,), 22: (3,), 84: (3,), 85: (2, 3)}
"""By command, the parameters that may be NaN."""

ENGINE, ATTITUDE, MOUNT = 223, 42703, 205
COMMANDS = frozenset({*PLACED, *P1_ALONE, *STRUCTURES, ENGINE, ATTITUDE})

Release = tuple[int, int]
NEWEST: Release = (4, 7)
ADDED: dict[int, Release] = {188: (4, 6), 534: (4, 6), 195: (4, 7), 197: (4, 7)}
"""Commands, and the release of ArduPilot that brought each (history of AP_Mission)."""
OPEN_LOITER_SINCE = MOUNT_MODE_SINCE = (4, 6)


def accept_item(item: Item, kind: PlanKind, release: Release = NEWEST) -> Item | int:
    """Returns the item as that release will read it back, or the MAV_MISSION_RESULT that refuses it."""
    if kind is PlanKind.FENCE:
        return _accept_fence(item)
    if kind is PlanKind.RALLY:
        return _accept_rally(item)
    may_be_open = () if item.command == 17 and release < OPEN_LOITER_SINCE else OPEN.get(item.command, ())
    for at, value in enumerate(item.params):
        if math.isinf(value) or (math.isnan(value) and at not in may_be_open):
            return int(mavlink.MAV_MISSION_INVALID_PARAM1) + at
    if release < ADDED.get(item.command, release):
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    if item.command in PLACED:
        return _accept_placed(item)
    if item.command not in COMMANDS:
        return int(mavlink.MAV_MISSION_INVALID if item.command in (0, 1) else mavlink.MAV_MISSION_UNSUPPORTED)
    kept = _unplaced(item)
    return replace(kept, z=0.0) if item.command == MOUNT and release < MOUNT_MODE_SINCE else kept


def why_not_whole(items: Sequence[Item], kind: PlanKind) -> int | None:
    """Returns the MAV_MISSION_RESULT at the end of an upload, or None. Only a fence is checked as a whole."""
    expected, first, returns = 0, items[0] if items else None, 0
    for item in items if kind is PlanKind.FENCE else ():
        if item.command in (5001, 5002):
            if expected == 0:
                expected, first = int(item.params[0]), item
            same = first is not None and (item.command, item.params[0]) == (first.command, first.params[0])
            if item.params[0] < 3 or not same:
                return int(mavlink.MAV_MISSION_ERROR)
            expected -= 1
            continue
        returns += item.command == 5000
        is_circle = item.command in (5003, 5004)
        if expected or returns > 1 or (is_circle and not item.params[0] > 2**-23):
            return int(mavlink.MAV_MISSION_ERROR)
    return int(mavlink.MAV_MISSION_ERROR) if expected else None


def fence_total(items: Sequence[Item]) -> int:
    """Returns FENCE_TOTAL: the number of corners and circles plus two, but 0 for fewer than three. To the autopilot a
    total that becomes 0 is an old ground station clearing the fence, whatever has just been stored."""
    points = sum(item.command != 5000 for item in items)
    return points + 2 if points >= 3 else 0


def why_not_jump(item: Item, last: int) -> int | None:
    """Refuses a jump to home or past the end. `last`: number of the last item."""
    if item.command == JUMP and not 0 < int(item.params[0]) <= last:
        return int(mavlink.MAV_MISSION_ERROR)
    return None


def _why_not_there(item: Item) -> int | None:
    if abs(item.x) > 900_000_000:
        return int(mavlink.MAV_MISSION_INVALID_PARAM5_X)
    return int(mavlink.MAV_MISSION_INVALID_PARAM6_Y) if abs(item.y) > 1_800_000_000 else None


def _accept_placed(item: Item) -> Item | int:
    problem = _why_not_there(item)
    if problem is not None:
        return problem
    if not abs(item.z) < MAX_ALT_M:
        return int(mavlink.MAV_MISSION_INVALID_PARAM7)
    if item.frame not in RELATIVE | OVER_TERRAIN | ABSOLUTE:
        return int(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    store, read_back = PLACED[item.command]
    frame = 3 if item.frame in RELATIVE else 10 if item.frame in OVER_TERRAIN else 0
    centimetres = int(single(single(item.z) * 100.0))
    kept = store(replace(item, params=_numbers(item)))
    return replace(item, frame=frame, params=read_back(kept), z=single(centimetres * single(0.01)), autocontinue=1)


def _numbers(item: Item) -> Four:
    first, second, third, fourth = (item.number(at) for at in range(4))
    return first, second, third, fourth


def _unplaced(item: Item) -> Item:
    p1, p2, p3, p4 = item.params
    sent = {"1": p1, "2": p2, "3": p3, "4": p4, "x": float(item.x), "y": float(item.y), "z": item.z}
    kept = dict.fromkeys(sent, 0.0)
    if item.command in P1_ALONE:
        kept["1"] = float(_p1(item))
    elif item.command == ENGINE:
        height = single(int(_cast(single(p3 * 100.0), "H")) * single(0.01))
        kept |= {"1": float(p1 > 0), "2": float(p2 > 0), "3": height, "4": float(int(p4) & 1)}
    elif item.command == ATTITUDE:
        kept |= {
            "1": float(int(min(max(p1, 0.0), 65_535.0))),
            "2": float(int(p2)) if abs(p2) <= 180 else 0.0,
            "3": float(int(p3)) if abs(p3) <= 90 else 0.0,
            "4": float(int(p4)) if -180 <= p4 <= 360 else 0.0,
            "x": _cast(item.x, "h"),
        }
    else:
        types, fields = STRUCTURES[item.command]
        room = 12 if item.command < 256 else 10
        numbers = [_cast(sent[name], code) for name, code in zip(fields, types, strict=True)]
        in_p1 = types.startswith("H") and types[1:] == "fff"
        if in_p1:
            kept["1"], types, fields, numbers = numbers[0], types[1:], fields[1:], numbers[1:]
        packed = struct.pack("<" + types, *numbers)
        assert len(packed) <= room, item.command
        kept |= dict(zip(fields, map(float, struct.unpack("<" + types, packed)), strict=True))
    if item.command == MOUNT:
        kept["z"] = 2.0
    params = (kept["1"], kept["2"], kept["3"], kept["4"])
    return replace(item, frame=0, params=params, x=int(kept["x"]), y=int(kept["y"]), z=kept["z"], autocontinue=1)


def _accept_fence(item: Item) -> Item | int:
    if item.frame not in RELATIVE | OVER_TERRAIN | {0, 5}:
        return int(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    if item.command not in range(5000, 5005):
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    first = item.number(0)
    if item.command in (5001, 5002):
        if first > 255:
            return int(mavlink.MAV_MISSION_INVALID_PARAM1)
        first = _cast(first, "B")
    elif item.command == 5000:
        first = 0.0
    return replace(item, frame=0, params=(float(first), 0.0, 0.0, 0.0), z=0.0, autocontinue=0)


def _accept_rally(item: Item) -> Item | int:
    if item.command != 5100:
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    problem = _why_not_there(item)
    if problem is not None:
        return problem
    if not -32768 <= item.z <= 32767:
        return int(mavlink.MAV_MISSION_INVALID_PARAM7)
    if item.frame not in RELATIVE | OVER_TERRAIN | {0, 5}:
        return int(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    frame = 3 if item.frame in RELATIVE else 10 if item.frame in OVER_TERRAIN else 0
    return replace(item, frame=frame, params=(0.0,) * 4, z=float(int(item.z)), autocontinue=0)
