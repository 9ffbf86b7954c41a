"""`/api/v1/drones/{id}/commands`: flight commands that do not depend on the autopilot."""

from __future__ import annotations

import time
from typing import Annotated

from fastapi import APIRouter, Body, Path, Response

from server.airspace.core.zones.requests import ZoneHit
from server.http.access import Pilot
from server.http.dependencies import AddressDep, HubDep, SideThreadDep
from server.http.problem_docs import answers
from server.kernel.access import UnknownDrone
from server.operations.api.operation_requests import (
    ACCEPTED,
    ASYNC,
    Prefer,
    answer,
    begin,
    flown_drone,
    zones_of_plan,
)
from server.operations.core.flying.bodies import Disarm, FlightCommand, Follow, FollowMe, Jump, LandAt, SetHome, Start
from server.operations.core.flying.follow_me import follow_me_order
from server.operations.core.flying.following import CannotFollow, NoSuchLeader, follow_order
from server.operations.core.flying.land_at import NotInTheAir, land_at_order
from server.operations.core.flying.on_the_ground import (
    NoSuchMotor,
    NotOnTheGround,
    PropellersNotConfirmed,
    require_set_up,
)
from server.operations.core.flying.steps import order_of
from server.operations.core.flying.vehicle import (
    NoSuchItem,
    NoSuchMode,
    NotKnownHow,
    NotKnownYet,
    StateNotRestored,
    Vehicle,
)
from server.operations.core.permissions import refuse_commands, refuse_zones
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    LossCheckOpen,
    MovesHome,
    NotInControl,
    OutsideOwnFence,
    TooManyOperations,
    ViewTaken,
    WouldFall,
    ZoneForbids,
)
from server.operations.core.views import OperationView
from server.runtime.side_thread import TooMuchWork
from wire.plans import PlanKind
from wire.transactions import CommandWork

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/commands", tags=["commands"], responses=answers(UnknownDrone, ViewTaken)
)

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]


@router.post(
    "",
    responses=ACCEPTED
    | answers(
        *(
            DroneOffline,
            AgentTooOld,
            DroneBusy,
            NotInControl,
            Assisted,
            LoanForbids,
            ZoneForbids,
            LossCheckOpen,
            WouldFall,
            MovesHome,
        ),
        *(TooManyOperations, NotKnownHow, NotKnownYet, NoSuchMode, NoSuchItem, NoSuchLeader, CannotFollow),
        *(
            NotInTheAir,
            NotOnTheGround,
            PropellersNotConfirmed,
            NoSuchMotor,
            OutsideOwnFence,
            TooMuchWork,
            StateNotRestored,
        ),
    ),
)
async def command_drone(
    response: Response,
    principal: Pilot,
    hub: HubDep,
    side: SideThreadDep,
    address: AddressDep,
    drone_id: DronePath,
    body: Annotated[FlightCommand, Body()],
    prefer: Prefer = None,
) -> OperationView:
    """Commands the drone. A command of several steps stops at the first that is not accepted."""
    zones: list[ZoneHit] = []
    if isinstance(body, Start | Jump):
        zones = await zones_of_plan(hub, principal, drone_id, side, PlanKind.MISSION)
    drone = await flown_drone(hub, principal, drone_id)
    if not drone.online:
        raise DroneOffline(drone.record.name)
    require_set_up(drone, principal, body)
    following, now = None, time.monotonic()
    if isinstance(body, FollowMe):
        order, following = follow_me_order(hub, principal, drone, body, now)
    elif isinstance(body, Follow):
        order, following = follow_order(hub, principal, drone, body, now)
    elif isinstance(body, LandAt):
        order = land_at_order(drone, body, now)
    else:
        order = order_of(body, Vehicle.of(drone, now))
    sent = [step.work for step in order.steps if step.skip is None or not step.skip()]
    works = [work for work in sent if isinstance(work, CommandWork)]
    refuse_commands(drone, principal, works, falls=isinstance(body, Disarm) and body.force)
    refuse_zones(drone, zones)
    if isinstance(body, SetHome) and drone.airborne is not False and not body.while_flying:
        raise MovesHome(drone.record.name, known=drone.airborne is True)
    operation = begin(hub, principal, drone, order, address)
    if following is not None:
        hub.follows.began(operation, following)
    if following is not None or isinstance(body, LandAt):
        prefer = ASYNC  # it runs until something ends it, or until the drone has arrived
    return await answer(operation, response, prefer)
