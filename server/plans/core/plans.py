"""Orders about plans for the operations service, and plans as response bodies. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from hashlib import sha256
from typing import Annotated, Any, Final

import msgspec
from pydantic import Field

from server.kernel.refusal import Refusal
from server.operations.core.onboard_state import OnboardState
from server.operations.core.onboard_views import OnboardPlanView
from server.operations.core.operation import Lane, Order, Step
from wire.plans import Plan, PlanItem, PlanKind, plan_hash, unpack_plan
from wire.transactions import PlanClearWork, PlanDownloadWork, PlanUploadWork, PlanVerifyWork

READ_WITHIN_S: Final = 60.0
WRITE_WITHIN_S: Final = 180.0
"""A write reads the old plan, writes, reads again, and may have to put the old one back: 724 items, four times."""

_encoder: Final = msgspec.json.Encoder()

ItemRow = tuple[int, int, tuple[float | None, float | None, float | None, float | None], int, int, float, int]


class PlanNotRead(Refusal):
    """The agent tried and reports why it failed."""


class PlanView(OnboardPlanView):
    """A plan on board, with its items."""

    items: Annotated[list[ItemRow] | None, Field(description="null: not known, or too many for a report")]
    read_at: Annotated[datetime | None, Field(description="Time of the agent's report")]


def download(kind: PlanKind) -> Order:
    return Order("plan_download", Lane.PLANS, [Step(PlanDownloadWork(kind), READ_WITHIN_S)], writes=False, kind=kind)


def verify(kind: PlanKind, items: Sequence[PlanItem]) -> Order:
    step = Step(PlanVerifyWork(kind, tuple(items)), READ_WITHIN_S)
    return Order("plan_verify", Lane.PLANS, [step], writes=False, kind=kind, hash=plan_hash(kind, items))


def upload(kind: PlanKind, items: Sequence[PlanItem], *, while_flying: bool) -> Order:
    about: dict[str, object] = {"items": len(items), "while_flying": while_flying}
    step = Step(PlanUploadWork(kind, tuple(items), while_flying), WRITE_WITHIN_S)
    hash_ = plan_hash(kind, items)
    return Order("plan_upload", Lane.PLANS, [step], writes=True, kind=kind, hash=hash_, about=about)


def clear(kind: PlanKind, *, while_flying: bool) -> Order:
    step = Step(PlanClearWork(kind, while_flying), WRITE_WITHIN_S)
    about: dict[str, object] = {"while_flying": while_flying}
    return Order("plan_clear", Lane.PLANS, [step], writes=True, kind=kind, about=about)


def plan_json(onboard: OnboardState, kind: PlanKind) -> bytes:
    """The `PlanView` of the agent's last report."""
    view, known = onboard.plan(kind)
    return _json(view, known.items(), known.read_at)


def fresh_json(onboard: OnboardState, kind: PlanKind, packed: bytes, at: datetime) -> bytes:
    """The `PlanView` of a plan that has just been read. `packed`: has been looked through by the service."""
    _, items = unpack_plan(packed)
    known, _ = onboard.plan(kind)
    hash_ = sha256(packed).hexdigest()[:16]
    sent_hash = known.sent_hash if known.hash == hash_ else None
    fit = {"fit_to_fly": known.fit_to_fly, "sent_hash": sent_hash}
    view = OnboardPlanView(kind=kind, state="known", hash=hash_, count=len(items), **fit)  # type: ignore[arg-type]
    return _json(view, items, at)


def _json(view: OnboardPlanView, items: Plan | None, at: datetime | None) -> bytes:
    whole: dict[str, Any] = {**view.model_dump(), "items": items, "read_at": at}
    return _encoder.encode(whole)
