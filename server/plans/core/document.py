"""A plan as the library keeps it: items of each kind, the home that it was planned for, the defaults. Pure."""

from __future__ import annotations

from typing import Annotated, Any, Final

import msgspec

from server.kernel.refusal import Refusal
from server.plans.core.plan_body import ITEMS_SCHEMA, ItemRows, plan_of
from wire.plans import U8

MAX_DOCUMENT_BYTES: Final = 256 * 1024
"""As compact JSON: 724 items of each kind, written with all their digits, are 250 kB."""
_FARTHEST_M: Final = 1e9

Metres = Annotated[float, msgspec.Meta(ge=-_FARTHEST_M, le=_FARTHEST_M)]


class DocumentTooLarge(Refusal):
    def __init__(self, size_bytes: int) -> None:
        super().__init__(f"the document has {size_bytes} bytes; at most {MAX_DOCUMENT_BYTES} are kept")


class PlannedHome(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    lat_e7: Annotated[int, msgspec.Meta(ge=-900_000_000, le=900_000_000)]
    lon_e7: Annotated[int, msgspec.Meta(ge=-1_800_000_000, le=1_800_000_000)]
    alt_m: Metres


class PlanDefaults(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    height_m: Metres
    frame: U8
    speed_m_s: Metres


class PlanDocument(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """As `web/src/plan/plan_document.ts` has it."""

    mission: ItemRows
    fence: ItemRows
    rally: ItemRows
    defaults: PlanDefaults | None = None
    home: PlannedHome | None = None


class MissionBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is kept. `shared`: every user of the tower may read it."""

    name: str
    document: PlanDocument
    shared: bool = False


class KeptDocument(msgspec.Struct, frozen=True):
    """`text`: compact JSON; its numbers are those that 32 bits hold."""

    text: str
    counts: tuple[int, int, int]


def kept(document: PlanDocument) -> KeptDocument:
    """Raises BadPlan, DocumentTooLarge."""
    plans = [plan_of(getattr(document, kind), f"document.{kind}") for kind in ("mission", "fence", "rally")]
    rounded: dict[str, Any] = dict(zip(("mission", "fence", "rally"), plans, strict=True))
    rounded |= {name: value for name in ("defaults", "home") if (value := getattr(document, name)) is not None}
    text = msgspec.json.encode(rounded)
    if len(text) > MAX_DOCUMENT_BYTES:
        raise DocumentTooLarge(len(text))
    mission, fence, rally = (len(plan) for plan in plans)
    return KeptDocument(text.decode(), (mission, fence, rally))


_METRES: Final = {"type": "number", "minimum": -_FARTHEST_M, "maximum": _FARTHEST_M}


def _object(required: list[str], **properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


DOCUMENT_SCHEMA: Final[dict[str, Any]] = _object(
    ["mission", "fence", "rally"],
    mission=ITEMS_SCHEMA,
    fence=ITEMS_SCHEMA,
    rally=ITEMS_SCHEMA,
    home={
        "anyOf": [
            _object(
                ["lat_e7", "lon_e7", "alt_m"],
                lat_e7={"type": "integer", "minimum": -900_000_000, "maximum": 900_000_000},
                lon_e7={"type": "integer", "minimum": -1_800_000_000, "maximum": 1_800_000_000},
                alt_m=_METRES,
            ),
            {"type": "null"},
        ]
    },
    defaults={
        "anyOf": [
            _object(
                ["height_m", "frame", "speed_m_s"],
                height_m=_METRES,
                frame={"type": "integer", "minimum": 0, "maximum": 0xFF},
                speed_m_s=_METRES,
            ),
            {"type": "null"},
        ]
    },
)
