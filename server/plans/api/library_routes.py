"""`/api/v1/missions`: the mission library. Lists omit documents; each change names the version it replaces."""

from __future__ import annotations

import re
from datetime import datetime
from typing import Annotated, Any, Final

import msgspec
from fastapi import APIRouter, Header, Path, Request, Response
from pydantic import BaseModel, Field, WithJsonSchema

from server.fleet.core.views import UserRefView
from server.http.access import MissionWriter, Viewer
from server.http.dependencies import AuditDep, DatabaseDep
from server.http.problem_docs import answers
from server.http.strict_body import read_body
from server.kernel.names import BadName
from server.plans.core.document import DOCUMENT_SCHEMA, DocumentTooLarge, MissionBody, kept
from server.plans.core.plan_body import BadPlan, MalformedBody, body_schema
from server.plans.store import library
from server.plans.store.library import (
    ChangedMeanwhile,
    Found,
    NotYourMission,
    TooManyMissions,
    UnknownMission,
    VersionNeeded,
)

router = APIRouter(prefix="/api/v1/missions", tags=["missions"])

MissionPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
IfMatch = Annotated[str | None, Header(description="The ETag of the version to replace")]
_BAD: Final = (BadPlan, BadName, MalformedBody, DocumentTooLarge)
_BODY: Final = body_schema(
    {
        "name": {"type": "string", "description": "1 to 64 printable characters"},
        "document": DOCUMENT_SCHEMA,
        "shared": {"type": "boolean", "default": False},
    },
    ["name", "document"],
)
_TAG: Final = re.compile(r'(?:W/)?"(\d{1,9})"')


class CountsView(BaseModel):
    """The number of items of each kind."""

    mission: int
    fence: int
    rally: int


class MissionView(BaseModel):
    """A mission of the library, without its plan."""

    id: int
    name: str
    owner: UserRefView
    shared: Annotated[bool, Field(description="All users of the tower may read it")]
    updated_at: datetime
    counts: CountsView
    version: Annotated[int, Field(description="Also its ETag")]

    @classmethod
    def of(cls, found: Found) -> MissionView:
        row, owner = found
        return cls(
            id=row.id,
            name=row.name,
            owner=UserRefView(id=row.owner_id, name=owner),
            shared=row.shared,
            updated_at=row.updated_at,
            counts=CountsView(mission=row.mission_items, fence=row.fence_items, rally=row.rally_items),
            version=row.version,
        )


class MissionWithDocument(MissionView):
    document: Annotated[dict[str, Any], WithJsonSchema(DOCUMENT_SCHEMA)]


def _tagged(response: Response, found: Found) -> MissionView:
    response.headers["ETag"] = f'"{found[0].version}"'
    return MissionView.of(found)


@router.get("")
async def list_missions(principal: Viewer, database: DatabaseDep) -> list[MissionView]:
    """Lists your missions and shared ones, newest first."""
    async with database.reading() as session:
        return [MissionView.of(found) for found in await library.list_missions(session, principal)]


@router.post("", status_code=201, responses=answers(TooManyMissions, *_BAD), openapi_extra=_BODY)
async def create_mission(
    request: Request, response: Response, principal: MissionWriter, database: DatabaseDep, audit: AuditDep
) -> MissionView:
    """Stores a plan under a name."""
    body = await read_body(request, MissionBody)
    document = kept(body.document)
    async with database.writing() as session:
        found = await library.create_mission(
            session,
            principal,
            name=body.name,
            document=document,
            shared=body.shared,
            action=audit.action(principal),
        )
        return _tagged(response, found)


@router.get("/{mission_id}", response_model=MissionWithDocument, responses=answers(UnknownMission))
async def get_mission(principal: Viewer, database: DatabaseDep, mission_id: MissionPath) -> Response:
    """Returns one mission, with its plan."""
    async with database.reading() as session:
        found = await library.get_mission(session, principal, mission_id)
        text = await library.document_of(session, found[0])
    view = MissionView.of(found).model_dump() | {"document": msgspec.Raw(text.encode())}
    headers = {"ETag": f'"{found[0].version}"'}
    return Response(msgspec.json.encode(view), media_type="application/json", headers=headers)


@router.put(
    "/{mission_id}",
    responses=answers(UnknownMission, NotYourMission, VersionNeeded, ChangedMeanwhile, *_BAD),
    openapi_extra=_BODY,
)
async def replace_mission(
    request: Request,
    response: Response,
    principal: MissionWriter,
    database: DatabaseDep,
    audit: AuditDep,
    mission_id: MissionPath,
    if_match: IfMatch = None,
) -> MissionView:
    """Replaces the plan, the name, and whether the mission is shared."""
    body = await read_body(request, MissionBody)
    document = kept(body.document)
    async with database.writing() as session:
        found = await library.replace_mission(
            session,
            principal,
            mission_id,
            version=_version(if_match),
            name=body.name,
            document=document,
            shared=body.shared,
            action=audit.action(principal),
        )
        return _tagged(response, found)


@router.delete("/{mission_id}", status_code=204, responses=answers(UnknownMission, NotYourMission))
async def delete_mission(
    principal: MissionWriter, database: DatabaseDep, audit: AuditDep, mission_id: MissionPath
) -> None:
    """Deletes a mission from the library; plans on board of drones stay."""
    async with database.writing() as session:
        await library.delete_mission(session, principal, mission_id, action=audit.action(principal))


def _version(if_match: str | None) -> int | None:
    """Returns None without a header, and 0, which no mission has, for an invalid version."""
    if if_match is None:
        return None
    found = _TAG.fullmatch(if_match.strip())
    return int(found[1]) if found else 0
