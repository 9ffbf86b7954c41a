"""The "stay" order: postpones what a drone would do by itself because a person is away, until its battery is needed for
the way home.

The agent is notified first; the audit trail is written afterwards, and not at all while the database is unreachable.
"""

from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.audit.store.trail import record
from server.control.core.lease import Refused
from server.control.store.service import ControlRefused
from server.fleet.core.views import DroneView
from server.kernel.access import UnknownDrone
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.storage.database import Database
from wire.ids import DroneId
from wire.open_holds import Lost, LostPhase

_SHUT_OUT: Final = Refused("taken-away", "an admin has taken control; wait until it is given back")
_ONLY_WATCHES: Final = Refused("not-an-owner", "you may watch this drone, and do nothing with it")
_OFFLINE: Final = Refused("offline", "the drone is offline")
_NOTHING: Final = Refused("nothing-to-stay", "there is no countdown that a person could stop")
_TOWER_LOST: Final = Refused("nothing-to-stay", "the drone has lost the tower, and nobody can stop that countdown")

_log = structlog.get_logger(__name__)


def refusal_of(drone: LiveDrone, principal: Principal) -> Refused | None:
    """Returns why this user, who may see the drone, may not make it stay now; None if they may."""
    lease = drone.lease
    if not drone.may(principal.user_id, principal.role, Right.FLY):
        return _ONLY_WATCHES
    if lease.taken_from is not None and lease.taken_from.id == principal.user_id and not lease.offered:
        return _SHUT_OUT
    if drone.link is None:
        return _OFFLINE
    state = drone.open_hold.reported
    if state is None or state.phase is not LostPhase.COUNTING:
        return _NOTHING
    return None if state.lost is Lost.PERSON else _TOWER_LOST


class StayService:
    """One instance per tower."""

    def __init__(self, *, hub: Hub, database: Database, clock: Clock) -> None:
        self._hub = hub
        self._database = database
        self._clock = clock

    async def stay(self, principal: Principal, drone_id: DroneId, *, reason: str, address: str) -> DroneView:
        """Returns the drone after the order; its agent reports the result later. Raises UnknownDrone,
        ControlRefused."""
        drone = self._hub.squads.drone(drone_id, principal.user_id, principal.role)
        if drone is None:
            raise UnknownDrone
        refused = refusal_of(drone, principal)
        detail = {"reason": reason, "epoch": drone.lease.epoch, "result": "refused" if refused else "done"}
        if refused is None:
            self._hub.holds.stay(drone_id, principal.name)
        else:
            detail["code"] = refused.code
        await self._record(principal, drone_id, detail, address)
        if refused is not None:
            raise ControlRefused(refused)
        return drone.view_for(principal.user_id, principal.role)

    async def _record(self, by: Principal, drone_id: DroneId, detail: dict[str, object], address: str) -> None:
        try:
            async with self._database.writing() as session:
                record(
                    session,
                    at=self._clock(),
                    actor=by,
                    action="control.stay",
                    drone_id=drone_id,
                    detail=detail,
                    address=address,
                )
        except (SQLAlchemyError, OSError) as error:
            _log.error("stay_not_recorded", drone_id=drone_id, error=type(error).__name__)
