"""Plans for a drone: missions, fences and rally points as plain items, their bytes and their hash.

A plan is a tuple of items without home, numbered from 0 in the order of flight. The agent handles what an autopilot
adds (ArduPilot keeps home in slot 0); plans never contain it. Numbers are those of MISSION_ITEM_INT; floats are rounded
to their 32 bits there, so that JSON, MAVLink and the hash never disagree.

No I/O, and no part of the protocol that carries a plan.
"""

from collections.abc import Iterable
from enum import StrEnum
from hashlib import sha256
from math import isfinite
from struct import Struct
from typing import Annotated, Any, Final

import msgspec

from wire.dialect import mavlink

MAX_ITEMS_ANY: Final = 724
"""The limit for every plan here, whatever the autopilot; plan_room has the room of each autopilot."""

_FLOAT: Final = Struct("<f")
_HEAD: Final = Struct("<BH")
_ITEM: Final = Struct("<HB4f2ifB")
_NAN: Final = float("nan")

U8 = Annotated[int, msgspec.Meta(ge=0, le=0xFF)]
U16 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFF)]
I32 = Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31 - 1)]

Params = tuple[float | None, float | None, float | None, float | None]


class PlanKind(StrEnum):
    """What the items are for."""

    MISSION = "mission"
    FENCE = "fence"
    RALLY = "rally"

    @property
    def mission_type(self) -> int:
        """MAV_MISSION_TYPE."""
        return _MISSION_TYPES[self]


_MISSION_TYPES: Final = {
    PlanKind.MISSION: int(mavlink.MAV_MISSION_TYPE_MISSION),
    PlanKind.FENCE: int(mavlink.MAV_MISSION_TYPE_FENCE),
    PlanKind.RALLY: int(mavlink.MAV_MISSION_TYPE_RALLY),
}


def as_float32(value: float) -> float:
    """Returns the nearest 32-bit float; minus zero becomes zero, because JavaScript's JSON has no minus zero.

    Raises ValueError if that is not finite.
    """
    try:
        (rounded,) = _FLOAT.unpack(_FLOAT.pack(value))
    except OverflowError:
        rounded = float("inf")
    if not isfinite(rounded):
        raise ValueError(f"{value} is no number that a plan can hold")
    return float(rounded) + 0.0


class PlanItem(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One item with the fields of MISSION_ITEM_INT, without its number. In JSON an array, in the order of the fields.

    `params`: param1 to param4, None for NaN ("as the autopilot likes"). `x`, `y`: 1e-7 degree in global frames
    (latitude, longitude), 1e-4 m in local frames. `z`: metres. Floats are rounded to 32 bits when the item is created,
    from JSON too; raises ValueError (msgspec.ValidationError from JSON) if one is not finite.
    """

    command: U16
    frame: U8 = 3
    params: Params = (0.0, 0.0, 0.0, 0.0)
    x: I32 = 0
    y: I32 = 0
    z: float = 0.0
    autocontinue: U8 = 1

    def __post_init__(self) -> None:
        p1, p2, p3, p4 = (None if value is None else as_float32(value) for value in self.params)
        msgspec.structs.force_setattr(self, "params", (p1, p2, p3, p4))
        msgspec.structs.force_setattr(self, "z", as_float32(self.z))


Plan = tuple[PlanItem, ...]
BoundedPlan = Annotated[tuple[PlanItem, ...], msgspec.Meta(max_length=MAX_ITEMS_ANY)]

_encoder: Final = msgspec.json.Encoder()
_decoder: Final[msgspec.json.Decoder[BoundedPlan]] = msgspec.json.Decoder(BoundedPlan)


def plan_to_json(items: Iterable[PlanItem]) -> bytes:
    """Encodes the items as a JSON array of arrays."""
    return _encoder.encode(tuple(items))


def plan_from_json(text: bytes | str) -> Plan:
    """Decodes JSON. Raises ValueError (msgspec.DecodeError) if it is no plan or has too many items."""
    return _decoder.decode(text)


def pack_plan(kind: PlanKind, items: Iterable[PlanItem]) -> bytes:
    """Returns the canonical bytes, little-endian: kind u8, count u16, then 32 bytes an item.

    An item: command u16, frame u8, params 4 x f32, x i32, y i32, z f32, autocontinue u8; NaN is 7FC00000.
    """
    plan = tuple(items)
    packed = bytearray(_HEAD.pack(kind.mission_type, len(plan)))
    for item in plan:
        params = (_NAN if value is None else value for value in item.params)
        packed += _ITEM.pack(item.command, item.frame, *params, item.x, item.y, item.z, item.autocontinue)
    return bytes(packed)


def unpack_plan(packed: bytes) -> tuple[PlanKind, Plan]:
    """Unpacks what `pack_plan` returns. Raises ValueError for anything else."""
    if len(packed) < _HEAD.size:
        raise ValueError("shorter than the head of a plan")
    mission_type, count = _HEAD.unpack_from(packed)
    kinds = [kind for kind, number in _MISSION_TYPES.items() if number == mission_type]
    if not kinds or len(packed) != _HEAD.size + count * _ITEM.size:
        raise ValueError("no plan of that kind and length")
    return kinds[0], tuple(
        PlanItem(command, frame, _params(p1, p2, p3, p4), x, y, z, autocontinue)
        for command, frame, p1, p2, p3, p4, x, y, z, autocontinue in _ITEM.iter_unpack(packed[_HEAD.size :])
    )


def plan_hash(kind: PlanKind, items: Iterable[PlanItem]) -> str:
    """Returns 16 hexadecimal digits: the first 8 bytes of SHA-256 over the canonical bytes."""
    return sha256(pack_plan(kind, items)).hexdigest()[:16]


def item_message(
    item: PlanItem, *, seq: int, kind: PlanKind, target_system: int, target_component: int, current: bool = False
) -> Any:
    """Returns the item as a MISSION_ITEM_INT message. `seq`: the autopilot's number."""
    params = (_NAN if value is None else value for value in item.params)
    return mavlink.MAVLink_mission_item_int_message(
        target_system,
        target_component,
        seq,
        item.frame,
        item.command,
        int(current),
        item.autocontinue,
        *params,
        item.x,
        item.y,
        item.z,
        kind.mission_type,
    )


def read_item(message: Any) -> PlanItem:
    """Reads the item in a MISSION_ITEM_INT message. Raises ValueError if a number is not finite; param1-4 may be
    NaN."""
    params = _params(message.param1, message.param2, message.param3, message.param4)
    return PlanItem(message.command, message.frame, params, message.x, message.y, message.z, message.autocontinue)


def _params(p1: float, p2: float, p3: float, p4: float) -> Params:
    a, b, c, d = (None if value != value else value for value in (p1, p2, p3, p4))
    return a, b, c, d
