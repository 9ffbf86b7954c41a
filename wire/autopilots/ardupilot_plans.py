"""What ArduPilot keeps of a plan's items: the table, by command. Pure.

ArduPilot packs a mission item into 15 bytes by its command, and reconstructs from these what it sends back. Read in its
source of July 2025 (4.7-dev): `mavlink_int_to_mission_cmd`, `mission_cmd_to_mavlink_int`, `sanity_check_params`,
`stored_in_location` and the structures of AP_Mission; MissionItemProtocol_Fence and _Rally with AC_PolyFence_loader and
AP_Rally. Tested on ArduCopter of that source, and on a 4.7-dev of February 2025 (tests/real). What 4.5 and 4.6 lack
(`SINCE`, `_row`) is read in the history of AP_Mission since 2024.

- Every mission item: autocontinue is 1. NaN is refused, except in the few fields that are dropped.
- A command without a position: frame 0, and no position.
- A command with a position: frame 0, 3 or 10; heights are truncated to whole centimetres (`to_send` rounds them first).
  Frame 2 counts as above sea level.
- Fence items: frame 0, no height, autocontinue 0; only param1 of a corner or a circle is kept.
- Rally points: heights are truncated to whole metres; no parameters, autocontinue 0.
- A command that is not in the table: every bit, except autocontinue and the frame's `_INT` twin.
- Before 4.7: the new region-of-interest commands are refused. Before 4.6: so are the start of a return path, the
  camera's source and an open heading of an unlimited loiter; the mode of the legacy gimbal comes back as 0.
"""

import struct
from typing import Final, NamedTuple

from msgspec.structs import replace

from wire.firmware import Release
from wire.plan_fields import (
    BYTE,
    SIGNED_BYTE,
    SIGNED_WORD,
    WORD,
    Effect,
    ItemKept,
    Kept,
    Rule,
    always,
    becomes,
    dropped,
    dropped_but,
    dropped_or_open,
    fields_of,
    flag,
    half_float,
    in_hundredths,
    refused,
    same,
    unused,
    unused_or_open,
    whole,
)
from wire.plan_room import Room, room
from wire.plans import PlanItem, PlanKind, as_float32

HEIGHT_STEP_M: Final = 0.0101
"""One centimetre, plus the rounding of 32-bit floats."""
_MAX_HEIGHT_M: Final = 83_000.0
_MAX_STEPS: Final = 4
_FRAMES: Final = {0: 0, 5: 0, 3: 3, 6: 3, 10: 10, 11: 10}
_MISSION_FRAME: Final = 2


class _Row(NamedTuple):
    """The rules of one command. `place`: it is stored with latitude, longitude and height."""

    p1: Rule = unused
    p2: Rule = unused
    p3: Rule = unused
    p4: Rule = unused
    place: bool = False
    x: Rule = unused
    y: Rule = unused
    z: Rule = unused


def _placed(p1: Rule = unused, p2: Rule = unused, p3: Rule = unused, p4: Rule = unused) -> _Row:
    return _Row(p1, p2, p3, p4, place=True)


def _radius(sent: float | None) -> Kept:
    """Whole metres; the sign is the direction."""
    if sent is None or abs(sent) >= 0x10000:
        return refused(sent)
    return becomes(sent, float(int(sent)))


def _radius_in_a_byte(sent: float | None) -> Kept:
    """Metres; above 255 in tens of metres, up to 2550. The sign is the direction."""
    if sent is None:
        return refused(sent)
    size = abs(sent)
    metres = int(size) if size <= 255.0 else min(int(as_float32(size * as_float32(0.1))), 255) * 10
    return becomes(sent, float(-metres if sent < 0.0 else metres))


def _turns(sent: float | None) -> Kept:
    """Whole turns up to 255; fractions of one turn in 256ths."""
    if sent is None or sent < 0.0:
        return refused(sent)
    if 0.0 < sent < 1.0:
        return becomes(sent, int(sent * 256.0) / 256.0)
    return becomes(sent, float(min(int(sent), 255)))


def _direction(sent: float | None) -> Kept:
    """Only the sign of a radius: clockwise is 1."""
    if sent is None:
        return refused(sent)
    return becomes(sent, -1.0 if sent < 0.0 else 1.0, Effect.QUIET if sent == 0.0 else Effect.FLIGHT)


