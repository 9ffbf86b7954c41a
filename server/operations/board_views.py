"""What is on board of a drone, as it looks from outside: in REST answers, in a `Drone` and in live events."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from wire.plans import PlanKind

PlanStateName = Literal["known", "unknown"]


class PlanBoardView(BaseModel):
    """Which plan of one kind is on board, as far as the tower knows."""

    model_config = ConfigDict(frozen=True)

    kind: PlanKind
    state: PlanStateName = "unknown"
    hash: Annotated[str | None, Field(description="Of the plan as the autopilot has it; null: not known")] = None
    sent_hash: Annotated[
        str | None,
        Field(description="Of the plan as it was sent, where the autopilot keeps some fields in its own way"),
    ] = None
    count: Annotated[int, Field(description="Items")] = 0
    fit_to_fly: Annotated[bool, Field(description="False: it may be half of one, and no mission can be started")] = True


class PlansView(BaseModel):
    """One of each kind."""

    model_config = ConfigDict(frozen=True)

    mission: PlanBoardView = PlanBoardView(kind=PlanKind.MISSION)
    fence: PlanBoardView = PlanBoardView(kind=PlanKind.FENCE)
    rally: PlanBoardView = PlanBoardView(kind=PlanKind.RALLY)


class ParametersStateView(BaseModel):
    """How far the drone's parameters are known to its agent."""

    model_config = ConfigDict(frozen=True)

    hash: Annotated[str | None, Field(description="Of all of them; null: they are being read, or not known")] = None
    count: Annotated[int, Field(description="How many are known ...")] = 0
    total: Annotated[int, Field(description="... of how many; 0: not known")] = 0


NO_PLANS = PlansView()
NO_PARAMETERS = ParametersStateView()
