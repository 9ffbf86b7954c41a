"""`/api/v1/zones`: where drones may not be. All who may see a zone read it; admins and team admins change it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import msgspec
from fastapi import APIRouter, Path, Request, Response
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from server.airspace.core.zones.imports import MAX_FILE_BYTES, UnreadableFile, shapes_in
from server.airspace.core.zones.zone import MAX_POINTS, MAX_REASON, BadZone, check_points, checked
from server.airspace.store import zones
from server.airspace.store.follow import ZoneFollower
from server.airspace.store.zones import TooManyZones, UnknownZone, ZoneChangedMeanwhile
from server.http.access import TeamEditor, Viewer
from server.http.dependencies import AuditDep, DatabaseDep, HubDep, SideThreadDep, provided
from server.http.problem_docs import answers
from server.http.strict_body import read_body
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.kernel.names import BadName
from server.plans.core.plan_body import MalformedBody, body_schema
from server.runtime.side_thread import TooMuchWork
from server.teams.core import TeamAdminsOnly, UnknownTeam
from server.teams.store.teams import TeamManager
from wire.zones.kinds import HeightAbove, ZoneKind, ZoneRule
from wire.zones.zone import Zone, ZoneShape

ZoneFollowerDep = Annotated[ZoneFollower, provided(ZoneFollower)]
router = APIRouter(prefix="/api/v1/zones", tags=["zones"], responses=answers(NotSignedIn, SessionExpired))

ZonePath = Annotated[int, Path(ge=1, le=2**31 - 1)]
Latitude = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
Longitude = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Height = Annotated[float, Field(ge=-1000, le=20_000, allow_inf_nan=False)]
Points = Annotated[
    list[tuple[Latitude, Longitude]], Field(min_length=2, max_length=MAX_POINTS, description="Latitude, longitude")
]
_FILE = body_schema(
    {"text": {"type": "string", "description": f"A GeoJSON or KML file, {MAX_FILE_BYTES // 1000} kB at most"}}, ["text"]
)
_CHANGES = answers(BadZone, BadName, AdminsOnly, UnknownTeam, TeamAdminsOnly, TooMuchWork)


class ZoneBody(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(description="1 to 64 printable characters")]
    kind: Literal["no-fly", "height-limit", "corridor"]
    rule: Literal["refuse", "warn"] = "refuse"
    points: Points
    width_m: Annotated[float | None, Field(gt=0, allow_inf_nan=False, description="Of a line; omitted: an area")] = None
    team_id: Annotated[int | None, Field(ge=1, le=2**31 - 1, description="Omitted: for the whole tower")] = None
    floor_m: Height | None = None
    ceiling_m: Height | None = None
    height_above: Literal["home", "sea"] = "home"
    valid_from: AwareDatetime | None = None
    valid_until: AwareDatetime | None = None
    reason: Annotated[str, Field(max_length=MAX_REASON)] = ""

    def zone(self, version: int = 1) -> Zone:
        points = tuple(self.points)
        check_points(points, self.width_m)
        return Zone(
            id=0,
            name=self.name,
            kind=ZoneKind(self.kind),
            rule=ZoneRule(self.rule),
            shape=ZoneShape(points=points, width_m=self.width_m),
            team_id=self.team_id,
            floor_m=self.floor_m,
            ceiling_m=self.ceiling_m,
            height_above=HeightAbove(self.height_above),
            valid_from=self.valid_from,
            valid_until=self.valid_until,
            reason=" ".join(self.reason.split()),
            version=version,
        )


class ChangedZone(ZoneBody):
    version: Annotated[int, Field(ge=1, description="The version to replace")]


class ZoneView(ZoneBody):
    id: int
    version: int

    @classmethod
    def of(cls, zone: Zone) -> ZoneView:
        return cls.model_construct(
            id=zone.id,
            name=zone.name,
            kind=zone.kind.value,
            rule=zone.rule.value,
            points=list(zone.shape.points),
            width_m=zone.shape.width_m,
            team_id=zone.team_id,
            floor_m=zone.floor_m,
            ceiling_m=zone.ceiling_m,
            height_above=zone.height_above.value,
            valid_from=zone.valid_from,
            valid_until=zone.valid_until,
            reason=zone.reason,
            version=zone.version,
        )


class ZoneFile(msgspec.Struct, forbid_unknown_fields=True):
    text: str


class ShapeView(BaseModel):
    """A shape of a file, which may become a zone."""

    name: str
    points: list[tuple[float, float]]
    is_line: Annotated[bool, Field(description="It needs a width")]
    reason: str


class ShapesView(BaseModel):
    shapes: list[ShapeView]
    skipped: Annotated[list[str], Field(description="What cannot become a zone, in words")]


def _zones_json(zones: Sequence[Zone]) -> bytes:
    """In small pieces: a whole one would keep the interpreter from the event loop."""
    return b"[" + b",".join(msgspec.json.encode(ZoneView.of(one).__dict__) for one in zones) + b"]"


def _shapes_json(text: str) -> bytes:
    found = shapes_in(text)
    return msgspec.json.encode({"shapes": found.shapes, "skipped": found.skipped})


@router.get("", response_model=list[ZoneView], responses=answers(TooMuchWork))
async def list_zones(principal: Viewer, hub: HubDep, database: DatabaseDep, side: SideThreadDep) -> Response:
    """Lists the zones of the tower, of your teams, and of the teams of drones in your squad."""
    async with database.reading() as session:
        teams = await zones.teams_of(session, principal.user_id)
    visible = hub.zones.visible(principal, teams)
    body = await side.in_turn(principal.user_id, lambda: _zones_json(visible))
    return Response(body, media_type="application/json")


@router.post("", status_code=201, responses=_CHANGES | answers(TooManyZones))
async def create_zone(
    principal: TeamEditor,
    database: DatabaseDep,
    audit: AuditDep,
    follower: ZoneFollowerDep,
    side: SideThreadDep,
    hub: HubDep,
    body: ZoneBody,
) -> ZoneView:
    """Admin, or team admin for the team: draws a zone. It counts when the response arrives. A drone inside is told of
    it, and may leave."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    zone = await side.in_turn(principal.user_id, lambda: checked(body.zone()))
    async with database.writing() as session:
        made = await zones.create_zone(session, zone, manager=manager, action=action, shares=hub.state.shares)
    await follower.refresh()
    return ZoneView.of(made)


