"""Whether a command leads outside the fence that the autopilot keeps by itself. Pure.

An autopilot refuses such a command too, ArduPilot with a bare FAILED, PX4 after it has accepted it; so it is not sent.
"""

from server.airspace.core.zones.check import spot_of
from server.airspace.core.zones.requests import LANDINGS, spots_of
from server.control.core.loan_requests import LoanBlock, target_in
from server.control.core.policy import CommandSeen
from server.live.live_drone import LiveDrone
from server.operations.core.refusals import OutsideOwnFence
from wire.autopilots import registry
from wire.autopilots.own_fence import why_outside
from wire.dialect import mavlink
from wire.frames import payload
from wire.plans import PlanKind
from wire.zones.track import Spot

_STATUS = (int(mavlink.MAVLINK_MSG_ID_SYS_STATUS), 0)
_GEOFENCE = int(mavlink.MAV_SYS_STATUS_GEOFENCE)


def refuse_outside_fence(drone: LiveDrone, frame: bytes, command: CommandSeen | None) -> None:
    """Raises OutsideOwnFence. Where parameters, home or fence are not known, the autopilot decides."""
    if command is None or command.command in LANDINGS:
        return
    family = registry.family_named(drone.loss_parameters.autopilot if drone.loss_parameters is not None else "")
    here = spot_of(drone)
    target = target_in(frame, command, family=family)
    if family is None or here is None or target is None or isinstance(target, LoanBlock):
        return
    fence = family.own_fence(drone.onboard.parameters.values(), _is_on(drone))
    if fence is None:
        return
    home = None if drone.home is None else Spot(drone.home.lat_deg, drone.home.lon_deg, 0.0, drone.home.alt_amsl_m)
    areas = drone.onboard.plan(PlanKind.FENCE)[1].items() or ()
    for spot in spots_of(target, drone.home, here):
        why = why_outside(fence, spot, home, areas, circle_m=target.circle_m)
        if why is not None:
            raise OutsideOwnFence(drone.record.name, why)


def _is_on(drone: LiveDrone) -> bool | None:
    """As SYS_STATUS shows it; None: not heard."""
    frame = drone.telemetry.newest.get(_STATUS)
    return None if frame is None else bool(int.from_bytes(payload(frame)[4:8], "little") & _GEOFENCE)
