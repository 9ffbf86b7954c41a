"""`/api/v1/maintenance`: what drones need after so many hours in the air, and that it was done."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Path, Response
from pydantic import AfterValidator, AwareDatetime, BaseModel, ConfigDict, Field

from server.flights.api.readable import readable_drones
from server.http.access import Pilot, Viewer
from server.http.dependencies import AuditDep, DatabaseDep, HubDep
from server.http.long_list import long_list
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.bad_field import BadField
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.api.operation_requests import watched_drone
from server.operations.core.refusals import ViewTaken
from server.readiness.core.maintenance_refusals import NotYoursToMaintain, TooManyTasks, UnknownTask
from server.readiness.store import maintenance_tasks as tasks
from server.readiness.store.maintenance_tasks import Task
from server.storage.database import Database

router = APIRouter(prefix="/api/v1", tags=["maintenance"], responses=answers(NotSignedIn, SessionExpired))

SOON: Final = 0.1
"""The part of the interval that is left when maintenance is due soon."""


def _clean(text: str) -> str:
    """Raises BadField."""
    words = " ".join(text.split())
    if not words or not words.isprintable():
        raise BadField("a title is 1 to 80 printable characters")
    return words


Title = Annotated[str, Field(min_length=1, max_length=80), AfterValidator(_clean)]
IntervalH = Annotated[float, Field(gt=0, le=100_000, allow_inf_nan=False, description="Hours in the air")]
TaskPath = Annotated[int, Path(ge=1, le=2**31 - 1)]


class TaskView(BaseModel):
    """What one drone needs, again and again."""

    id: int
    drone_id: int
    drone: str
    title: str
    interval_h: IntervalH
    done_at: Annotated[datetime, Field(description="When it was done last, or when the count began")]
    done_by: Annotated[str, Field(description="Empty: it was not done yet")]
    flown_h: Annotated[float, Field(description="In the air since then")]
    left_h: Annotated[float, Field(description="Until it is due; negative: overdue")]
    state: Annotated[Literal["good", "soon", "due"], Field(description="`soon`: a tenth of the interval is left")]
    may_change: Annotated[bool, Field(description="You may change it, and say that it was done")]


class NewTask(BaseModel):
    """`since`: when it was done last, so that hours since then count; missing: now."""

    model_config = ConfigDict(extra="forbid")

    title: Title
    interval_h: IntervalH
    since: AwareDatetime | None = None


class TaskPatch(BaseModel):
    """What to change; the rest stays as it is."""

    model_config = ConfigDict(extra="forbid")

    title: Title | None = None
    interval_h: IntervalH | None = None


class TaskDone(BaseModel):
    """`note`: for the audit trail."""

    model_config = ConfigDict(extra="forbid")

    note: Annotated[str, Field(max_length=200)] = ""


@router.get("/maintenance", response_model=list[TaskView])
async def list_maintenance(principal: Viewer, hub: HubDep, database: DatabaseDep) -> Response:
    """Lists the maintenance of all drones whose flights the user may read; what is due first comes first."""
    drones = readable_drones(hub, principal)
    async with database.reading() as session:
        found = await tasks.tasks_of(session, list(drones))
    found.sort(key=lambda one: one.flown_h / one.interval_h, reverse=True)
    return await long_list(_view(one, drones[one.drone_id], principal) for one in found)


@router.post(
    "/drones/{drone_id}/maintenance",
    status_code=201,
    responses=answers(UnknownDrone, ViewTaken, NotYoursToMaintain, TooManyTasks),
)
async def add_maintenance(
    principal: Pilot,
    hub: HubDep,
    database: DatabaseDep,
    audit: AuditDep,
    drone_id: Annotated[int, Path(ge=1, le=0xFFFFFFFF)],
    body: NewTask,
) -> TaskView:
    """Owners and admins: adds maintenance of this drone."""
    drone = watched_drone(hub, principal, drone_id)
    _require(drone, principal)
    action = audit.action(principal)
    since = action.at if body.since is None else min(body.since, action.at)
    async with database.writing() as session:
        task_id = await tasks.add(
            session, drone_id=drone_id, title=body.title, interval_h=body.interval_h, since=since, action=action
        )
    return await _read(database, drone, principal, task_id)


@router.patch("/maintenance/{task_id}", responses=answers(UnknownTask, NotYoursToMaintain))
async def change_maintenance(
    principal: Pilot, hub: HubDep, database: DatabaseDep, audit: AuditDep, task_id: TaskPath, body: TaskPatch
) -> TaskView:
    """Owners and admins: changes title or interval."""
    drone = await _maintained(hub, database, principal, task_id)
    async with database.writing() as session:
        await tasks.change(
            session, task_id, title=body.title, interval_h=body.interval_h, action=audit.action(principal)
        )
    return await _read(database, drone, principal, task_id)


@router.post("/maintenance/{task_id}/done", responses=answers(UnknownTask, NotYoursToMaintain))
async def end_maintenance(
    principal: Pilot, hub: HubDep, database: DatabaseDep, audit: AuditDep, task_id: TaskPath, body: TaskDone
) -> TaskView:
    """Owners and admins: says that it was done now. The audit trail keeps who, when, after how many hours, and the
    note."""
    drone = await _maintained(hub, database, principal, task_id)
    async with database.writing() as session:
        await tasks.done(session, task_id, note=" ".join(body.note.split()), action=audit.action(principal))
    return await _read(database, drone, principal, task_id)


@router.delete("/maintenance/{task_id}", status_code=204, responses=answers(UnknownTask, NotYoursToMaintain))
async def remove_maintenance(
    principal: Pilot, hub: HubDep, database: DatabaseDep, audit: AuditDep, task_id: TaskPath
) -> None:
    """Owners and admins: removes it."""
    await _maintained(hub, database, principal, task_id)
    async with database.writing() as session:
        await tasks.remove(session, task_id, action=audit.action(principal))


async def _maintained(hub: Hub, database: Database, principal: Principal, task_id: int) -> LiveDrone:
    """Raises UnknownTask, also for those of drones that this user does not read; NotYoursToMaintain."""
    async with database.reading() as session:
        row = await tasks.find(session, task_id)
    drone = readable_drones(hub, principal).get(row.drone_id)
    if drone is None:
        raise UnknownTask
    _require(drone, principal)
    return drone


def _require(drone: LiveDrone, principal: Principal) -> None:
    if not drone.may(principal.user_id, principal.role, Right.MAINTAIN):
        raise NotYoursToMaintain(drone.record.name)


async def _read(database: Database, drone: LiveDrone, principal: Principal, task_id: int) -> TaskView:
    async with database.reading() as session:
        found = await tasks.tasks_of(session, [drone.drone_id])
    for one in found:
        if one.id == task_id:
            return _view(one, drone, principal)
    raise UnknownTask


def _view(task: Task, drone: LiveDrone, principal: Principal) -> TaskView:
    left_h = task.interval_h - task.flown_h
    return TaskView(
        id=task.id,
        drone_id=task.drone_id,
        drone=drone.record.name,
        title=task.title,
        interval_h=task.interval_h,
        done_at=task.done_at,
        done_by=task.done_by,
        flown_h=round(task.flown_h, 2),
        left_h=round(left_h, 2),
        state="due" if left_h <= 0 else "soon" if left_h <= SOON * task.interval_h else "good",
        may_change=drone.may(principal.user_id, principal.role, Right.MAINTAIN),
    )
