"""`/api/v1/drones/{id}/mission`, `/fence`, `/rally`: the plans on board. Viewers read, the holder writes."""

from __future__ import annotations

import time
from contextlib import suppress
from functools import partial
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Path, Query, Request, Response
from starlette.convertors import Convertor, register_url_convertor

from server.http.access import Pilot, Viewer
from server.http.dependencies import AddressDep, AuthenticatorDep, ClockDep, HubDep, SettingsDep, SideThreadDep
from server.http.problem_docs import answers
from server.http.strict_body import read_body
from server.kernel.access import Action, UnknownDrone
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.maps.api.dependencies import TerrainDep
from server.operations.api.operation_requests import (
    ACCEPTED,
    Prefer,
    answer,
    begin,
    ended,
    flown_drone,
    watched_drone,
    zones_of_plan,
)
from server.operations.core.flying.vehicle import NotKnownYet
from server.operations.core.operation import Lane, Operation, State
from server.operations.core.permissions import refuse_others, refuse_plan
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    NotInControl,
    OnlyWatches,
    TooManyOperations,
    ViewTaken,
    ZoneForbids,
)
from server.operations.core.views import OperationView
from server.plans.core import plans
from server.plans.core.ground_check import IntoTheGround, Origin, refuse_into_the_ground
from server.plans.core.plan_body import (
    ITEMS_SCHEMA,
    BadPlan,
    MalformedBody,
    PlanBody,
    PlanToPut,
    body_schema,
    plan_of,
)
from server.plans.core.plan_keeping import PlanKeptView, keeping_for, plan_kept
from server.plans.core.plans import PlanNotRead, PlanView
from server.runtime.side_thread import TooMuchWork
from wire.plans import PlanKind
from wire.transactions import PlanDownloadWork


class _KindConvertor(Convertor[str]):
    """Matches only plan kinds, so that no other path of a drone is taken for a plan."""

    regex = "|".join(PlanKind)

    def convert(self, value: str) -> str:
        return value

    def to_string(self, value: str) -> str:
        return value


register_url_convertor("plan_kind", _KindConvertor())
router = APIRouter(prefix="/api/v1/drones/{drone_id}", tags=["plans"], responses=answers(UnknownDrone, ViewTaken))

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
KindPath = Annotated[Literal["mission", "fence", "rally"], Path()]
WhileFlying = Annotated[bool, Query(description="Allowed while the mission is flown; pauses it")]

_BEGIN: Final = answers(OnlyWatches, DroneOffline, AgentTooOld, DroneBusy, TooManyOperations)
_WRITE: Final = _BEGIN | ACCEPTED | answers(NotInControl, Assisted, LoanForbids, ZoneForbids)
_BODY: Final = answers(MalformedBody, BadPlan)
_ITEMS: Final[dict[str, Any]] = {"items": ITEMS_SCHEMA}
_NO: Final = {"type": "boolean", "default": False}


@router.get(
    "/{kind:plan_kind}", operation_id="get_plan", response_model=PlanView, responses=_BEGIN | answers(PlanNotRead)
)
async def get_plan(
    principal: Viewer,
    hub: HubDep,
    address: AddressDep,
    clock: ClockDep,
    drone_id: DronePath,
    kind: KindPath,
    fresh: Annotated[bool, Query(description="Read it from the autopilot now")] = False,
) -> Response:
    """Returns the plan on board, as last reported by the agent, or read again now."""
    drone = watched_drone(hub, principal, drone_id)
    what = PlanKind(kind)
    if not fresh:
        return _json(plans.plan_json(drone.onboard, what))
    operation = _being_read(hub, drone, what) or begin(hub, principal, drone, plans.download(what), address)
    await ended(operation)
    if operation.state is State.REFUSED:
        raise DroneBusy(operation.words)
    if operation.state is not State.DONE or operation.plan is None:
        raise PlanNotRead(operation.words or f"the plan of {drone.record.name} could not be read")
    return _json(plans.fresh_json(drone.onboard, what, operation.plan, operation.ended_at or clock()))


