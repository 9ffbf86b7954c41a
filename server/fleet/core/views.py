"""How a drone looks from outside: the `Drone` of docs/wire-protocol.md, in REST answers and live messages alike."""

from __future__ import annotations

from datetime import datetime
from functools import lru_cache
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from server.kernel.fleet import DroneRecord, LoanRecord
from server.kernel.people import UserRef
from server.kernel.relations import Relation
from server.kernel.restraint import Measure, Restraint
from server.link.core.noise_watch import NoiseWatch
from server.operations.core.onboard_views import (
    ANSWER_CONFIG,
    NO_PARAMETERS,
    NO_PLANS,
    ParametersStateView,
    PlansView,
)
from wire.drone_key import fingerprint
from wire.open_holds import AfterSticks, HoldStage, Lost, LostAction, LostPhase
from wire.signing_key import Signing
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
    """A loan to a user. Limits in metres above and around home; null: none."""

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
    """The team of a drone."""

    model_config = ConfigDict(frozen=True)

    id: int
    name: str


class HoldView(BaseModel):
    """An open hold and the lost action, as the agent last reported them."""

    model_config = ConfigDict(frozen=True)

    open: Annotated[bool, Field(description="Until somebody flies, the lost action is done, or the drone is disarmed")]
    stage: Annotated[
        HoldStage,
        Field(description="`altitude`: altitude hold with centred sticks; `stay`: a mode that needs no sticks"),
    ]
    mode: Annotated[str, Field(description="The autopilot's mode, by name")]
    sticks: Annotated[bool, Field(description="The agent sends centred sticks")]
    after_sticks: Annotated[AfterSticks, Field(description="What the autopilot does if these stop or the agent dies")]
    waiting_for: Annotated[str, Field(description="Why it does not yet stay without sticks, for people")]
    lost: Annotated[Lost | None, Field(description="Who is away")]
    nobody_because: Annotated[
        str, Field(description="Why nobody flies it, for people; empty unless a person is away")
    ] = ""
    phase: Annotated[LostPhase, Field(description="Phase of the lost action")]
    action: Annotated[LostAction | None, Field(description="The action, pending or running")]
    due_at: Annotated[datetime | None, Field(description="By the tower's clock; null unless pending")]
    detail: Annotated[str, Field(description="For people")]
    as_of: Annotated[datetime, Field(description="Time of the agent's report")]
    stale: Annotated[bool, Field(description="The agent's link is down: this is its last report")]


class LastHeardView(BaseModel):
    """What the autopilot did when the tower heard it last."""

    model_config = ConfigDict(frozen=True)

    at: Annotated[datetime, Field(description="Since when link or autopilot are silent")]
    armed: bool
    airborne: Annotated[bool, Field(description="As the agent reported last")]
    autopilot: Annotated[int | None, Field(description="MAV_AUTOPILOT; null: no heartbeat came")]
    vehicle_type: Annotated[int | None, Field(description="MAV_TYPE")]
    custom_mode: Annotated[int | None, Field(description="HEARTBEAT.custom_mode")]
    lat: Annotated[float | None, Field(description="Degrees; null: no position came")]
    lon: float | None
    height_m: Annotated[float | None, Field(description="Above home")]


class IdentityView(BaseModel):
    """How the agent proves its identity. `credential`: the bearer secret of an older version; the agent's next sign-in
    exchanges it for a key."""

    model_config = ANSWER_CONFIG

    kind: Literal["none", "credential", "key"] = "none"
    fingerprint: Annotated[str | None, Field(description="`SHA256:...` of the public key")] = None
    since: Annotated[datetime | None, Field(description="When the key was enrolled")] = None

    @classmethod
    def of(cls, record: DroneRecord) -> IdentityView:
        if record.public_key:
            return _by_key(record.public_key, record.key_since)
        return _BY_CREDENTIAL if record.credential_hash else _BY_NOTHING


class RestraintView(BaseModel):
    """What is done about a drone that sends more than its share."""

    model_config = ANSWER_CONFIG

    measure: Annotated[
        Measure,
        Field(
            description="`muted`: its texts, and alerts that are not critical, reach only whoever has the controls; "
            "`limited`: its telemetry too passes only twice a second; `quarantined`: its agent gets no link"
        ),
    ]
    reason: Annotated[str, Field(description="For people")]
    by: Annotated[str | None, Field(description="The admin; null: the tower by itself, until the drone is quiet")]
    since: datetime

    @classmethod
    def of(cls, restraint: Restraint | None, noise: NoiseWatch) -> RestraintView | None:
        """That of an admin, or else what the tower does by itself."""
        if restraint is not None:
            return cls(measure=restraint.measure, reason=restraint.reason, by=restraint.by, since=restraint.since)
        if not noise.measures or noise.since is None:
            return None
        measure = Measure.LIMITED if Measure.LIMITED in noise.measures else Measure.MUTED
        return cls(measure=measure, reason=noise.words, by=None, since=noise.since)


