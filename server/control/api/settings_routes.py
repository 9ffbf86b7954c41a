"""`/api/v1/drones/{id}/settings`: how a drone holds, what it does on a loss, and how much telemetry it sends."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path
from pydantic import BaseModel, ConfigDict, Field, field_validator

from server.control.store.settings_store import apply_to, change_settings, settings_in
from server.http.access import Admin, Viewer
from server.http.dependencies import AuditDep, DatabaseDep, HubDep, LossChecksDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.drone_settings import BOUNDS, BadDroneSettings, check_ladder
from wire.ids import DroneId

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/settings",
    tags=["control"],
    responses=answers(NotSignedIn, SessionExpired, UnknownDrone),
)

DronePath = Annotated[int, Path(ge=1, le=2**31 - 1)]
LostActionName = Literal["return", "land", "continue", "stay"]
ProfileName = Literal["auto", "full", "thin", "minimal"]


def _within(name: str, description: str) -> Any:
    least, most = BOUNDS[name]
    return Field(ge=least, le=most, allow_inf_nan=False, description=description)


Ladder = Annotated[
    list[str], Field(max_length=4, description="Hold modes, tried in order; altitude hold is always the last")
]
SticksStale = Annotated[
    float, _within("sticks_stale_s", "Hold after this long without fresh sticks while flown by hand")
]
SticksLate = Annotated[float, _within("sticks_late_s", "Sticks older than this are discarded")]
CommandsLate = Annotated[float, _within("commands_late_s", "Commands older than this are never executed")]
LostHold = Annotated[float, _within("lost_hold_s", "Hold after this long without the tower while flown by hand")]
LostActionAfter = Annotated[float, _within("lost_action_s", "`lost_action` after this long without tower or person")]
RttLimitMs = Annotated[float, _within("rtt_limit_ms", "A round trip above this ...")]
RttLimitFor = Annotated[float, _within("rtt_limit_s", "... for so long while flown by hand: hold")]

Profile = Annotated[ProfileName, Field(description="Amount of telemetry; `auto`: the agent adapts it to the link")]


class DroneSettingsView(BaseModel):
    """Every setting, including defaults. Times in seconds."""

    hold_ladder: Ladder
    sticks_stale_s: SticksStale
    sticks_late_s: SticksLate
    commands_late_s: CommandsLate
    lost_hold_s: LostHold
    lost_action: LostActionName
    lost_action_s: LostActionAfter
    rtt_limit_ms: RttLimitMs
    rtt_limit_s: RttLimitFor
    stream_profile: Profile


class DroneSettingsPatch(BaseModel):
    """The settings to change; others stay as they are."""

    model_config = ConfigDict(extra="forbid")

    hold_ladder: Ladder | None = None
    sticks_stale_s: SticksStale | None = None
    sticks_late_s: SticksLate | None = None
    commands_late_s: CommandsLate | None = None
    lost_hold_s: LostHold | None = None
    lost_action: LostActionName | None = None
    lost_action_s: LostActionAfter | None = None
    rtt_limit_ms: RttLimitMs | None = None
    rtt_limit_s: RttLimitFor | None = None
    stream_profile: Profile | None = None

    @field_validator("hold_ladder")
    @classmethod
    def _a_ladder(cls, value: list[str] | None) -> list[str] | None:
        return None if value is None else check_ladder(value)


@router.get("")
async def get_drone_settings(principal: Viewer, hub: HubDep, drone_id: DronePath) -> DroneSettingsView:
    """Returns how this drone holds, what it does when the tower or the person is lost, and how much telemetry it
    sends."""
    if hub.squads.drone(DroneId(drone_id), principal.user_id, principal.role) is None:
        raise UnknownDrone
    return DroneSettingsView.model_validate(settings_in(hub, DroneId(drone_id)).as_values())


@router.patch("", responses=answers(AdminsOnly, BadDroneSettings))
async def change_drone_settings(
    admin: Admin,
    audit: AuditDep,
    database: DatabaseDep,
    hub: HubDep,
    loss_checks: LossChecksDep,
    drone_id: DronePath,
    body: DroneSettingsPatch,
) -> DroneSettingsView:
    """Admin: changes some settings. The drone's agent receives them at once, or when it next connects."""
    action = audit.action(admin)
    change = body.model_dump(exclude_none=True)
    async with database.writing() as session:
        settings = await change_settings(session, drone_id=drone_id, change=change, action=action)
    apply_to(hub, DroneId(drone_id), settings)
    loss_checks.recheck(DroneId(drone_id))
    return DroneSettingsView.model_validate(settings.as_values())
