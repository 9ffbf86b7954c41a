"""`/api/v1/drones/{id}/control/...`: REST access to the control service."""

import asyncio
import json
import time
from collections.abc import AsyncIterator
from contextlib import ExitStack
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Body, Depends, Path, Request
from pydantic import BaseModel, Field

from server.control.core.lease import Event, Refused
from server.control.store.service import ControlRefused, ControlService
from server.control.store.stay_service import StayService
from server.control.store.undecided import DECIDED_WITHIN_S
from server.fleet.core.views import DroneView
from server.http.access import Commander, Pilot
from server.http.dependencies import AddressDep, AuthenticatorDep, ClockDep, ControlDep, HubDep, provided
from server.http.problem_docs import answers
from server.kernel.access import AccessRequest, Action, UnknownDrone, judge
from server.kernel.people import Principal
from wire.ids import DroneId

StayServiceDep = Annotated[StayService, provided(StayService)]
router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/control", tags=["control"], responses=answers(UnknownDrone, ControlRefused)
)

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]


class ControlRequest(BaseModel):
    """The reason. Everybody concerned sees it, and the audit trail stores it."""

    reason: Annotated[str, Field(max_length=256)] = ""


class TakeRequest(ControlRequest):
    """The reason, and whether the operator who is shut out may keep watching: everything (`watch`), and the video
    (`video`).

    `interrupt`: an emergency. The hold also interrupts a return or a landing, which otherwise continues.
    """

    interrupt: bool = False
    watch: bool = True
    video: Annotated[
        Literal["keep", "move"],
        Field(description="`move`: they cannot watch the video until the controls are offered back"),
    ] = "keep"


class AcceptRequest(ControlRequest):
    """ "I have control": `sticks_centred` must be true."""

    sticks_centred: bool = False


async def _take_by(
    request: Request, authenticator: AuthenticatorDep, control: ControlDep, clock: ClockDep, drone_id: DronePath
) -> AsyncIterator[Principal]:
    """Yields the principal who takes control. If the database does not decide at once whether they may, and their
    sign-in is remembered, the drone holds first."""
    admitting = asyncio.ensure_future(authenticator.admit(request, Action.COMMAND))
    try:
        with ExitStack() as until_decided:
            done, _ = await asyncio.wait({admitting}, timeout=DECIDED_WITHIN_S)
            remembered = None if done else authenticator.remembered(request)
            if remembered is not None:
                may = judge(AccessRequest(remembered, Action.COMMAND, now=clock()))
                if may.refusal is None:
                    interrupts = _interrupts(await request.body())
                    until_decided.enter_context(control.shut_out(remembered, DroneId(drone_id), interrupts=interrupts))
            yield await admitting
    finally:
        admitting.cancel()


_take_by.action = Action.COMMAND  # type: ignore[attr-defined]  # for the test that walks all routes
Taker = Annotated[Principal, Depends(_take_by)]
_NOT_THE_HOLDER: Final = Refused("not-the-holder", "you do not have the controls")
Reason = Annotated[ControlRequest | None, Body()]


def _interrupts(body: bytes) -> bool:
    """Whether this is an emergency TAKE. A body that is none is refused later."""
    try:
        asked = json.loads(body)
    except ValueError:
        return False
    return isinstance(asked, dict) and asked.get("interrupt") is True


async def _change(
    control: ControlService,
    principal: Principal,
    drone_id: int,
    event: Event,
    body: ControlRequest | None,
    address: str,
) -> DroneView:
    return await control.change(
        principal,
        DroneId(drone_id),
        event,
        reason=body.reason.strip() if body else "",
        address=address,
        now=time.monotonic(),
        watch=body.watch if isinstance(body, TakeRequest) else True,
        moves_video=isinstance(body, TakeRequest) and body.video == "move",
        interrupts=isinstance(body, TakeRequest) and body.interrupt,
        sticks_centred=isinstance(body, AcceptRequest) and body.sticks_centred,
    )


