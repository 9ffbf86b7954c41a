"""Plans in the bodies of requests: read only when it is known who sends them, and strictly. No item is made up."""

from __future__ import annotations

import re
from typing import Annotated, Any, Final, TypeVar

import msgspec

from server.kernel.refusal import Refusal
from wire.plans import I32, MAX_ITEMS_ANY, U8, U16, Params, Plan, PlanItem

_Body = TypeVar("_Body")
_WHERE: Final = re.compile(r"^(?P<what>.*?)(?: - at `\$(?P<path>[^`]*)`)?$", re.DOTALL)
_STEP: Final = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_MAX_TEXT_LENGTH: Final = 200

_FLOAT32: Final = {"type": "number", "minimum": -3.4e38, "maximum": 3.4e38}
_I32: Final = {"type": "integer", "minimum": -(2**31), "maximum": 2**31 - 1}
_U8: Final = {"type": "integer", "minimum": 0, "maximum": 0xFF}
ITEM_SCHEMA: Final[dict[str, Any]] = {
    "type": "array",
    "description": "command, frame, [param1, param2, param3, param4] (null: NaN), x, y, z, autocontinue, "
    "as MISSION_ITEM_INT has them",
    "minItems": 7,
    "maxItems": 7,
    "prefixItems": [
        {"type": "integer", "minimum": 0, "maximum": 0xFFFF},
        _U8,
        {"type": "array", "minItems": 4, "maxItems": 4, "items": {"anyOf": [_FLOAT32, {"type": "null"}]}},
        _I32,
        _I32,
        _FLOAT32,
        _U8,
    ],
}
ITEMS_SCHEMA: Final[dict[str, Any]] = {"type": "array", "maxItems": MAX_ITEMS_ANY, "items": ITEM_SCHEMA}


class MalformedBody(Refusal):
    """No JSON."""

    def __init__(self) -> None:
        super().__init__("the body is not JSON")


class BadPlan(Refusal):
    """`field`: where in the body, `item`: in which item of a plan, from 0."""

    def __init__(self, message: str, *, field: str = "", item: int | None = None) -> None:
        super().__init__(message)
        self.field = field or None
        self.item = item


ItemRow = tuple[U16, U8, Params, I32, I32, float, U8]
"""All of it, always: what is left out of an item must not be made up."""
ItemRows = Annotated[tuple[ItemRow, ...], msgspec.Meta(max_length=MAX_ITEMS_ANY)]


def plan_of(rows: ItemRows, field: str = "items") -> Plan:
    """Raises BadPlan about a number that 32 bits cannot hold."""
    items: list[PlanItem] = []
    for row in rows:
        try:
            items.append(PlanItem(*row))
        except ValueError as error:
            raise BadPlan(str(error), field=f"{field}.{len(items)}", item=len(items)) from None
    return tuple(items)


class PlanBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A plan that is to be compared with what is on board."""

    items: ItemRows


class PlanToPut(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`while_flying`: also while a mission is being flown, which is paused for it. `despite_ground`: although the
    tower's elevation says that it leads into the ground."""

    items: ItemRows
    while_flying: bool = False
    despite_ground: bool = False


def decode_body(text: bytes, kind: type[_Body]) -> _Body:
    """Raises MalformedBody, BadPlan."""
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.ValidationError as error:
        raise _bad(str(error)) from None
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise MalformedBody from None


def _bad(message: str) -> BadPlan:
    found = _WHERE.match(message)
    what, path = (found["what"], found["path"] or "") if found else (message, "")
    steps = [name or number for name, number in _STEP.findall(path)]
    item = next((int(step) for step in steps if step.isdigit()), None)
    # The words of the reader may quote what came only by its type, and a name of a field by itself.
    return BadPlan(what[:_MAX_TEXT_LENGTH], field=".".join(steps), item=item)


def body_schema(properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    """For the `openapi_extra` of a route that reads its own body."""
    schema = {"type": "object", "properties": properties, "required": required, "additionalProperties": False}
    return {"requestBody": {"required": True, "content": {"application/json": {"schema": schema}}}}
