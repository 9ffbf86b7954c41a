"""`/api/v1/alert-deliveries/given-up`: alerts that reached nobody outside of the console. For admins."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from server.alerts.store.channels.channels import shown_target
from server.alerts.store.channels.given_up import MAX_LISTED, GivenUp, list_given_up
from server.fleet.core.views import UserRefView
from server.http.access import Admin
from server.http.dependencies import DatabaseDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired

router = APIRouter(
    prefix="/api/v1/alert-deliveries", tags=["alerts"], responses=answers(NotSignedIn, SessionExpired, AdminsOnly)
)


class GivenUpDelivery(BaseModel):
    id: int
    user: UserRefView
    kind: Literal["mail", "webhook", "push"]
    target: Annotated[str, Field(description="An e-mail address, or the host of a webhook or a push service")]
    happening: Annotated[str, Field(description="`opened`, `closed` or `unanswered`")]
    drone_id: Annotated[int | None, Field(description="None: the alert is about the tower itself")]
    drone_name: Annotated[str, Field(description="Empty without a drone")]
    words: Annotated[str, Field(description="Of the alert")]
    problem: Annotated[str, Field(description="Of the last attempt")]
    attempts: int
    announced_at: datetime
    given_up_at: datetime


@router.get("/given-up")
async def list_given_up_deliveries(
    admin: Admin,
    database: DatabaseDep,
    before: Annotated[
        int | None, Query(ge=1, le=2**31 - 1, description="Only those after this one in the list")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=MAX_LISTED)] = 50,
) -> list[GivenUpDelivery]:
    """Lists deliveries of the last seven days that were given up after the last attempt, the newest first. For the next
    page, set `before` to the last id."""
    async with database.reading() as session:
        return [_view(one) for one in await list_given_up(session, before=before, limit=limit)]


def _view(one: GivenUp) -> GivenUpDelivery:
    delivery, channel, user = one
    content = delivery.content
    drone = content["drone"] or {"id": None, "name": ""}
    return GivenUpDelivery.model_validate(
        {
            "id": delivery.id,
            "user": UserRefView(id=user.id, name=user.name),
            "kind": channel.kind,
            "target": shown_target(channel),
            "happening": delivery.happening,
            "drone_id": drone["id"],
            "drone_name": drone["name"],
            "words": content["words"],
            "problem": delivery.problem,
            "attempts": delivery.attempts,
            "announced_at": delivery.created_at,
            "given_up_at": delivery.ended_at,
        }
    )