def _landing_heading(sent: float | None) -> Kept:
    """Only the sign of a heading."""
    if sent is None:
        return Kept(1.0, Effect.QUIET)
    turns = -1.0 if sent <= -(2.0**-23) else 1.0
    return becomes(sent, turns, Effect.QUIET if sent == 0.0 else Effect.FLIGHT)


def _lowest_bit(sent: float | None) -> Kept:
    if sent is None or not 0 <= int(sent) <= 0xFFFFFFFF:
        return refused(sent)
    return becomes(sent, float(int(sent) & 1))


_JUMP_TARGET: Final = whole(0, 0xFFFE)
"""Counted as in a plan, without home; 16 bits including home."""

_TABLE: Final[dict[int, _Row]] = {
    16: _placed(WORD, dropped, dropped, dropped_or_open),
    17: _placed(unused, unused, _radius, dropped_or_open),
    18: _placed(_turns, dropped, _radius_in_a_byte, flag),
    19: _placed(WORD, dropped, _direction, flag),
    20: _Row(),
    21: _placed(WORD, dropped, unused, _landing_heading),
    22: _placed(WORD, unused, unused, dropped_or_open),
    30: _placed(WORD),
    31: _placed(dropped, _radius, unused, flag),
    82: _placed(WORD),
    83: _Row(same, same, BYTE),
    84: _placed(unused, dropped, unused, dropped_or_open),
    85: _placed(WORD, unused, dropped_or_open, dropped_or_open),
    92: _placed(WORD),
    93: _Row(same, SIGNED_BYTE, SIGNED_BYTE, SIGNED_BYTE),
    94: _placed(in_hundredths),
    112: _Row(same),
    114: _Row(same),
    115: _Row(same, same, SIGNED_BYTE, BYTE),
    177: _Row(_JUMP_TARGET, SIGNED_WORD),
    178: _Row(BYTE, same, same, dropped),
    179: _placed(WORD),
    181: _Row(BYTE, BYTE),
    182: _Row(BYTE, SIGNED_WORD, same),
    183: _Row(BYTE, WORD),
    184: _Row(BYTE, WORD, SIGNED_WORD, same),
    188: _placed(),
    189: _placed(),
    191: _placed(dropped),
    193: _Row(WORD),
    194: _Row(WORD),
    195: _placed(WORD),
    197: _Row(WORD),
    201: _placed(WORD, dropped, dropped),
    202: _Row(BYTE, WORD, BYTE, WORD, x=BYTE, y=BYTE, z=same),
    203: _Row(BYTE, BYTE, SIGNED_BYTE, BYTE, x=BYTE, y=BYTE),
    205: _Row(same, same, same, dropped, z=always(2.0)),
    206: _Row(same, dropped_but(-1.0), BYTE, dropped),
    207: _Row(WORD, dropped),
    208: _Row(WORD),
    210: _Row(WORD),
    211: _Row(BYTE, BYTE),
    212: _Row(WORD, dropped),
    213: _Row(same, same, BYTE),
    215: _Row(WORD),
    216: _Row(WORD),
    217: _Row(WORD, same, same, same),
    218: _Row(WORD, BYTE),
    222: _Row(WORD, same, same, same),
    223: _Row(flag, flag, in_hundredths, _lowest_bit),
    531: _Row(BYTE, same),
    532: _Row(BYTE, same),
    534: _Row(BYTE, BYTE, BYTE),
    600: _Row(WORD),
    601: _Row(WORD, SIGNED_WORD),
    1000: _Row(SIGNED_BYTE, SIGNED_WORD, SIGNED_BYTE, SIGNED_BYTE, x=BYTE, z=BYTE),
    2000: _Row(BYTE, same, WORD, WORD),
    2001: _Row(WORD),
    2500: _Row(BYTE),
    2501: _Row(BYTE),
    3000: _Row(BYTE, dropped),
    42600: _Row(BYTE, BYTE, same, same),
    42702: _Row(BYTE, BYTE, half_float, half_float, x=SIGNED_WORD, y=SIGNED_WORD),
    42703: _Row(WORD, whole(-180, 180), whole(-90, 90), whole(-180, 360), x=SIGNED_WORD),
}


def _of_a_plane(limit: int) -> Rule:
    """Whole metres, at most `limit`."""

    def rule(sent: float | None) -> Kept:
        if sent is None or not 0 <= int(sent) <= 0xFFFF:
            return refused(sent)
        return becomes(sent, float(min(int(sent), limit)))

    return rule


