"""`/api/v1/operations`: operations on drones that are running or ended recently."""

import time
from typing import Annotated

from fastapi import APIRouter, Path

from server.http.access import Pilot, Viewer
from server.http.dependencies import HubDep
from server.http.problem_docs import answers
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live.hub import Hub
from server.operations.core.operation import Operation
from server.operations.core.permissions import refuse_others
from server.operations.core.refusals import NotInControl, UnknownOperation
from server.operations.core.views import OperationView

router = APIRouter(prefix="/api/v1/operations", tags=["operations"], responses=answers(UnknownOperation))

OperationPath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]


def _find(hub: Hub, principal: Principal, operation_id: int) -> Operation:
    operation = hub.operations.find(operation_id)
    drone = hub.squads.drone(operation.drone_id, principal.user_id, principal.role) if operation else None
    if operation is None or drone is None or principal.user_id == drone.user_without_view:
        raise UnknownOperation
    if not drone.knows_of(principal.user_id, principal.role, operation.began_at):
        raise UnknownOperation
    return operation


@router.get("/{operation_id}")
async def get_operation(principal: Viewer, hub: HubDep, operation_id: OperationPath) -> OperationView:
    """Returns an operation. The tower keeps the last thousand, for an hour."""
    return OperationView.of(_find(hub, principal, operation_id))


@router.delete("/{operation_id}", status_code=202, responses=answers(NotInControl))
async def cancel_operation(principal: Pilot, hub: HubDep, operation_id: OperationPath) -> OperationView:
    """Cancels an operation: by its requester, the holder, or an admin. The end is reported later."""
    operation = _find(hub, principal, operation_id)
    drone = hub.state.drones.get(operation.drone_id)
    theirs = operation.by is not None and operation.by.id == principal.user_id
    if drone is not None and not theirs and not drone.may(principal.user_id, principal.role, Right.CANCEL):
        refuse_others(drone, principal, time.monotonic())
    hub.operations.cancel(operation)
    return OperationView.of(operation)
