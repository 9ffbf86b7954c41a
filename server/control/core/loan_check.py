"""Whether the limits of a loan let a frame of this sender pass, at this moment. Pure."""

from server.control.core.loan_requests import bar_of, words_of
from server.control.core.policy import CommandSeen, Permission, permission_for
from server.kernel.people import Principal
from server.live.live_drone import LiveDrone
from wire.autopilots import registry


def barred_by_loan(drone: LiveDrone, viewer: Principal, frame: bytes, command: CommandSeen | None) -> str | None:
    """The end of a sentence that begins with whose drone is lent; None: it may pass, or the sender is no borrower."""
    limits = drone.limits_of(viewer.user_id, viewer.role)
    if limits is None or permission_for(frame, command) is Permission.WATCHER:
        return None
    autopilot = drone.loss_parameters.autopilot if drone.loss_parameters is not None else ""
    family = registry.family_named(autopilot)
    bar = bar_of(frame, command, limits, drone.home, armed=drone.armed, family=family)
    return None if bar is None else words_of(bar, limits)