@router.post(
    "/shapes",
    response_model=ShapesView,
    responses=answers(UnreadableFile, MalformedBody, TooMuchWork),
    openapi_extra=_FILE,
)
async def read_zone_file(request: Request, principal: TeamEditor, side: SideThreadDep) -> Response:
    """Reads the shapes of a GeoJSON or KML file. Stores nothing."""
    body = await read_body(request, ZoneFile)
    found = await side.in_turn(principal.user_id, lambda: _shapes_json(body.text))
    return Response(found, media_type="application/json")


@router.put("/{zone_id}", responses=_CHANGES | answers(UnknownZone, ZoneChangedMeanwhile))
async def replace_zone(
    principal: TeamEditor,
    database: DatabaseDep,
    audit: AuditDep,
    follower: ZoneFollowerDep,
    side: SideThreadDep,
    hub: HubDep,
    zone_id: ZonePath,
    body: ChangedZone,
) -> ZoneView:
    """Admin, or team admin for the team: replaces a zone."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    zone = await side.in_turn(principal.user_id, lambda: checked(body.zone(body.version)))
    async with database.writing() as session:
        changed = await zones.replace_zone(
            session, zone_id, zone, manager=manager, action=action, shares=hub.state.shares
        )
    await follower.refresh()
    return ZoneView.of(changed)


@router.delete("/{zone_id}", status_code=204, responses=answers(AdminsOnly, TeamAdminsOnly, UnknownZone))
async def delete_zone(
    principal: TeamEditor, database: DatabaseDep, audit: AuditDep, follower: ZoneFollowerDep, zone_id: ZonePath
) -> None:
    """Admin, or team admin for the team: deletes a zone."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await zones.delete_zone(session, zone_id, manager=manager, action=action)
    await follower.refresh()
