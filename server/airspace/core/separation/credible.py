"""Whether others may be alarmed about a drone: armed, with a live autopilot, plausible. Pure.

Nothing here can tell a real machine from a careful imitation, because the agent is the only source. It excludes drones
on the ground, things that are not vehicles, and things that do not move like one.
"""

from typing import Final

from server.live.live_drone import LiveDrone
from wire.dialect import mavlink
from wire.frames import payload

HEARD_WITHIN_S: Final = 5.0
"""Autopilots send a heartbeat each second, whatever the stream's profile."""
_TYPE, _AUTOPILOT, _BASE_MODE = 4, 5, 6
"""Where they stand in a HEARTBEAT."""


def is_credible(drone: LiveDrone | None, now: float) -> bool | None:
    """None: not heard recently, so not known."""
    if drone is None:
        return False
    if drone.armed is False or drone.motion_check.why is not None:
        return False
    if drone.heartbeat is None or drone.armed is None or now - drone.heartbeat_at > HEARD_WITHIN_S:
        return None
    return _is_armed_autopilot(drone.heartbeat) and drone.motion_check.is_known(now)


def _is_armed_autopilot(heartbeat: bytes) -> bool:
    fields = payload(heartbeat).ljust(_BASE_MODE + 1, b"\0")
    is_autopilot = fields[_AUTOPILOT] != mavlink.MAV_AUTOPILOT_INVALID and fields[_TYPE] != mavlink.MAV_TYPE_GCS
    return is_autopilot and bool(fields[_BASE_MODE] & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
