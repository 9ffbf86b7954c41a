"""What the tower takes from this capability."""

from typing import Final

from server.control.api import receiver_routes, routes, safety_routes, settings_routes, signing_routes
from server.http.part import Part

PART: Final = Part(
    routers=(
        routes.router,
        settings_routes.router,
        safety_routes.router,
        receiver_routes.router,
        signing_routes.router,
    ),
    tags={"control": "Who has the controls of a drone."},
)
