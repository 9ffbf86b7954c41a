"""`/api/v1/drones/{id}/loss-check` and `/rehearsal`: the effects of a loss, and rehearsing one."""

from typing import Annotated, Literal

from fastapi import APIRouter, Body, Path
from pydantic import BaseModel, ConfigDict, Field

from server.control.core.simulated import is_simulator
from server.control.store.loss_checks import LossCheck
from server.control.store.rehearsal import LASTS_S
from server.control.store.service import ControlRefused
from server.http.access import Pilot, Viewer
from server.http.dependencies import AddressDep, HubDep, LossChecksDep, RehearsalsDep
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from wire.ids import DroneId

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}", tags=["control"], responses=answers(NotSignedIn, SessionExpired, UnknownDrone)
)

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]


class SentenceView(BaseModel):
    """What happens when a certain link is lost."""

    about: Literal["operator", "tower", "radio"]
    severity: Literal["info", "warning", "danger"]
    text: str


class LossCheckView(BaseModel):
    """What would happen on a loss, as far as the autopilot's parameters show."""

    complete: Annotated[bool, Field(description="All relevant parameters were read")]
    has_radio: Annotated[bool | None, Field(description="null: not known")]
    sentences: list[SentenceView]
    dangerous: Annotated[bool, Field(description="Must be acknowledged before arming")]
    acknowledged: Annotated[
        bool, Field(description="For these dangers: by you if you may arm the drone now, else by its holder")
    ]
    simulated: Annotated[bool, Field(description="The parameters prove that the autopilot is simulated")]

    @classmethod
    def of(cls, check: LossCheck) -> "LossCheckView":
        return cls.model_validate(check, from_attributes=True)


class Acknowledgement(BaseModel):
    """Confirms the drone by its name; required where a loss is dangerous."""

    model_config = ConfigDict(extra="forbid")

    drone: Annotated[str | None, Field(max_length=200)] = None


class RehearsalRequest(BaseModel):
    """The loss to rehearse. `in_flight`: also with an armed drone that is not simulated; ask the people concerned
    first."""

    model_config = ConfigDict(extra="forbid")

    what: Literal["operator", "tower"]
    in_flight: bool = False


class RehearsalLasts(BaseModel):
    """Durations in seconds."""

    operator: float
    tower: float


class RehearsalView(BaseModel):
    """What a rehearsal would do."""

    lasts_s: Annotated[RehearsalLasts, Field(description="Duration of each loss")]
    running: Annotated[bool, Field(description="A rehearsal is running")]
    simulated: Annotated[bool, Field(description="The autopilot is simulated: `in_flight` is not needed")]


class RehearsalBegun(BaseModel):
    """Progress follows as `rehearsal` events on `/api/v1/live`."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=True)

    what: Literal["operator", "tower"]
    phase: Literal["begun"] = "begun"


@router.get("/loss-check")
async def get_loss_check(
    principal: Viewer, hub: HubDep, loss_checks: LossChecksDep, drone_id: DronePath
) -> LossCheckView:
    """Describes what would happen if the operator, the tower or the radio were lost."""
    if hub.squads.drone(DroneId(drone_id), principal.user_id, principal.role) is None:
        raise UnknownDrone
    return LossCheckView.of(loss_checks.check(DroneId(drone_id), principal.user_id))


@router.post("/loss-check/acknowledge", responses=answers(ControlRefused))
async def acknowledge_loss_check(
    principal: Pilot,
    loss_checks: LossChecksDep,
    address: AddressDep,
    drone_id: DronePath,
    body: Annotated[Acknowledgement | None, Body()] = None,
) -> LossCheckView:
    """Acknowledges the loss check and names the drone; for the user who may arm the drone now (its holder, or an admin
    who assists). Until then that user cannot arm a drone that a loss would drop or lose. 409 `wrong-name`: the name is
    missing or wrong."""
    named = body.drone if body is not None else None
    check = await loss_checks.acknowledge(principal, DroneId(drone_id), named=named, address=address)
    return LossCheckView.of(check)


@router.get("/rehearsal")
async def get_rehearsal(
    principal: Viewer, hub: HubDep, rehearsals: RehearsalsDep, drone_id: DronePath
) -> RehearsalView:
    """Returns how long a rehearsed loss lasts, and whether one is running."""
    drone = hub.squads.drone(DroneId(drone_id), principal.user_id, principal.role)
    if drone is None:
        raise UnknownDrone
    return RehearsalView(
        lasts_s=RehearsalLasts(**LASTS_S),
        running=rehearsals.running(drone.drone_id),
        simulated=is_simulator(drone.loss_parameters),
    )


@router.post("/rehearsal", status_code=202, responses=answers(ControlRefused))
async def rehearse_loss(
    principal: Pilot, rehearsals: RehearsalsDep, address: AddressDep, drone_id: DronePath, body: RehearsalRequest
) -> RehearsalBegun:
    """Holder or admin: simulates the loss of the operator or of the tower, to see the drone hold and how fast."""
    rehearsals.begin(principal, DroneId(drone_id), body.what, in_flight=body.in_flight, address=address)
    return RehearsalBegun(what=body.what)
