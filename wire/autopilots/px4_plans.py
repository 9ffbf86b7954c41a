"""What PX4 keeps of a plan's items: the table, by command. Pure.

Read in its source (1.16): `parse_mavlink_mission_item` and `format_mavlink_mission_item` of mavlink_mission.cpp,
mission_item_s of navigation.h. Tested on 1.15.4 and 1.16.1 (tests/real/test_real_px4_plans.py): all commands that the
console offers, with unusual numbers in each parameter.

- A command either has a position, with frame 0, 3, 5 or 6 (it comes back as 5 or 6), or has frame 2. With the other
  kind of frame, or over terrain, it is refused.
- Frame 2: parameters and z are kept in every bit, NaN too; x and y go through a 32-bit float.
- A heading goes through radians from 0 to 2 pi.
- A height is kept in every bit. The lowest bit of autocontinue is kept.
- Fence items: frame 5 and autocontinue 0; param1 and the height are kept. Rally points: no parameters.
- A command that is not in the table: every bit, except autocontinue and the frame.
"""

from typing import Final

from wire.plan_fields import (
    Effect,
    ItemKept,
    Kept,
    Rule,
    becomes,
    dropped_or_open,
    fields_of,
    flag_or_open,
    heading_or_open,
    refused,
    same,
    same_or_open,
    unused_or_open,
    whole,
)
from wire.plan_room import room
from wire.plans import MAX_ITEMS_ANY, PlanItem, PlanKind, as_float32

_FRAMES: Final = {0: 5, 5: 5, 3: 6, 6: 6}
_MISSION_FRAME: Final = 2
_ROI, _ROI_AS_SENT_LONG_AGO, _JUMP = 201, 80, 177
_AT_A_PLACE, _NEXT_WAYPOINT, _A_WAYPOINT = 3, 1, 2


def _roi_kind(sent: float | None) -> Kept:
    """Stored but not sent back. A position, or none; the other kinds need frame 2."""
    return Kept(0.0, Effect.QUIET if sent else Effect.SAME) if sent in (0.0, 3.0) else refused(sent)


_PLACED: Final[dict[int, tuple[Rule, Rule, Rule, Rule]]] = {
    16: (same_or_open, same_or_open, dropped_or_open, heading_or_open),
    17: (unused_or_open, unused_or_open, same_or_open, heading_or_open),
    19: (same_or_open, flag_or_open, same_or_open, flag_or_open),
    21: (dropped_or_open, whole(0, 0xFFFF), unused_or_open, heading_or_open),
    22: (dropped_or_open, unused_or_open, unused_or_open, heading_or_open),
    31: (flag_or_open, same_or_open, unused_or_open, flag_or_open),
    _ROI_AS_SENT_LONG_AGO: (_roi_kind, dropped_or_open, dropped_or_open, unused_or_open),
    84: (unused_or_open, dropped_or_open, unused_or_open, heading_or_open),
    85: (dropped_or_open, unused_or_open, dropped_or_open, heading_or_open),
    195: (dropped_or_open, unused_or_open, unused_or_open, unused_or_open),
    _ROI: (_roi_kind, dropped_or_open, dropped_or_open, unused_or_open),
    4501: (dropped_or_open, dropped_or_open, dropped_or_open, dropped_or_open),
}
_UNPLACED: Final = frozenset(
    {20, 93, 112, 114, _JUMP, 178, 179, 187, 189, 196, 197, 200, _ROI, _ROI_AS_SENT_LONG_AGO, 203, 204, 205, 206}
    | {211, 212, 214, 260, 400, 530, 532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600}
)

_CORNERS: Final = (5001, 5002)
_CIRCLES: Final = (5003, 5004)
_FENCE: Final = (5000, *_CORNERS, *_CIRCLES)
_RALLY_POINT: Final = 5100


PX4_ROOM: Final = room(MAX_ITEMS_ANY, 64, 32)
"""Source: dataman (1.16): 2,000 mission items, more than a plan here has; boards with little flash take fewer."""