@router.put(
    "/{kind:plan_kind}",
    operation_id="put_plan",
    responses=_WRITE | _BODY | answers(IntoTheGround, TooMuchWork),
    openapi_extra=body_schema({**_ITEMS, "while_flying": _NO, "despite_ground": _NO}, ["items"]),
)
async def put_plan(
    request: Request,
    response: Response,
    principal: Pilot,
    authenticator: AuthenticatorDep,
    hub: HubDep,
    address: AddressDep,
    terrain: TerrainDep,
    side: SideThreadDep,
    settings: SettingsDep,
    drone_id: DronePath,
    kind: KindPath,
    prefer: Prefer = None,
) -> OperationView:
    """Uploads a plan. It replaces the old plan as a whole, verified by reading it back; otherwise the old plan
    stays. A mission into the ground is refused, unless `despite_ground`."""
    body = await read_body(request, PlanToPut)
    principal = await authenticator.admit(request, Action.FLY)
    what, items = PlanKind(kind), plan_of(body.items)
    if what is PlanKind.MISSION and not body.despite_ground:
        drone = watched_drone(hub, principal, drone_id)
        refuse_others(drone, principal, time.monotonic())
        home = None
        if drone.home is not None:
            home = Origin(drone.home.lat_deg, drone.home.lon_deg, drone.home.alt_amsl_m)
        clearance_m = settings.ground_clearance_m
        refuse = partial(refuse_into_the_ground, drone.record.name, items, home, terrain.heights, clearance_m)
        with suppress(TimeoutError):  # then the ground is not known, and nothing is said
            await terrain.in_turn(refuse)
    zones = await zones_of_plan(hub, principal, drone_id, side, what, items)
    drone = await flown_drone(hub, principal, drone_id)
    refuse_plan(drone, principal, what, items, zones)
    order = plans.upload(what, items, while_flying=body.while_flying)
    return await answer(begin(hub, principal, drone, order, address), response, prefer)


@router.delete("/{kind:plan_kind}", operation_id="clear_plan", responses=_WRITE)
async def clear_plan(
    response: Response,
    principal: Pilot,
    hub: HubDep,
    address: AddressDep,
    drone_id: DronePath,
    kind: KindPath,
    while_flying: WhileFlying = False,
    prefer: Prefer = None,
) -> OperationView:
    """Deletes the plan on board."""
    what = PlanKind(kind)
    drone = await flown_drone(hub, principal, drone_id)
    refuse_plan(drone, principal, what, (), ())
    order = plans.clear(what, while_flying=while_flying)
    return await answer(begin(hub, principal, drone, order, address), response, prefer)


@router.post(
    "/{kind:plan_kind}/verify",
    operation_id="verify_plan",
    responses=_BEGIN | _BODY | ACCEPTED,
    openapi_extra=body_schema(_ITEMS, ["items"]),
)
async def verify_plan(
    request: Request,
    response: Response,
    principal: Viewer,
    hub: HubDep,
    address: AddressDep,
    drone_id: DronePath,
    kind: KindPath,
    prefer: Prefer = None,
) -> OperationView:
    """Reads the plan on board and tells whether it equals this one."""
    items = plan_of((await read_body(request, PlanBody)).items)
    drone = watched_drone(hub, principal, drone_id)
    order = plans.verify(PlanKind(kind), items)
    return await answer(begin(hub, principal, drone, order, address), response, prefer)


@router.post(
    "/{kind:plan_kind}/kept",
    operation_id="foresee_plan",
    responses=answers(NotKnownYet, TooMuchWork) | _BODY,
    openapi_extra=body_schema(_ITEMS, ["items"]),
)
async def foresee_plan(
    request: Request, principal: Viewer, hub: HubDep, side: SideThreadDep, drone_id: DronePath, kind: KindPath
) -> PlanKeptView:
    """Lists what the drone's autopilot would not keep of this plan, and the zones on its way. Nothing is sent to the
    drone."""
    items = plan_of((await read_body(request, PlanBody)).items)
    what = PlanKind(kind)
    zones = await zones_of_plan(hub, principal, drone_id, side, what, items)
    keeping = keeping_for(watched_drone(hub, principal, drone_id))
    return await side.in_turn(principal.user_id, lambda: plan_kept(keeping, what, items, zones))


def _being_read(hub: Hub, drone: LiveDrone, kind: PlanKind) -> Operation | None:
    """Returns a running read of the same plan, if any."""
    there = hub.operations.running_at(drone.drone_id, Lane.PLANS)
    return next((one for one in there if one.step.work == PlanDownloadWork(kind)), None)


def _json(content: bytes) -> Response:
    return Response(content, media_type="application/json")
