"""Turns a request into an operation and its response: a thin layer over the operation service, for all such routes."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any, Final

from fastapi import Header, Response

from server.airspace.core.zones.check import PlanJudge, plan_judge
from server.airspace.core.zones.requests import ZoneHit
from server.kernel.access import UnknownDrone
from server.kernel.people import Principal, UserRef
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.core.onboard_state import KnownPlan
from server.operations.core.operation import Operation, Order
from server.operations.core.permissions import refuse_others, require_view
from server.operations.core.refusals import Assisted, OnlyWatches, TooManyOperations, TurnTimeout
from server.operations.core.views import OperationView
from server.runtime.request_id import current_request_id
from server.runtime.side_thread import SideThread
from wire.ids import DroneId
from wire.plans import PlanItem, PlanKind

TURN_WITHIN_S: Final = 2.0
CHECK_EVERY_S: Final = 0.02
ASYNC: Final = "respond-async"

Prefer = Annotated[
    str | None, Header(description="`respond-async`: responds with 202 at once; `/live` reports the result")
]
ACCEPTED: Final[dict[int | str, dict[str, Any]]] = {
    202: {"model": OperationView, "description": "Begun: with `Prefer: respond-async`"}
}


def watched_drone(hub: Hub, principal: Principal, drone_id: int) -> LiveDrone:
    """Raises UnknownDrone, ViewTaken."""
    drone = hub.squads.drone(DroneId(drone_id), principal.user_id, principal.role)
    if drone is None:
        raise UnknownDrone
    require_view(drone, principal)
    return drone


def refuse_observers(drone: LiveDrone, principal: Principal) -> None:
    """Raises OnlyWatches for users who may see the drone, but may not have anything read or fetched from it."""
    if not drone.may(principal.user_id, principal.role, Right.READ):
        raise OnlyWatches(drone.record.name)


async def zones_of_plan(
    hub: Hub,
    principal: Principal,
    drone_id: int,
    side: SideThread,
    kind: PlanKind,
    items: Sequence[PlanItem] | None = None,
) -> list[ZoneHit]:
    """Returns the zones that a plan would lead the drone into. `items` None: the plan on board. Raises UnknownDrone,
    ViewTaken, TooMuchWork."""
    while True:
        drone = watched_drone(hub, principal, drone_id)
        zones, on_board = drone.zones, drone.onboard.plan(kind)[1]
        if not zones:
            return []
        judged = partial(_judged, plan_judge(drone), kind, on_board if items is None else items)
        hits = await side.in_turn(principal.user_id, judged)
        if drone.zones is zones and (items is not None or drone.onboard.plan(kind)[1] is on_board):
            return hits


def _judged(judge: PlanJudge, kind: PlanKind, plan: KnownPlan | Sequence[PlanItem]) -> list[ZoneHit]:
    return judge(kind, (plan.items() or ()) if isinstance(plan, KnownPlan) else plan)


async def flown_drone(hub: Hub, principal: Principal, drone_id: int) -> LiveDrone:
    """Returns a drone whose controls and turn this user has. No await may come between this and `begin`.

    Raises UnknownDrone, ViewTaken, NotInControl, Assisted, TurnTimeout.
    """
    drone = watched_drone(hub, principal, drone_id)
    refuse_others(drone, principal, time.monotonic())
    until = time.monotonic() + TURN_WITHIN_S
    while not hub.operations.has_turn(drone, principal.user_id, time.monotonic()):
        if drone.lease.assistant is None or drone.lease.assistant.id != principal.user_id:
            raise Assisted(drone.record.name)
        if time.monotonic() > until:
            raise TurnTimeout(drone.record.name)
        await asyncio.sleep(CHECK_EVERY_S)
        drone = watched_drone(hub, principal, drone_id)
    refuse_others(drone, principal, time.monotonic())
    return drone


def begin(hub: Hub, principal: Principal, drone: LiveDrone, order: Order, address: str) -> Operation:
    """Raises OnlyWatches, TooManyOperations, DroneOffline, AgentTooOld, DroneBusy."""
    refuse_observers(drone, principal)
    if not hub.flood.admits_operation(principal.user_id, time.monotonic(), stops=order.stops):
        raise TooManyOperations
    by = UserRef(principal.user_id, principal.name)
    service = hub.operations
    request_id = current_request_id()
    return service.begin(drone, order, by=by, now=time.monotonic(), address=address, request_id=request_id)


async def answer(operation: Operation, response: Response, prefer: str | None) -> OperationView:
    """Waits for the end of the operation, or answers at once with `Prefer: respond-async`."""
    if prefer is not None and ASYNC in [part.strip().lower() for part in prefer.split(",")]:
        response.status_code = 202
        response.headers["Preference-Applied"] = ASYNC
    else:
        await ended(operation)
    return OperationView.of(operation)


async def ended(operation: Operation) -> None:
    """Returns when the operation is over. The service guarantees that it ends."""
    if not operation.running:
        return
    over = asyncio.Event()
    operation.on_end.append(lambda _: over.set())
    await over.wait()
