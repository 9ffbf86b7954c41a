"""What is on board of a drone, as it looks from outside: in REST answers, in a `Drone` and in live events."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from wire.plans import PlanKind

PlanStateName = Literal["known", "unknown"]
ANSWER_CONFIG: Final = ConfigDict(frozen=True, json_schema_serialization_defaults_required=True)
"""For views with defaults: every answer has every member, so the OpenAPI document requires them all."""


class OnboardPlanView(BaseModel):
    """The plan of one kind on board, as far as the tower knows."""

    model_config = ANSWER_CONFIG

    kind: PlanKind
    state: PlanStateName = "unknown"
    hash: Annotated[str | None, Field(description="Hash of the plan on board; null: not known")] = None
    sent_hash: Annotated[
        str | None,
        Field(description="Hash of the plan as sent, if the autopilot changed fields"),
    ] = None
    count: Annotated[int, Field(description="Items")] = 0
    fit_to_fly: Annotated[bool, Field(description="False: it may be incomplete, and no mission can be started")] = True


class PlansView(BaseModel):
    """One plan of each kind."""

    model_config = ANSWER_CONFIG

    mission: OnboardPlanView = OnboardPlanView(kind=PlanKind.MISSION)
    fence: OnboardPlanView = OnboardPlanView(kind=PlanKind.FENCE)
    rally: OnboardPlanView = OnboardPlanView(kind=PlanKind.RALLY)


class ParametersStateView(BaseModel):
    """How far the agent has read the drone's parameters."""

    model_config = ANSWER_CONFIG

    hash: Annotated[str | None, Field(description="Hash of all parameters; null: being read, or not known")] = None
    count: Annotated[int, Field(description="Number known ...")] = 0
    total: Annotated[int, Field(description="... out of; 0: not known")] = 0


NO_PLANS = PlansView()
NO_PARAMETERS = ParametersStateView()
