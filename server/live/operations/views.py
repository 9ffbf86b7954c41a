"""An operation as it looks from outside: in REST answers and in live events."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from server.live.fleet.views import UserRefView
from server.live.operations.operation import Operation, State, WorkName
from wire.plans import PlanKind
from wire.transactions import LogEntry


class RefusalView(BaseModel):
    """A parameter that is not as it was asked to be."""

    model_config = ConfigDict(frozen=True)

    name: str
    asked: float
    has: Annotated[float | None, Field(description="What the autopilot has now; null where nobody knows")]
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
    """A piece of work at a drone. `/live` tells of each change: `{"type": "operation", "operation": ...}`."""

    model_config = ConfigDict(frozen=True)

    id: str
    drone_id: int
    work: WorkName
    kind: Annotated[PlanKind | None, Field(description="Of the plan that it is about")]
    state: State
    phase: Annotated[str, Field(description="What it is at, for people")]
    done: Annotated[int, Field(description="Of this phase ...")]
    total: Annotated[int, Field(description="... so much; 0: not known")]
    words: Annotated[str, Field(description="How it ended, for people: what failed, why, and what is on board now")]
    item: Annotated[int | None, Field(description="The item of the plan that was refused, from 0")]
    code: Annotated[str, Field(description="The name of a MAV_MISSION_RESULT or MAV_RESULT, where there is one")]
    seen: Annotated[
        bool | None,
        Field(description="A command: whether telemetry showed in time what was accepted; null: nothing to see"),
    ]
    hash: Annotated[str | None, Field(description="Of the plan that was asked for")]
    refusals: Annotated[list[RefusalView], Field(description="Parameters: the first 200 that are not as asked")]
    refused: Annotated[int, Field(description="How many are not, in all")]
    logs: Annotated[list[LogView] | None, Field(description="Of a list of logs, newest first")]
    by: Annotated[UserRefView | None, Field(description="Who asked for it")]
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
