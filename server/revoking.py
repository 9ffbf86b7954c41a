"""Takes the controls from somebody who has lost the right to them: disabled, deleted, demoted, no longer an owner.

Comes after the change is committed and the live picture knows it, so that they cannot take the controls again.
"""

from __future__ import annotations

from contextlib import suppress
from time import monotonic

from server.access import UnknownDrone
from server.accounts.sessions import Principal
from server.control.desk import ControlRefused
from server.control.lease import Event
from server.tower import Tower
from wire.ids import DroneId


async def revoke_controls_of(
    tower: Tower, user_id: int, *, by: Principal, reason: str, address: str, drone_id: int | None = None
) -> None:
    """Of one drone, or of every drone that the user holds. `by` is the admin whose change it was."""
    for drone in tower.hub.drone_views(by.user_id, by.role):
        if drone.holder is None or drone.holder.id != user_id or drone_id not in {None, drone.id}:
            continue
        # Refused or gone: somebody else ended it at the same moment, which is as good.
        with suppress(ControlRefused, UnknownDrone):
            await tower.desk.change(
                by, DroneId(drone.id), Event.REVOKE, reason=reason, address=address, now=monotonic()
            )
