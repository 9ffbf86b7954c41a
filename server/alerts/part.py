"""Alerts: the rules, their history, and delivery by mail, web push and webhook."""

from typing import Final

from server.alerts.api import channel_routes, delivery_routes, push_routes, routes
from server.http.part import Part

PART: Final = Part(
    routers=(routes.router, channel_routes.router, push_routes.router, delivery_routes.router),
    tags={"alerts": "What needs attention at a drone."},
)
