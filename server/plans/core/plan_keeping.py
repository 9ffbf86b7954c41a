"""Predicts what a drone's autopilot changes in a plan. Pure; wire.plan_keeping has the facts."""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct
from typing import Annotated, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from server.airspace.core.zones.requests import ZoneHit
from server.live.live_drone import LiveDrone
from server.operations.core.flying.vehicle import NotKnownYet
from wire.frames import payload
from wire.plan_fields import Effect, KeptFields
from wire.plan_keeping import change_words, changes_ahead, keeping_of
from wire.plans import PlanItem, PlanKind

MAX_LISTED: Final = 200
_HEARTBEAT: Final = Struct("<IBBBBB")

EffectName = Literal["flight", "refused"]


class ChangeView(BaseModel):
    """A value that the autopilot changes."""

    model_config = ConfigDict(frozen=True)

    item: Annotated[int, Field(description="From 0; for `count` the first item without room")]
    field: Annotated[str, Field(description="command, frame, param1 to param4, x, y, z, autocontinue or count")]
    sent: Annotated[float | None, Field(description="null: NaN")]
    kept: Annotated[float | None, Field(description="null: NaN; for a refused value the sent one")]
    effect: Annotated[EffectName, Field(description="flight: the flight differs; refused: the upload will fail")]
    words: str


class ZoneOnWayView(BaseModel):
    """A zone that the plan would lead this drone into."""

    model_config = ConfigDict(frozen=True)

    item: Annotated[int, Field(description="From 0: the item whose way leads there")]
    words: str
    refuses: Annotated[bool, Field(description="The upload will be refused; otherwise the zone only warns")]

    @classmethod
    def of(cls, hit: ZoneHit) -> Self:
        return cls(item=hit.item or 0, words=hit.words, refuses=hit.zone.binds)


class PlanKeptView(BaseModel):
    """What the drone's autopilot makes of a plan."""

    model_config = ConfigDict(frozen=True)

    autopilot: Annotated[str, Field(description="Name, for people")]
    changes: Annotated[list[ChangeView], Field(description=f"To be known before an upload; the first {MAX_LISTED}")]
    count: Annotated[int, Field(description="Total number of these")]
    quiet: Annotated[int, Field(description="Number of values that change without effect on the flight")]
    zones: Annotated[list[ZoneOnWayView], Field(description="At most one for each item")]


def keeping_for(drone: LiveDrone) -> KeptFields:
    """Raises NotKnownYet before a heartbeat."""
    if drone.heartbeat is None:
        raise NotKnownYet(f"no heartbeat yet from the autopilot of {drone.record.name}")
    body = payload(drone.heartbeat).ljust(_HEARTBEAT.size, b"\0")
    _, vehicle_type, autopilot, _, _, _ = _HEARTBEAT.unpack_from(body)
    return keeping_of(autopilot, vehicle_type, drone.firmware)


def plan_kept(
    keeping: KeptFields, kind: PlanKind, items: Sequence[PlanItem], zones: Sequence[ZoneHit] = ()
) -> PlanKeptView:
    """The changes to report before an upload."""
    changes = changes_ahead(keeping, kind, items)
    relevant = [one for one in changes if one.effect > Effect.QUIET]
    views = [
        ChangeView(
            item=one.item,
            field=one.field,
            sent=one.sent,
            kept=one.kept,
            effect="refused" if one.effect is Effect.REFUSED else "flight",
            words=change_words(keeping, one),
        )
        for one in relevant[:MAX_LISTED]
    ]
    return PlanKeptView(
        autopilot=keeping.name,
        changes=views,
        count=len(relevant),
        quiet=len(changes) - len(relevant),
        zones=[ZoneOnWayView.of(hit) for hit in zones],
    )