def _targeting(sent: float | None) -> Kept:
    """The legacy gimbal's mode before 4.6: always 2 (by MAVLink), though 0 comes back."""
    return becomes(sent, 0.0, Effect.QUIET if sent == 2.0 else Effect.FLIGHT)


SINCE: Final[dict[int, Release]] = {188: (4, 6), 195: (4, 7), 197: (4, 7), 534: (4, 6)}
"""Commands of the table that older releases refuse as unsupported."""
_BEFORE: Final[dict[Release, dict[int, _Row]]] = {
    (4, 6): {
        17: _placed(unused, unused, _radius, dropped),
        205: _Row(same, same, same, dropped, z=_targeting),
    },
}
"""Rows of the releases before that one."""

_UNKNOWN: Final = _Row()
_OF_PLANES: Final = {16: _placed(dropped, _of_a_plane(255), _of_a_plane(255), dropped_or_open)}
_NOT_OF_PLANES: Final = frozenset({82})

_CORNERS: Final = (5001, 5002)
_CIRCLES: Final = (5003, 5004)
_RETURN_POINT: Final = 5000
_RALLY_POINT: Final = 5100


ARDUPILOT_ROOM: Final = room(649, 70, 46)
"""Copter with 16 KiB of storage. Source: StorageManager's layout (4.7-dev of July 2025): 9,758 bytes for the mission at
15 an item are 650, including home; 560 at 8 for the fence, 690 at 15 for rally points. Tested on its own simulator
(tests/real). Boards of 15 KiB take 302 mission items, those of 32 KiB 1,305; with an SD card more."""


class ArduPilot:
    """A KeptFields. `is_plane`: ArduPlane, which packs a waypoint differently from Copter, Rover and Sub. `release`:
    None is read as the newest one."""

    name = "ArduPilot"

    def __init__(self, *, is_plane: bool = False, release: Release | None = None) -> None:
        self._is_plane = is_plane
        self._release = release
        self.lacks = frozenset(command for command, since in SINCE.items() if self._is_before(since))

    @property
    def room(self) -> Room:
        """On the usual boards."""
        return ARDUPILOT_ROOM

    def to_send(self, kind: PlanKind, item: PlanItem) -> PlanItem:
        """Returns the item with a height that is truncated to the nearest centimetre, if its own height would not
        be."""
        if kind is not PlanKind.MISSION or not self._row(item).place:
            return item
        height_m = _height_to_send(item.z)
        return item if height_m == item.z else replace(item, z=height_m)

    def kept(self, kind: PlanKind, item: PlanItem) -> ItemKept:
        """Jump targets count as in the plan, without home."""
        if kind is PlanKind.FENCE:
            return ItemKept(_of_fence(item))
        if kind is PlanKind.RALLY:
            return ItemKept(_of_rally(item))
        row = self._row(item)
        if row is _UNKNOWN:
            return ItemKept(_unknown(item))
        fields = _params(item, row) | _autocontinue(item)
        fields |= _place(item) if row.place else _no_place(item, row)
        if (self._is_plane and item.command in _NOT_OF_PLANES) or item.command in self.lacks:
            fields["command"] = refused(item.command)
        return ItemKept(fields, HEIGHT_STEP_M if row.place else 0.0)

    def _is_before(self, release: Release) -> bool:
        return self._release is not None and self._release < release

    def _row(self, item: PlanItem) -> _Row:
        row = _OF_PLANES.get(item.command) if self._is_plane else None
        for release, rows in _BEFORE.items():
            if self._is_before(release):
                row = row or rows.get(item.command)
        return row or _TABLE.get(item.command, _UNKNOWN)


def _params(item: PlanItem, row: _Row) -> dict[str, Kept]:
    rules = (row.p1, row.p2, row.p3, row.p4)
    found = {f"param{n}": rule(value) for n, (rule, value) in enumerate(zip(rules, item.params, strict=True), 1)}
    return {"command": becomes(item.command, item.command), **found}


def _autocontinue(item: PlanItem) -> dict[str, Kept]:
    return {"autocontinue": becomes(item.autocontinue, 1.0, Effect.FLIGHT if item.autocontinue == 0 else Effect.QUIET)}


