"""What the tower takes from this capability."""

from typing import Final

from server.http.part import Part
from server.maps.api import admin_routes, elevation_routes, routes, tile_routes

PART: Final = Part(
    routers=(routes.router, admin_routes.router, elevation_routes.router, tile_routes.router),
    tags={"map": "The tiles of the map."},
)
