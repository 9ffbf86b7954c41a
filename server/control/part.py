"""Who flies: leases, what a frame may do, holds, loss checks, safety settings."""

from collections.abc import Iterable
from typing import Final

from server.control.api import receiver_routes, routes, safety_routes, settings_routes, signing_routes
from server.control.store.stay_service import StayService
from server.http.part import Common, Part


def _services(common: Common) -> Iterable[object]:
    return (StayService(hub=common.hub, database=common.database, clock=common.clock),)


PART: Final = Part(
    routers=(
        routes.router,
        settings_routes.router,
        safety_routes.router,
        receiver_routes.router,
        signing_routes.router,
    ),
    tags={"control": "Who has the controls of a drone."},
    services=_services,
)
