"""`/api/v1/drones/{id}/signing`: whether a drone's agent and autopilot sign what they send each other."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import APIRouter, Path, Response

from server.http.access import Pilot
from server.http.dependencies import AddressDep, HubDep
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.people import Principal
from server.live.hub import Hub
from server.operations.api.operation_requests import ACCEPTED, Prefer, answer, begin, flown_drone
from server.operations.core.operation import Lane, Operation, Order, Step
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    NotInControl,
    TooManyOperations,
    TurnTimeout,
    ViewTaken,
)
from server.operations.core.views import OperationView
from wire.signing_key import SIGNING, SigningChange, SigningWork

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/signing",
    tags=["control"],
    responses=answers(
        *(NotSignedIn, SessionExpired, UnknownDrone, ViewTaken, NotInControl, Assisted, TurnTimeout, LoanForbids),
        *(DroneOffline, AgentTooOld, DroneBusy, TooManyOperations),
    )
    | ACCEPTED,
)

WITHIN_S: Final = 20.0
NOT_A_BORROWERS: Final = "the signing key is its owners' to change"

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]


@router.post("")
async def set_signing_key(
    response: Response, principal: Pilot, hub: HubDep, address: AddressDep, drone_id: DronePath, prefer: Prefer = None
) -> OperationView:
    """Has the agent make a key and give it to the autopilot, which from then on takes only what is signed with it. A
    second time: another key. The key stays on the drone. Disarmed; only the holder may do this, and no borrower."""
    operation = await _begin(hub, principal, drone_id, SigningChange.NEW_KEY, address)
    return await answer(operation, response, prefer)


@router.delete("")
async def remove_signing_key(
    response: Response, principal: Pilot, hub: HubDep, address: AddressDep, drone_id: DronePath, prefer: Prefer = None
) -> OperationView:
    """Takes the key away: nothing is signed any more. A key that the autopilot does not sign with (`wrong_key`) is
    forgotten by the agent."""
    operation = await _begin(hub, principal, drone_id, SigningChange.REMOVE, address)
    return await answer(operation, response, prefer)


async def _begin(hub: Hub, principal: Principal, drone_id: int, change: SigningChange, address: str) -> Operation:
    drone = await flown_drone(hub, principal, drone_id)
    if drone.limits_of(principal.user_id, principal.role) is not None:
        raise LoanForbids(drone.record.name, NOT_A_BORROWERS)
    order = Order(
        "signing",
        Lane.AGENT,
        [Step(SigningWork(change), WITHIN_S)],
        writes=True,
        needs=SIGNING,
        about={"change": change},
    )
    return begin(hub, principal, drone, order, address)