_BY_NOTHING: Final = IdentityView()
_BY_CREDENTIAL: Final = IdentityView(kind="credential")


@lru_cache(maxsize=4096)
def _by_key(public_key: bytes, since: datetime | None) -> IdentityView:
    """Kept: a drone is put into a view with each change of anything."""
    return IdentityView(kind="key", fingerprint=fingerprint(public_key), since=since)


class DroneView(BaseModel):
    """One drone: owners, holder, link and state."""

    model_config = ANSWER_CONFIG

    id: int
    name: str
    online: Annotated[bool, Field(description="The agent has a link to the tower")]
    owners: list[UserRefView]
    loans: Annotated[list[LoanView], Field(description="Users it is lent to, and until when")] = []
    holder: Annotated[UserRefView | None, Field(description="The user who has the controls")]
    epoch: Annotated[int, Field(description="Increments with each change of the lease")]
    taken_from: Annotated[
        UserRefView | None,
        Field(description="The operator from whom an admin took control; shut out until it is given back"),
    ]
    autopilot_heard: Annotated[bool, Field(description="The agent receives heartbeats from the autopilot")]
    agent_version: Annotated[
        str | None,
        Field(description="Version of the agent that linked last; null: none has since the tower started"),
    ] = None
    firmware: Annotated[
        str | None,
        Field(description="The autopilot's release (`4.6.2`, `4.7.0-dev`); null: not known", examples=["4.6.2"]),
    ] = None
    release: Annotated[
        tuple[int, int] | None,
        Field(description="Major and minor number of the newest release whose features `firmware` surely has"),
    ] = None
    armed: Annotated[bool | None, Field(description="As the agent reports; null: not known")] = None
    airborne: Annotated[bool | None, Field(description="As the agent reports; null: not known")] = None
    watched_only: Annotated[
        bool,
        Field(
            description="Nobody has measured how such a vehicle holds: the agent sends it no sticks and no mode itself"
        ),
    ] = False
    other_systems: Annotated[
        list[int],
        Field(description="MAVLink systems of other autopilots on its line. The agent passes none of their frames"),
    ] = []
    hears_agent: Annotated[
        bool | None,
        Field(description="Whether the autopilot has answered the agent in the last 10 s; null: not known"),
    ] = None
    signing: Annotated[
        Signing,
        Field(
            description="Whether autopilot and agent sign what they send each other. `wrong_key`: what comes is not "
            "signed with the agent's key, and does not count; `no_key`: the autopilot signs, and the agent has no key"
        ),
    ] = Signing.OFF
    hold: Annotated[HoldView | None, Field(description="null: no open hold, no loss, no lost action")] = None
    airborne_since: Annotated[
        datetime | None, Field(description="When it took off, as reported to the tower; null: not known")
    ] = None
    last_heard: Annotated[
        LastHeardView | None,
        Field(description="null while the autopilot is heard, and if it never was; or not for you to know"),
    ] = None
    offered: Annotated[bool, Field(description="Offered to `taken_from`, who has not accepted yet")] = False
    assistant: Annotated[UserRefView | None, Field(description="An admin who assists the holder")] = None
    may_watch: Annotated[bool, Field(description="False for an operator who was also barred from watching")] = True
    may_watch_video: Annotated[
        bool, Field(description="False for an operator who was also barred from the video or from watching")
    ] = True
    lost_action: Annotated[LostAction, Field(description="What the agent does when tower or person stay away")] = (
        LostAction.RETURN
    )
    lost_action_s: Annotated[float, Field(description="In seconds")] = 30.0
    profile: Annotated[
        StreamProfile | None, Field(description="Amount of telemetry now, as the agent reports; null: not known")
    ] = None
    profile_chosen: Annotated[StreamChoice, Field(description="The admin's choice; `auto`: the agent decides")] = (
        StreamChoice.AUTO
    )
    profile_why: Annotated[str, Field(description="Reason for this profile, for people")] = ""
    plans: Annotated[PlansView, Field(description="The plans on board, as the agent reports")] = NO_PLANS
    identity: Annotated[IdentityView, Field(description="How the agent proves its identity")] = _BY_NOTHING
    parameters: Annotated[ParametersStateView, Field(description="Progress of reading its parameters")] = NO_PARAMETERS
    suspicious_motion: Annotated[
        Literal["jump", "speed", "height", "course"] | None,
        Field(description="Impossible motion of the armed drone in the last minute"),
    ] = None
    restraint: Annotated[
        RestraintView | None, Field(description="What is done because it sends too much; null: nothing")
    ] = None
    relation: Annotated[
        Relation, Field(description="Your relation to it, which decides what you may do (docs/teams.md)")
    ] = Relation.STRANGER
    team: Annotated[TeamRefView | None, Field(description="Its team; null: none, or not visible to you")] = None