@router.post("/acquire", operation_id="acquire_control")
async def acquire(
    principal: Pilot, control: ControlDep, address: AddressDep, drone_id: DronePath, body: Reason = None
) -> DroneView:
    """Takes control of a drone of yours that has no holder."""
    return await _change(control, principal, drone_id, Event.ACQUIRE, body, address)


@router.post("/keep-alive", operation_id="keep_control")
async def keep_alive(principal: Pilot, hub: HubDep, drone_id: DronePath) -> DroneView:
    """Heartbeat of the holder's program, valid for 5 s; needed only without a live channel. Send one every 2 s. Returns
    409 `not-the-holder` when the controls are gone."""
    drone = hub.squads.drone(DroneId(drone_id), principal.user_id, principal.role)
    if drone is None:
        raise UnknownDrone
    if drone.holder_id != principal.user_id:
        raise ControlRefused(_NOT_THE_HOLDER)
    hub.safety.keep(drone, principal.user_id, time.monotonic())
    return drone.view_for(principal.user_id, principal.role)


@router.post("/release", operation_id="release_control")
async def release(
    principal: Pilot, control: ControlDep, address: AddressDep, drone_id: DronePath, body: Reason = None
) -> DroneView:
    """Releases the controls. A drone that is flown by hand holds."""
    return await _change(control, principal, drone_id, Event.RELEASE, body, address)


@router.post("/take", operation_id="take_control")
async def take(
    principal: Taker,
    control: ControlDep,
    address: AddressDep,
    drone_id: DronePath,
    body: Annotated[TakeRequest | None, Body()] = None,
) -> DroneView:
    """Admin: takes control, or withdraws an offer. The drone holds, but a return or a landing continues unless
    `interrupt` is true. The operator is shut out until the controls are given back. If `watch` is false, the operator
    does not see the drone either; if `video` is `move`, the operator gets no video."""
    return await _change(control, principal, drone_id, Event.TAKE, body, address)


@router.post("/give", operation_id="give_control")
async def give(
    principal: Commander, control: ControlDep, address: AddressDep, drone_id: DronePath, body: Reason = None
) -> DroneView:
    """Admin: offers the controls back to the operator they were taken from. The drone holds until they are accepted."""
    return await _change(control, principal, drone_id, Event.GIVE, body, address)


@router.post("/accept", operation_id="accept_control")
async def accept(
    principal: Pilot,
    control: ControlDep,
    address: AddressDep,
    drone_id: DronePath,
    body: Annotated[AcceptRequest | None, Body()] = None,
) -> DroneView:
    """The operator accepts the controls ("I have control"), with centred sticks."""
    return await _change(control, principal, drone_id, Event.ACCEPT, body, address)


@router.post("/stay", operation_id="stay_in_hold")
async def stay(
    principal: Pilot, stay_service: StayServiceDep, address: AddressDep, drone_id: DronePath, body: Reason = None
) -> DroneView:
    """Holder, owner, borrower or admin: keeps the drone where it is. What it would do by itself because a person is
    away is postponed until the battery is needed for the way home. 409 `nothing-to-stay` if no countdown is running."""
    reason = body.reason.strip() if body else ""
    return await stay_service.stay(principal, DroneId(drone_id), reason=reason, address=address)


@router.post("/assist", operation_id="assist_control")
async def assist(
    principal: Commander, control: ControlDep, address: AddressDep, drone_id: DronePath, body: Reason = None
) -> DroneView:
    """Admin: assists the holder. Your commands take precedence while they arrive, and for one second after."""
    return await _change(control, principal, drone_id, Event.ASSIST, body, address)


@router.post("/unassist", operation_id="unassist_control")
async def unassist(
    principal: Commander, control: ControlDep, address: AddressDep, drone_id: DronePath, body: Reason = None
) -> DroneView:
    """Admin: ends the assistance, your own or another admin's."""
    return await _change(control, principal, drone_id, Event.ASSIST_END, body, address)
