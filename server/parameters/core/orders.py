"""Orders about parameters for the operations service, and the table as a response body. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Final

import msgspec
from pydantic import BaseModel, Field

from server.kernel.refusal import Refusal
from server.operations.core.onboard_state import ReportedParameters
from server.operations.core.operation import Lane, Order, Step
from wire.parameters import Table
from wire.transactions import MAX_VALUES, ParametersReadWork, ParametersWriteWork

READ_WITHIN_S: Final = 120.0
WRITE_WITHIN_S: Final = (30.0, 0.5, 600.0)
"""In any case, for each value, and at the most."""
MAX_IN_TRAIL: Final = 200

_encoder: Final = msgspec.json.Encoder()
_NAME: Final = r"^[A-Za-z0-9_]{1,16}$"


class ParametersUnknown(Refusal):
    """`count` of `total` are known; `total` 0: the number is not known."""

    def __init__(self, name: str, count: int, total: int) -> None:
        known = f"{count} of {total} are" if total else "none is"
        super().__init__(f"the parameters of {name} are not all known yet: {known}")
        self.more = {"count": count, "total": total}


class ParameterView(BaseModel):
    name: str
    value: float
    kind: Annotated[int, Field(description="MAV_PARAM_TYPE")]


class ParametersView(BaseModel):
    """All parameters of a drone, by name."""

    hash: Annotated[str, Field(description="Hash of this table; also its ETag")]
    complete: bool
    read_at: datetime | None
    values: list[ParameterView]


class ValuesToWrite(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """By name, in the order in which they are to be written."""

    values: Annotated[
        dict[Annotated[str, msgspec.Meta(pattern=_NAME)], float], msgspec.Meta(min_length=1, max_length=MAX_VALUES)
    ]


VALUES_SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "minProperties": 1,
    "maxProperties": MAX_VALUES,
    "propertyNames": {"pattern": _NAME},
    "additionalProperties": {"type": "number"},
}


def reread() -> Order:
    step = Step(ParametersReadWork(again=True), READ_WITHIN_S)
    return Order("parameters_read", Lane.PARAMETERS, [step], writes=False)


def write(values: Mapping[str, float]) -> Order:
    least_s, each_s, most_s = WRITE_WITHIN_S
    step = Step(ParametersWriteWork(tuple(values.items())), min(most_s, least_s + each_s * len(values)))
    about: dict[str, object] = {"count": len(values), "values": dict(list(values.items())[:MAX_IN_TRAIL])}
    return Order("parameters_write", Lane.PARAMETERS, [step], writes=True, about=about)


def parameters_json(reported: ReportedParameters, table: Table) -> bytes:
    """The `ParametersView`."""
    values = [{"name": one.name, "value": one.value, "kind": one.kind} for one in table]
    whole = {"hash": reported.state.hash, "complete": True, "read_at": reported.read_at, "values": values}
    return _encoder.encode(whole)
