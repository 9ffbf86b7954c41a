"""What the tower takes from this capability."""

from typing import Final

from server.flights.api import display_video_routes, import_routes, link_places_routes, routes, statistics_routes
from server.http.part import Part

PART: Final = Part(
    routers=(
        routes.router,
        import_routes.router,
        display_video_routes.router,
        statistics_routes.router,
        link_places_routes.router,
    ),
    tags={"flights": "Flights that the tower recorded."},
)
