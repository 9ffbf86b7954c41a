"""How a drone looks from outside: the `Drone` of docs/wire-protocol.md, in REST answers and live messages alike."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from server.fleet.snapshot import LoanRecord, UserRef
from server.operations.board_views import NO_PARAMETERS, NO_PLANS, ParametersStateView, PlansView
from wire.control_messages import LostAction
from wire.stream_profiles import StreamChoice, StreamProfile


class UserRefView(BaseModel):
    """A user, as others see them."""

    model_config = ConfigDict(frozen=True)

    id: int
    name: str

    @classmethod
    def of(cls, ref: UserRef) -> UserRefView:
        return cls(id=ref.id, name=ref.name)


class LoanView(BaseModel):
    """Lent to a user. Metres above and around home; null: no limit."""

    model_config = ConfigDict(frozen=True)

    user: UserRefView
    until: datetime
    may_arm: bool
    max_height_m: float | None
    radius_m: float | None

    @classmethod
    def of(cls, loan: LoanRecord) -> LoanView:
        return cls(
            user=UserRefView.of(loan.user),
            until=loan.until,
            may_arm=loan.may_arm,
            max_height_m=loan.max_height_m,
            radius_m=loan.radius_m,
        )


class DroneView(BaseModel):
    """One drone, with who owns it, who holds its controls, and whether it is there."""

    model_config = ConfigDict(frozen=True)

    id: int
    name: str
    online: Annotated[bool, Field(description="Its agent has a link to the tower")]
    owners: list[UserRefView]
    loans: Annotated[list[LoanView], Field(description="To whom it is lent, and until when")] = []
    holder: Annotated[UserRefView | None, Field(description="Who has the controls now")]
    epoch: Annotated[int, Field(description="Grows by one each time the holder changes")]
    taken_from: Annotated[
        UserRefView | None,
        Field(description="An admin took the controls from them: they are shut out until given back"),
    ]
    autopilot_heard: Annotated[bool, Field(description="The agent hears its autopilot")]
    armed: Annotated[bool, Field(description="As the agent says")] = False
    airborne: Annotated[bool, Field(description="As the agent says")] = False
    airborne_since: Annotated[
        datetime | None, Field(description="When it left the ground, as the tower heard it; null if it is not known")
    ] = None
    offered: Annotated[bool, Field(description="Given back to `taken_from`, who has not accepted yet")] = False
    assistant: Annotated[UserRefView | None, Field(description="An admin who assists the holder")] = None
    may_watch: Annotated[bool, Field(description="False for an operator from whom the view was taken as well")] = True
    may_watch_video: Annotated[
        bool, Field(description="False for an operator from whom the video, or the whole view, was taken as well")
    ] = True
    lost_action: Annotated[LostAction, Field(description="What the agent does when the tower stays lost")] = (
        LostAction.RETURN
    )
    lost_action_s: Annotated[float, Field(description="After so many seconds")] = 30.0
    profile: Annotated[
        StreamProfile | None, Field(description="How much telemetry it sends now, as its agent says; null if unknown")
    ] = None
    profile_chosen: Annotated[StreamChoice, Field(description="What an admin chose; `auto`: the agent decides")] = (
        StreamChoice.AUTO
    )
    profile_why: Annotated[str, Field(description="Why it is this profile, for people")] = ""
    plans: Annotated[PlansView, Field(description="Which plans are on board, as its agent says")] = NO_PLANS
    parameters: Annotated[ParametersStateView, Field(description="How far its parameters are known")] = NO_PARAMETERS
