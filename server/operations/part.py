"""Operations: commands carried out at a drone, each with an answer and a row in the audit trail."""

from typing import Final

from server.http.part import Part
from server.operations.api import controller_routes, flying_routes, routes

PART: Final = Part(
    routers=(flying_routes.router, controller_routes.router, routes.router),
    tags={"commands": "What a drone is told to do.", "operations": "Work at drones that is going on."},
)
