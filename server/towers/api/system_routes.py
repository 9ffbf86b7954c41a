"""`/api/v1/system`: the state of the tower itself, for admins."""

from __future__ import annotations

import asyncio
import platform
import resource
import shutil
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field

from server.fleet.core.views import UserRefView
from server.http.access import Admin
from server.http.dependencies import ClockDep, DatabaseDep, HubDep, LoopWatchDep, SettingsDep, StartedAtDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.live.live_counts import count_live, online_users
from server.storage.database_facts import database_facts

router = APIRouter(prefix="/api/v1", tags=["system"])


class LagView(BaseModel):
    now: float
    worst_60s: float


class DatabaseView(BaseModel):
    kind: str
    revision: str
    answered_in_ms: float
    size_bytes: int


class DiskView(BaseModel):
    """The disk that holds the tower's files."""

    free_bytes: int
    total_bytes: int


class AgentsView(BaseModel):
    known: Annotated[int, Field(description="Drones in the fleet")]
    online: int


class ClientsView(BaseModel):
    live: Annotated[int, Field(description="Open live connections")]
    users: Annotated[int, Field(description="Number of different users")]


class SystemView(BaseModel):
    version: str
    python: str
    started_at: datetime
    uptime_s: float
    loop_lag_ms: LagView
    database: DatabaseView
    disk: DiskView
    agents: AgentsView
    clients: ClientsView
    memory_bytes: Annotated[int, Field(description="Peak memory of the process")]


class OnlineView(BaseModel):
    user: UserRefView
    connections: Annotated[int, Field(description="Live connections: browsers and programs")]


@router.get("/online", responses=answers(NotSignedIn, SessionExpired, AdminsOnly))
async def who_is_online(admin: Admin, hub: HubDep) -> list[OnlineView]:
    """Lists users with a live connection at this moment, by name."""
    found = online_users(hub.state)
    return [OnlineView(user=UserRefView(id=user_id, name=name), connections=many) for user_id, name, many in found]


@router.get("/system", responses=answers(NotSignedIn, SessionExpired, AdminsOnly))
async def system(
    request: Request,
    admin: Admin,
    clock: ClockDep,
    settings: SettingsDep,
    hub: HubDep,
    started_at: StartedAtDep,
    loop_watch: LoopWatchDep,
    database: DatabaseDep,
) -> SystemView:
    """Returns the present state of database, disk, agents, clients and event loop, and the versions."""
    now = clock()
    disk = await asyncio.to_thread(shutil.disk_usage, settings.var)
    counts = count_live(hub.state)
    return SystemView(
        version=request.app.version,
        python=platform.python_version(),
        started_at=started_at,
        uptime_s=round((now - started_at).total_seconds(), 1),
        loop_lag_ms=LagView(now=loop_watch.now_ms, worst_60s=loop_watch.worst_ms),
        database=DatabaseView.model_validate(await database_facts(database), from_attributes=True),
        disk=DiskView(free_bytes=disk.free, total_bytes=disk.total),
        agents=AgentsView(known=counts.drones, online=counts.online),
        clients=ClientsView(live=counts.browsers, users=counts.users),
        memory_bytes=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
    )
