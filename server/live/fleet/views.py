"""How a drone looks from outside: the `Drone` of docs/wire-protocol.md, in REST answers and live messages alike."""

from __future__ import annotations

from datetime import datetime
from functools import lru_cache
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from server.domain.fleet import DroneRecord, LoanRecord
from server.domain.people import UserRef
from server.domain.relations import Relation
from server.live.operations.onboard_views import (
    ANSWER_CONFIG,
    NO_PARAMETERS,
    NO_PLANS,
    ParametersStateView,
    PlansView,
)
from wire.drone_key import fingerprint
from wire.open_holds import AfterSticks, HoldStage, Lost, LostAction, LostPhase
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


class TeamRefView(BaseModel):
    """The team that a drone belongs to."""

    model_config = ConfigDict(frozen=True)

    id: int
    name: str


class HoldView(BaseModel):
    """An open hold and the lost action, as the agent told last."""

    model_config = ConfigDict(frozen=True)

    open: Annotated[bool, Field(description="Until somebody flies, or the lost action is done, or it is disarmed")]
    stage: Annotated[
        HoldStage, Field(description="`altitude`: altitude hold with centred sticks; `stay`: a mode that needs none")
    ]
    mode: Annotated[str, Field(description="The autopilot's mode, by name")]
    sticks: Annotated[bool, Field(description="The agent keeps centred sticks coming")]
    after_sticks: Annotated[
        AfterSticks, Field(description="What the autopilot does by itself when these end, or the agent dies")
    ]
    waiting_for: Annotated[str, Field(description="Why it does not stay without sticks yet, for people")]
    lost: Annotated[Lost | None, Field(description="Who is away")]
    phase: Annotated[LostPhase, Field(description="How far the lost action is")]
    action: Annotated[LostAction | None, Field(description="What will be done, or is being done")]
    due_at: Annotated[datetime | None, Field(description="When, by the tower's clock; null unless it is counting")]
    detail: Annotated[str, Field(description="For people")]
    as_of: Annotated[datetime, Field(description="When the agent told this")]
    stale: Annotated[bool, Field(description="The agent's link is down: this is what it told last")]


class IdentityView(BaseModel):
    """By what its agent is known. `credential`: the bearer secret of an older version, which the agent's next sign-in
    exchanges for a key."""

    model_config = ANSWER_CONFIG

    kind: Literal["none", "credential", "key"] = "none"
    fingerprint: Annotated[str | None, Field(description="`SHA256:...` of the key's public half")] = None
    since: Annotated[datetime | None, Field(description="When the key was enrolled")] = None

    @classmethod
    def of(cls, record: DroneRecord) -> IdentityView:
        if record.public_key:
            return _by_key(record.public_key, record.key_since)
        return _BY_CREDENTIAL if record.credential_hash else _BY_NOTHING


_BY_NOTHING: Final = IdentityView()
_BY_CREDENTIAL: Final = IdentityView(kind="credential")


@lru_cache(maxsize=4096)
def _by_key(public_key: bytes, since: datetime | None) -> IdentityView:
    """Kept: a drone is put into a view with each change of anything."""
    return IdentityView(kind="key", fingerprint=fingerprint(public_key), since=since)


class DroneView(BaseModel):
    """One drone, with who owns it, who holds its controls, and whether it is there."""

    model_config = ANSWER_CONFIG

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
    armed: Annotated[bool | None, Field(description="As the agent says; null: not known")] = None
    airborne: Annotated[bool | None, Field(description="As the agent says; null: not known")] = None
    hold: Annotated[
        HoldView | None, Field(description="null: no hold is open, nobody is lost, and no lost action is under way")
    ] = None
    airborne_since: Annotated[
        datetime | None, Field(description="When it left the ground, as the tower heard it; null if it is not known")
    ] = None
    offered: Annotated[bool, Field(description="Given back to `taken_from`, who has not accepted yet")] = False
    assistant: Annotated[UserRefView | None, Field(description="An admin who assists the holder")] = None
    may_watch: Annotated[bool, Field(description="False for an operator from whom the view was taken as well")] = True
    may_watch_video: Annotated[
        bool, Field(description="False for an operator from whom the video, or the whole view, was taken as well")
    ] = True
    lost_action: Annotated[LostAction, Field(description="What the agent does when tower or person stay away")] = (
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
    identity: Annotated[IdentityView, Field(description="By what its agent is known")] = _BY_NOTHING
    parameters: Annotated[ParametersStateView, Field(description="How far its parameters are known")] = NO_PARAMETERS
    suspicious_motion: Annotated[
        Literal["jump", "speed", "height", "course"] | None,
        Field(description="Armed, it does not move as a machine can: what was found in the last minute"),
    ] = None
    relation: Annotated[
        Relation, Field(description="How you stand to it: what you may do with it follows (docs/teams.md)")
    ] = Relation.STRANGER
    team: Annotated[
        TeamRefView | None, Field(description="The team it belongs to; null where there is none, or not yours to know")
    ] = None