class Px4:
    """A KeptFields."""

    name = "PX4"
    room = PX4_ROOM
    lacks: frozenset[int] = frozenset()

    def to_send(self, kind: PlanKind, item: PlanItem) -> PlanItem:
        """Returns the item unchanged: PX4 keeps every bit of a height."""
        del kind
        return item

    def kept(self, kind: PlanKind, item: PlanItem) -> ItemKept:
        """Returns what PX4 keeps of an item of such a plan."""
        if kind is PlanKind.FENCE:
            return ItemKept(_of_fence(item))
        if kind is PlanKind.RALLY:
            return ItemKept(_of_rally(item))
        if item.command not in _PLACED and item.command not in _UNPLACED:
            return ItemKept(_unknown(item))
        return ItemKept(_unplaced(item) if item.frame == _MISSION_FRAME else _placed(item))


def _autocontinue(item: PlanItem) -> dict[str, Kept]:
    bit = float(item.autocontinue & 1)
    return {"autocontinue": becomes(item.autocontinue, bit, Effect.FLIGHT if bit == 0.0 else Effect.QUIET)}


def _frame(item: PlanItem) -> Kept:
    known = _FRAMES.get(item.frame)
    return refused(item.frame) if known is None else becomes(item.frame, float(known), Effect.QUIET)


def _as_sent(item: PlanItem) -> dict[str, Kept]:
    return {name: same_or_open(value) for name, value in fields_of(item).items()}


def _placed(item: PlanItem) -> dict[str, Kept]:
    rules = _PLACED.get(item.command)
    fields = _as_sent(item) | _autocontinue(item) | {"frame": _frame(item)}
    if rules is None:
        return fields | {"frame": refused(item.frame)}
    if item.command == _ROI_AS_SENT_LONG_AGO:
        fields["command"] = Kept(_ROI, Effect.QUIET)
    return fields | {
        f"param{n}": rule(value) for n, (rule, value) in enumerate(zip(rules, item.params, strict=True), 1)
    }


def _unplaced(item: PlanItem) -> dict[str, Kept]:
    fields = _as_sent(item) | _autocontinue(item)
    if item.command not in _UNPLACED:
        return fields | {"frame": refused(item.frame)}
    fields |= {"x": becomes(item.x, as_float32(item.x)), "y": becomes(item.y, as_float32(item.y))}
    p1, p2, _, _ = item.params
    if item.command == _JUMP:
        fields |= {"param1": whole(0, 0x7FFF)(p1), "param2": whole(0, 0xFFFF)(p2)}
    elif item.command in (_ROI, _ROI_AS_SENT_LONG_AGO):
        fields["command"] = becomes(item.command, _ROI, Effect.QUIET)
        if p1 is None or int(p1) not in (0, _NEXT_WAYPOINT, _A_WAYPOINT):
            fields["param1"] = refused(p1)
    return fields


def _of_fence(item: PlanItem) -> dict[str, Kept]:
    p1, p2, p3, p4 = item.params
    size: Rule = unused_or_open
    if item.command in _CORNERS:
        size = _corner_count
    elif item.command in _CIRCLES:
        size = same
    return {
        "command": becomes(item.command, item.command) if item.command in _FENCE else refused(item.command),
        "frame": becomes(item.frame, 5.0, Effect.QUIET) if item.frame in _FRAMES else refused(item.frame),
        "param1": size(p1),
        "param2": (unused_or_open if item.command == _FENCE[0] else dropped_or_open)(p2),
        "param3": unused_or_open(p3),
        "param4": unused_or_open(p4),
        "x": same(item.x),
        "y": same(item.y),
        "z": same(item.z),
        "autocontinue": becomes(item.autocontinue, 0.0, Effect.QUIET),
    }


def _corner_count(sent: float | None) -> Kept:
    """Rounded to a whole number; fewer than three corners make no polygon."""
    if sent is None or not 3 <= (count := int(as_float32(sent + 0.5))) <= 0xFFFF:
        return refused(sent)
    return becomes(sent, float(count))


def _of_rally(item: PlanItem) -> dict[str, Kept]:
    command = becomes(item.command, item.command) if item.command == _RALLY_POINT else refused(item.command)
    fields = _as_sent(item) | _autocontinue(item) | {"command": command, "frame": _frame(item)}
    if item.autocontinue == 0:
        fields["autocontinue"] = becomes(0.0, 0.0)
    return fields | {f"param{number}": unused_or_open(value) for number, value in enumerate(item.params, 1)}


def _unknown(item: PlanItem) -> dict[str, Kept]:
    frame = becomes(item.frame, float(_FRAMES.get(item.frame, item.frame)), Effect.QUIET)
    return _as_sent(item) | _autocontinue(item) | {"frame": frame}
