"""`/api/v1/drones/{id}/controller`: a controller on board flies the drone, for as long as its holder lets it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Annotated, Final

import msgspec
from fastapi import APIRouter, Path, Response
from pydantic import BaseModel, ConfigDict, Field

from server.http.access import Pilot, Viewer
from server.http.dependencies import AddressDep, HubDep
from server.http.problem_docs import answers
from server.kernel.access import UnknownDrone
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.api.operation_requests import (
    ACCEPTED,
    ASYNC,
    answer,
    begin,
    flown_drone,
    watched_drone,
)
from server.operations.core.controller_forms import BadControllerSetting
from server.operations.core.findings import FindingView
from server.operations.core.flying.vehicle import NotKnownHow, NotKnownYet, Vehicle
from server.operations.core.operation import Lane, Operation, Order, Step
from server.operations.core.permissions import refuse_commands, refuse_others
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    LossCheckOpen,
    NotInControl,
    TooManyOperations,
    UnknownOperation,
    ViewTaken,
)
from server.operations.core.views import OperationView
from wire import controllers as wire
from wire.autopilots.common import arming
from wire.controller_settings import ControllerSetting, SettingKind

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/controller", tags=["commands"], responses=answers(UnknownDrone, ViewTaken)
)

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
NOT_A_BORROWERS: Final = "with limits, which no controller on board knows"


class ControllerStart(BaseModel):
    """What to start, and the limits that the agent keeps it within."""

    model_config = ConfigDict(extra="forbid")

    controller: Annotated[str, Field(pattern=wire.NAME_PATTERN, description="`scripted`, or one on the drone")]
    max_speed_m_s: Annotated[float, Field(ge=wire.MIN_SPEED_M_S, le=wire.MAX_SPEED_M_S)] = 5.0
    min_height_m: Annotated[
        float, Field(ge=wire.MIN_HEIGHT_M, le=wire.MAX_HEIGHT_M, description="Above home; a landing goes lower")
    ] = 2.0
    max_height_m: Annotated[float, Field(ge=wire.MIN_HEIGHT_M, le=wire.MAX_HEIGHT_M, description="Above home")] = 30.0
    max_distance_m: Annotated[
        float, Field(ge=wire.MIN_DISTANCE_M, le=wire.MAX_DISTANCE_M, description="Over ground, from where it begins")
    ] = 100.0
    may_take_off: Annotated[bool, Field(description="Whether it may arm the motors and take off")] = False
    for_s: Annotated[float, Field(ge=wire.MIN_FOR_S, le=wire.MAX_FOR_S, description="Then the drone holds")] = 300.0
    settings: Annotated[
        dict[Annotated[str, Field(pattern=wire.SETTING_PATTERN)], Annotated[str, Field(max_length=400)] | float],
        Field(max_length=wire.MAX_SETTINGS, description="The controller's own, as `GET .../choices` describes them"),
    ] = {}


class ControllerSettingView(BaseModel):
    """One setting of a controller, as a form shows it."""

    model_config = ConfigDict(frozen=True)

    name: Annotated[str, Field(description="In `settings` of the request that starts it")]
    kind: Annotated[
        SettingKind,
        Field(description="`choice` and `camera`: one of `choices`; `text`: any text, and `choices` are examples"),
    ]
    label: Annotated[str, Field(description="Its name for people")]
    about: Annotated[str, Field(description="What it means, or empty")]
    default: str | float
    unit: Annotated[str, Field(description="Of a number; empty: it has none")]
    least: float | None
    most: float | None
    choices: list[str]
    characters: Annotated[str, Field(description="Those that a text may have; empty: any")]
    most_characters: int
    is_rare: Annotated[bool, Field(description="Most people leave it as it is")]


class ControllerView(BaseModel):
    """One controller on board."""

    model_config = ConfigDict(frozen=True)

    name: str
    settings: Annotated[
        list[ControllerSettingView] | None, Field(description="In the order of a form; null: it did not describe them")
    ]

    @classmethod
    def of(cls, name: str, settings: Sequence[ControllerSetting] | None) -> ControllerView:
        """The view of what its agent told."""
        views = None if settings is None else [ControllerSettingView(**msgspec.to_builtins(one)) for one in settings]
        return cls(name=name, settings=views)


class ControllerChoices(BaseModel):
    """What a person can choose from."""

    model_config = ConfigDict(frozen=True)

    offered: Annotated[bool, Field(description="Whether the agent, as it is connected now, runs controllers")]
    names: Annotated[list[str], Field(description="Those that it told of; an older agent tells none")]
    controllers: Annotated[list[ControllerView], Field(description="The same, with the settings of each")]
    running: OperationView | None


@router.post(
    "",
    status_code=202,
    responses=ACCEPTED
    | answers(
        *(DroneOffline, AgentTooOld, DroneBusy, NotInControl, Assisted, LoanForbids, LossCheckOpen),
        *(TooManyOperations, NotKnownHow, NotKnownYet, BadControllerSetting),
    ),
)
async def start_controller(
    response: Response, principal: Pilot, hub: HubDep, address: AddressDep, drone_id: DronePath, body: ControllerStart
) -> OperationView:
    """Starts a controller on board. The operation runs until something ends it: the controller, its time, a person, a
    hold. Then the drone holds, or has landed."""
    drone = await flown_drone(hub, principal, drone_id)
    if not drone.online:
        raise DroneOffline(drone.record.name)
    if drone.limits_of(principal.user_id, principal.role) is not None:
        raise LoanForbids(drone.record.name, NOT_A_BORROWERS)
    if hub.operations.running_at(drone.drone_id, Lane.CONTROLLER):
        raise DroneBusy(f"a controller on board flies {drone.record.name}: stop it first")
    vehicle = Vehicle.of(drone, time.monotonic())
    if vehicle.profile.roles.setpoints is None:
        raise NotKnownHow(f"{vehicle.name} flies {vehicle.profile.label}, which no controller on board can fly")
    drone.onboard.controllers.check(body.controller, body.settings)
    if body.may_take_off:
        refuse_commands(drone, principal, [arming().work])
    limits = body.model_dump(exclude={"controller", "for_s"})
    order = Order(
        "controller",
        Lane.CONTROLLER,
        [Step(wire.ControllerWork(body.controller, **limits), body.for_s)],
        writes=True,
        overrules=True,
        needs=wire.CONTROLLERS,
        about=body.model_dump(),
    )
    return await answer(begin(hub, principal, drone, order, address), response, ASYNC)


@router.get("", responses=answers(UnknownOperation))
async def get_controller(principal: Viewer, hub: HubDep, drone_id: DronePath) -> OperationView:
    """Returns the operation of the controller that runs; 404 `unknown-operation` without one. Its `phase` has the
    measured rates of set-points and directions."""
    return OperationView.of(_running(hub, watched_drone(hub, principal, drone_id)))


@router.get("/choices")
async def get_choices(principal: Viewer, hub: HubDep, drone_id: DronePath) -> ControllerChoices:
    """Returns which controllers the drone's agent has, and the one that runs."""
    drone = watched_drone(hub, principal, drone_id)
    takes = drone.link.takes if drone.link is not None else frozenset[str]()
    names = wire.offered(takes)
    running = hub.operations.running_at(drone.drone_id, Lane.CONTROLLER)
    return ControllerChoices(
        offered=wire.CONTROLLERS in takes,
        names=names,
        controllers=[ControllerView.of(name, drone.onboard.controllers.of(name)) for name in names],
        running=OperationView.of(running[0]) if running else None,
    )


@router.get("/findings")
async def get_findings(principal: Viewer, hub: HubDep, drone_id: DronePath) -> list[FindingView]:
    """Returns what controllers on board have found since the tower started, newest first, at most 20."""
    return watched_drone(hub, principal, drone_id).onboard.findings.newest


@router.delete("", status_code=202, responses=answers(UnknownOperation, NotInControl))
async def stop_controller(principal: Pilot, hub: HubDep, drone_id: DronePath) -> OperationView:
    """Stops the controller that runs: by its requester, the holder, or an admin. The drone holds, and the end of the
    operation is reported later."""
    drone = watched_drone(hub, principal, drone_id)
    operation = _running(hub, drone)
    theirs = operation.by is not None and operation.by.id == principal.user_id
    if not theirs and not drone.may(principal.user_id, principal.role, Right.CANCEL):
        refuse_others(drone, principal, time.monotonic())
    hub.operations.cancel(operation)
    return OperationView.of(operation)


def _running(hub: Hub, drone: LiveDrone) -> Operation:
    running = hub.operations.running_at(drone.drone_id, Lane.CONTROLLER)
    if not running:
        raise UnknownOperation
    return running[0]
