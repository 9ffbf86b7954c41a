"""Plans on board of a drone, and the library of missions."""

from typing import Final

from server.http.part import Part
from server.plans.api import library_routes, plan_routes

PART: Final = Part(
    routers=(plan_routes.router, library_routes.router),
    tags={"plans": "Missions, fences and rally points on board of a drone.", "missions": "The library of missions."},
)
