"""Whether a user may have something done at a drone now, by the rules for frames (server.relay).

A request is turned into the frames that an ordinary ground station would send, and each is judged as if it had arrived
on the live channel: controls, forbidden messages, loss check, limits of a loan.
"""

from collections.abc import Iterable, Sequence
from typing import Any, Final

from server.airspace.core.zones.check import warn, zones_of_frame
from server.airspace.core.zones.requests import ZoneHit
from server.control.core.loan_check import barred_by_loan
from server.control.core.policy import command_in, ends_the_flight, refusal_of
from server.kernel.people import Principal
from server.live.live_drone import LiveDrone
from server.operations.core.own_fence import refuse_outside_fence
from server.operations.core.refusals import (
    LoanForbids,
    LossCheckOpen,
    NotInControl,
    NotThroughTheTower,
    ViewTaken,
    WouldFall,
    ZoneForbids,
)
from wire.dialect import build, mavlink
from wire.drops import DropReason
from wire.plans import PlanItem, PlanKind, item_message
from wire.transactions import CommandWork

_NAN: Final = float("nan")


def require_view(drone: LiveDrone, viewer: Principal) -> None:
    """Raises ViewTaken for whom no frames of the drone come either."""
    if viewer.user_id == drone.user_without_view:
        raise ViewTaken(drone.record.name)


def refuse_others(drone: LiveDrone, viewer: Principal, now: float) -> None:
    """Raises NotInControl for all but the holder and the assistant."""
    has_turn = drone.authorization_of(viewer).has_turn
    if not has_turn or drone.fenced or drone.ignores_holder(viewer.user_id, now):
        raise NotInControl(drone.record.name)


def refuse_frame(
    drone: LiveDrone, viewer: Principal, frame: bytes, *, item: int | None = None, falls: bool = False
) -> None:
    """Raises what the frame policy decides. `falls`: the sender knows that the drone will fall."""
    name, standing, command = drone.record.name, drone.authorization_of(viewer), command_in(frame)
    match refusal_of(frame, command, standing):
        case None:
            pass
        case DropReason.NOT_IN_CONTROL:
            raise NotInControl(name)
        case DropReason.LOSS_CHECK:
            raise LossCheckOpen(name)
        case _:
            raise NotThroughTheTower(name)
    barred = barred_by_loan(drone, viewer, frame, command)
    if barred is not None:
        raise LoanForbids(name, barred, item=item)
    if command is not None and ends_the_flight(command, standing) and not falls:
        raise WouldFall(name, known=standing.airborne is True)


def refuse_plan(
    drone: LiveDrone, viewer: Principal, kind: PlanKind, items: Sequence[PlanItem], zones: Sequence[ZoneHit]
) -> None:
    """Raises ZoneForbids about the first item on whose way one of `zones` is, and LoanForbids about the first one that
    leads beyond the limits of a loan."""
    refuse_zones(drone, zones)
    limits = drone.limits_of(viewer.user_id, viewer.role)
    if limits is None or not limits.any:
        return
    if not items:
        refuse_frame(drone, viewer, _frame(mavlink.MAVLink_mission_clear_all_message(1, 1, kind.mission_type)))
    for number, item in enumerate(items):
        message = item_message(item, seq=number, kind=kind, target_system=1, target_component=1)
        refuse_frame(drone, viewer, _frame(message), item=number)


def refuse_zones(drone: LiveDrone, hits: Sequence[ZoneHit]) -> None:
    """Raises ZoneForbids for the first zone that refuses. People are told of those that only warn."""
    for hit in hits:
        if hit.zone.binds:
            raise ZoneForbids(drone.record.name, hit.words, item=hit.item)
    warn(drone, hits)


def refuse_commands(drone: LiveDrone, viewer: Principal, works: Iterable[CommandWork], *, falls: bool = False) -> None:
    """Raises what the frame policy decides about the first refused frame, ZoneForbids and OutsideOwnFence."""
    for work in works:
        frame = _frame(message_of(work))
        refuse_frame(drone, viewer, frame, falls=falls)
        refuse_zones(drone, zones_of_frame(drone, frame, command_in(frame)))
        refuse_outside_fence(drone, frame, command_in(frame))


def message_of(work: CommandWork) -> Any:
    """The COMMAND_INT or COMMAND_LONG that it becomes beside the autopilot."""
    params = [_NAN if value is None else value for value in work.params]
    if work.x is None or work.y is None or work.frame is None:
        return mavlink.MAVLink_command_long_message(1, work.component, work.command, 0, *params)
    return mavlink.MAVLink_command_int_message(
        1, 1, work.frame, work.command, 0, 0, *params[:4], work.x, work.y, params[6]
    )


def _frame(message: Any) -> bytes:
    return build(message, system_id=255, component_id=190, sequence=0)
