"""Whether a drone may fly: checklist before flight, maintenance."""

from typing import Final

from server.http.part import Part
from server.readiness.api import maintenance_routes, routes

PART: Final = Part(
    routers=(routes.router, maintenance_routes.router),
    tags={
        "preflight": "The checklist before a flight.",
        "maintenance": "What a drone needs after so many hours in the air.",
    },
)
