"""Towers: this one, several that share drones, the bus between them."""

from typing import Final

from server.http.part import Part
from server.towers.api import share_routes, system_routes, tower_routes

PART: Final = Part(
    routers=(system_routes.router, share_routes.router, tower_routes.router),
    tags={"system": "How the tower itself is, for admins."},
)
