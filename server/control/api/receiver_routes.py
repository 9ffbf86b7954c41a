"""`/api/v1/drones/{id}/receiver-setup`: the parameters for a failure of the computer on board, with and without a radio
receiver."""

from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import BaseModel, Field

from server.control.core.lease import Refused
from server.control.core.receiver_setup import ReceiverSetup, receiver_setup
from server.control.store.service import ControlRefused
from server.http.access import Pilot, Viewer
from server.http.dependencies import AddressDep, HubDep
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from server.live.live_drone import LiveDrone
from server.operations.api.operation_requests import begin, flown_drone, watched_drone
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    NotInControl,
    TooManyOperations,
    ViewTaken,
)
from server.operations.core.views import OperationView
from server.parameters.api import NOT_A_BORROWERS
from server.parameters.core.orders import write

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/receiver-setup",
    tags=["control"],
    responses=answers(NotSignedIn, SessionExpired, UnknownDrone, ViewTaken),
)

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]


class SetupRowView(BaseModel):
    """One parameter."""

    name: str
    now: Annotated[float | None, Field(description="null: not read yet")]
    wanted: float
    why: str
    ok: bool


class ReceiverSetupView(BaseModel):
    """Parameters that the autopilot needs so that a failure of the computer on board brings the drone home."""

    autopilot: Annotated[str, Field(description="Family of autopilots: `ardupilot`, `px4`; empty: another")]
    has_radio: Annotated[bool | None, Field(description="null: not known")]
    needed: Annotated[
        bool, Field(description="Some values are not those that this drone requires, with or without a receiver")
    ]
    known: Annotated[bool, Field(description="All these parameters were read")]
    rows: list[SetupRowView]
    text: Annotated[str, Field(description="For people")]

    @classmethod
    def of(cls, setup: ReceiverSetup) -> "ReceiverSetupView":
        return cls(
            autopilot=setup.autopilot,
            has_radio=setup.has_radio,
            needed=setup.needed,
            known=setup.known,
            rows=[SetupRowView(name=r.name, now=r.now, wanted=r.wanted, why=r.why, ok=r.ok) for r in setup.rows],
            text=setup.text,
        )


@router.get("")
async def get_receiver_setup(principal: Viewer, hub: HubDep, drone_id: DronePath) -> ReceiverSetupView:
    """Lists the parameters that decide what a failure of the computer on board does, with or without a radio receiver:
    their present and required values."""
    return ReceiverSetupView.of(receiver_setup(watched_drone(hub, principal, drone_id).loss_parameters))


@router.post(
    "",
    status_code=202,
    responses=answers(
        *(DroneOffline, AgentTooOld, DroneBusy, TooManyOperations),
        *(NotInControl, Assisted, LoanForbids, ControlRefused),
    ),
)
async def write_receiver_setup(
    principal: Pilot, hub: HubDep, address: AddressDep, drone_id: DronePath
) -> OperationView:
    """Writes the parameters that differ from the required values, if the drone is known to be disarmed. Only the holder
    may do this, and no borrower; progress is reported as for any parameter write. 409 `armed`, `not-known-yet`,
    `nothing-to-set`."""
    drone = await flown_drone(hub, principal, drone_id)
    if drone.limits_of(principal.user_id, principal.role) is not None:
        raise LoanForbids(drone.record.name, NOT_A_BORROWERS)
    setup = receiver_setup(drone.loss_parameters)
    refused = refusal_of(drone, setup)
    if refused is not None:
        raise ControlRefused(refused)
    return OperationView.of(begin(hub, principal, drone, write(setup.to_write), address))


def refusal_of(drone: LiveDrone, setup: ReceiverSetup) -> Refused | None:
    """Returns why the setup is refused now; None if it is allowed."""
    if drone.armed is None or drone.airborne is None:
        return Refused("not-known-yet", "it is not known whether the drone is armed: its autopilot is silent")
    if drone.armed or drone.airborne:
        return Refused("armed", "the drone is armed: this is set on the ground, disarmed")
    if setup.known and not setup.to_write:
        return Refused("nothing-to-set", setup.text)
    if setup.has_radio is None:
        return Refused("not-known-yet", "it is not known whether a radio receiver is on board")
    return None if setup.known else Refused("not-known-yet", "not all relevant parameters are known yet")
