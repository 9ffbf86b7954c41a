"""Recorded flights: recorder, replay, statistics, imports, display videos."""

from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager
from typing import Final

from server.flights.api import display_video_routes, import_routes, link_places_routes, routes, statistics_routes
from server.flights.store.imports.service import FlightImports, new_flight_imports
from server.flights.store.videos.service import FlightVideos
from server.http.part import Common, Part, Services


def _services(common: Common) -> Iterable[object]:
    settings = common.settings
    imports = new_flight_imports(settings, common.clock, common.hub.state.shares)
    return imports, FlightVideos(settings.files / "flight-videos")


@asynccontextmanager
async def _running(common: Common, services: Services) -> AsyncIterator[None]:
    await services.of(FlightImports).sweep(common.database)
    videos = services.of(FlightVideos)
    await videos.sweep()
    try:
        yield
    finally:
        await videos.close()


PART: Final = Part(
    routers=(
        routes.router,
        import_routes.router,
        display_video_routes.router,
        statistics_routes.router,
        link_places_routes.router,
    ),
    tags={"flights": "Flights that the tower recorded."},
    services=_services,
    running=_running,
)
