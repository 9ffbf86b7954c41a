"""An operation as it looks from outside: in REST answers and in live events."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from server.fleet.core.views import UserRefView
from server.operations.core.operation import Operation, State, WorkName
from wire.plans import PlanKind
from wire.transactions import LogEntry


class RefusalView(BaseModel):
    """A parameter whose value is not the requested one."""

    model_config = ConfigDict(frozen=True)

    name: str
    asked: float
    has: Annotated[float | None, Field(description="The autopilot's value; null: not known")]
    words: str


class LogView(BaseModel):
    """One flight log on board."""

    model_config = ConfigDict(frozen=True)

    id: int
    size_bytes: int
    began_at: Annotated[datetime | None, Field(description="null: the autopilot's clock was not set")]

    @classmethod
    def of(cls, entry: LogEntry) -> LogView:
        began = entry.began_unix_s
        began_at = None if began is None else datetime.fromtimestamp(began, UTC)
        return cls(id=entry.log_id, size_bytes=entry.size_bytes, began_at=began_at)


class OperationView(BaseModel):
    """Work at a drone. `/live` reports each change: `{"type": "operation", "operation": ...}`."""

    model_config = ConfigDict(frozen=True)

    id: str
    drone_id: int
    work: WorkName
    kind: Annotated[PlanKind | None, Field(description="Kind of the plan")]
    state: State
    phase: Annotated[str, Field(description="The present phase, for people")]
    done: Annotated[int, Field(description="Steps done in this phase ...")]
    total: Annotated[int, Field(description="... out of; 0: not known")]
    words: Annotated[str, Field(description="The result, for people: what failed, why, and what is on board now")]
    item: Annotated[
        int | None,
        Field(
            description="The refused item of the plan, from 0. Of `start` and `jump`: the earlier one whose effect the "
            "drone did not take again"
        ),
    ]
    code: Annotated[str, Field(description="Name of the MAV_MISSION_RESULT or MAV_RESULT, if any")]
    seen: Annotated[
        bool | None,
        Field(description="For a command: whether telemetry confirmed it in time; null: nothing to confirm"),
    ]
    hash: Annotated[str | None, Field(description="Hash of the requested plan")]
    refusals: Annotated[
        list[RefusalView], Field(description="Parameters: the first 200 with another value than requested")
    ]
    refused: Annotated[int, Field(description="Total number of these")]
    logs: Annotated[list[LogView] | None, Field(description="The list of logs, newest first")]
    by: Annotated[UserRefView | None, Field(description="The requester")]
    began_at: datetime
    ended_at: datetime | None

    @classmethod
    def of(cls, one: Operation) -> OperationView:
        return cls(
            id=str(one.id),
            drone_id=one.drone_id,
            work=one.order.work,
            kind=one.order.kind,
            state=one.state,
            phase=one.phase,
            done=one.done,
            total=one.total,
            words=one.words,
            item=one.item,
            code=one.code,
            seen=one.seen,
            hash=one.order.hash,
            refusals=[RefusalView(name=r.name, asked=r.asked, has=r.has, words=r.words) for r in one.refusals],
            refused=one.refused,
            logs=None if one.logs is None else [LogView.of(entry) for entry in one.logs],
            by=UserRefView.of(one.by) if one.by else None,
            began_at=one.began_at,
            ended_at=one.ended_at,
        )