def _no_place(item: PlanItem, row: _Row) -> dict[str, Kept]:
    return {
        "frame": becomes(item.frame, 0.0, Effect.QUIET),
        "x": row.x(item.x),
        "y": row.y(item.y),
        "z": row.z(item.z),
    }


def _place(item: PlanItem) -> dict[str, Kept]:
    if item.frame == _MISSION_FRAME:
        has_place = item.x != 0 or item.y != 0 or item.z != 0.0
        frame = Kept(0.0, Effect.FLIGHT if has_place else Effect.QUIET)
    else:
        frame = _frame(item)
    return {"frame": frame, **_on_earth(item), "z": _centimetres(item.z)}


def _frame(item: PlanItem) -> Kept:
    if item.frame not in _FRAMES:
        return refused(item.frame)
    return becomes(item.frame, float(_FRAMES[item.frame]), Effect.QUIET)


def _on_earth(item: PlanItem) -> dict[str, Kept]:
    limits = {"x": (item.x, 900_000_000), "y": (item.y, 1_800_000_000)}
    return {name: same(value) if abs(value) <= most else refused(value) for name, (value, most) in limits.items()}


def _centimetres(sent: float) -> Kept:
    if abs(sent) >= _MAX_HEIGHT_M:
        return refused(sent)
    return becomes(sent, as_float32(_cut(sent) * as_float32(0.01)), Effect.QUIET)


def _cut(height_m: float) -> int:
    """Truncates to whole centimetres, as ArduPilot stores them."""
    return int(as_float32(height_m * 100.0))


def _height_to_send(height_m: float) -> float:
    """A 32-bit height may lie slightly below the intended centimetre: then the next one that does not is sent."""
    wanted = round(height_m * 100.0)
    if abs(height_m) >= _MAX_HEIGHT_M or _cut(height_m) == wanted:
        return height_m
    sent = as_float32(wanted / 100.0)
    for _ in range(_MAX_STEPS):
        if _cut(sent) == wanted:
            return sent
        sent = _further_from_0(sent)
    return height_m


def _further_from_0(value: float) -> float:
    """Returns the next 32-bit float away from 0."""
    (bits,) = struct.unpack("<I", struct.pack("<f", value))
    (further,) = struct.unpack("<f", struct.pack("<I", bits + 1))
    return float(further)


def _of_fence(item: PlanItem) -> dict[str, Kept]:
    p1, p2, p3, p4 = item.params
    is_return = item.command == _RETURN_POINT
    known = item.command in (_RETURN_POINT, *_CORNERS, *_CIRCLES)
    size: Rule = unused_or_open
    if item.command in _CORNERS:
        size = whole(3, 255)
    elif item.command in _CIRCLES:
        size = same if p1 is not None and p1 > 2.0**-23 else refused
    return {
        "command": becomes(item.command, item.command) if known else refused(item.command),
        "frame": becomes(item.frame, 0.0, Effect.QUIET) if item.frame in _FRAMES else refused(item.frame),
        "param1": size(p1),
        "param2": (unused_or_open if is_return else dropped_or_open)(p2),
        "param3": unused_or_open(p3),
        "param4": unused_or_open(p4),
        **_on_earth(item),
        "z": becomes(item.z, 0.0, Effect.FLIGHT if is_return else Effect.QUIET),
        "autocontinue": becomes(item.autocontinue, 0.0, Effect.QUIET),
    }


def _of_rally(item: PlanItem) -> dict[str, Kept]:
    fits = -0x8000 <= item.z <= 0x7FFF
    nowhere = item.x == 0 and item.y == 0
    fields = {
        "command": becomes(item.command, item.command) if item.command == _RALLY_POINT else refused(item.command),
        "frame": _frame(item),
        **{f"param{number}": unused_or_open(value) for number, value in enumerate(item.params, 1)},
        **_on_earth(item),
        "z": becomes(item.z, float(int(item.z))) if fits else refused(item.z),
        "autocontinue": becomes(item.autocontinue, 0.0, Effect.QUIET),
    }
    return fields | ({"x": refused(item.x)} if nowhere else {})


def _unknown(item: PlanItem) -> dict[str, Kept]:
    fields = {name: same(value) for name, value in fields_of(item).items()}
    return {**fields, "frame": becomes(item.frame, float(_FRAMES.get(item.frame, item.frame)), Effect.QUIET)} | (
        _autocontinue(item)
    )
