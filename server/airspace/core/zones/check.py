"""Whether zones let a frame, a plan or a place of a drone pass, at this moment. Pure."""

from collections.abc import Callable, Sequence

from server.airspace.core.zones.requests import LANDINGS, ZoneHit, hits_on_the_way, plan_hits, spots_of
from server.control.core.loan_limits import whole_place_in
from server.control.core.loan_requests import LoanBlock, target_in
from server.control.core.policy import CommandSeen, Permission, permission_for
from server.live import live_messages as live
from server.live.live_drone import LiveDrone
from wire.autopilots import registry
from wire.dialect import mavlink
from wire.frames import message_id, payload
from wire.plans import PlanItem, PlanKind
from wire.zones.track import Spot
from wire.zones.zone import Zone

_ITEM: int = mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT
_MISSION_TYPE_AT = 37

PlanJudge = Callable[[PlanKind, Sequence[PlanItem]], list[ZoneHit]]


def spot_of(drone: LiveDrone) -> Spot | None:
    """Where the drone is, as last heard."""
    place = whole_place_in(drone.position_frame) if drone.position_frame is not None else None
    return None if place is None else Spot(place.lat_deg, place.lon_deg, place.alt_rel_m, place.alt_amsl_m)


def zones_of_frame(drone: LiveDrone, frame: bytes, command: CommandSeen | None) -> list[ZoneHit]:
    """The zones that this frame would lead the drone into, the first one first."""
    if not drone.zones or permission_for(frame, command) is Permission.WATCHER:
        return []
    if command is not None and command.command in LANDINGS:
        return []  # a zone never bars a landing
    if message_id(frame) == _ITEM and payload(frame)[_MISSION_TYPE_AT : _MISSION_TYPE_AT + 1] not in (b"", b"\0"):
        return []  # fences and rally points travel as missions do
    here = spot_of(drone)
    autopilot = drone.loss_parameters.autopilot if drone.loss_parameters is not None else ""
    target = target_in(frame, command, family=registry.family_named(autopilot))
    if here is None or target is None or isinstance(target, LoanBlock):
        return []
    found: dict[int, Zone] = {}
    for to in spots_of(target, drone.home, here):
        # An item of a mission is not flown to from here: only the place counts until the whole plan is known.
        start = to if message_id(frame) == _ITEM and not _is_guided(frame) else here
        found |= {zone.id: zone for zone in hits_on_the_way(drone.zones, start, to, target.circle_m)}
    return [ZoneHit(zone) for zone in found.values()]


def _is_guided(frame: bytes) -> bool:
    """ArduPilot's go-to of old: an item with `current` 2."""
    return payload(frame).ljust(38, b"\0")[35] == 2


def plan_judge(drone: LiveDrone) -> PlanJudge:
    """Says which zones a plan would lead the drone into from where it is now, at most one for each item. It knows
    all that it needs, and may be called in another thread: 700 items among 60 zones take a second."""
    here = spot_of(drone)
    start = here if drone.airborne is not False or drone.home is None else None
    zones, home = drone.zones, drone.home
    return lambda kind, items: plan_hits(zones, kind, items, home, start)


def zone_at(drone: LiveDrone, spot: Spot) -> ZoneHit | None:
    """The zone that refuses the drone to be at this place, or None."""
    return next((ZoneHit(one) for one in hits_on_the_way(drone.zones, spot, spot) if one.binds), None)


def warn(drone: LiveDrone, hits: Sequence[ZoneHit]) -> None:
    """Tells those who watch the drone about zones that only warn."""
    for hit in hits:
        if not hit.zone.binds:
            which = "" if hit.item is None else f"item {hit.item + 1}: "
            text = f"{which}the way of {drone.record.name} {hit.words}. This zone only warns."
            drone.notify_frame_watchers(live.Notice("warning", "zone", text[0].upper() + text[1:], drone.drone_id, 1))
