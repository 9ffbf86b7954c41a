"""Every route of the tower."""

from functools import cache
from typing import Final

from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from starlette.routing import BaseRoute

from server.api.accounts import (
    passkey_routes,
    preference_routes,
    proof_routes,
    second_factor_routes,
    session_routes,
    token_routes,
    user_routes,
)
from server.api.agent_updates import routes as agent_update_routes
from server.api.alerts import channel_routes as alert_channel_routes
from server.api.alerts import delivery_routes as alert_delivery_routes
from server.api.alerts import push_routes as alert_push_routes
from server.api.alerts import routes as alert_routes
from server.api.audit import routes as audit_routes
from server.api.control import receiver_routes, safety_routes, settings_routes, signing_routes
from server.api.control import routes as control_routes
from server.api.controllers import routes as controller_routes
from server.api.fleet import enrolment_routes, loan_routes, restraint_routes
from server.api.fleet import routes as fleet_routes
from server.api.flight_commands import routes as command_routes
from server.api.flight_logs import routes as log_routes
from server.api.flights import (
    display_video_routes,
    identification_routes,
    link_places_routes,
    statistics_routes,
)
from server.api.flights import import_routes as flight_import_routes
from server.api.flights import routes as flight_routes
from server.api.http import health
from server.api.maintenance import routes as maintenance_routes
from server.api.metrics import routes as metrics_routes
from server.api.missions import library_routes, plan_routes
from server.api.operations import routes as operation_routes
from server.api.parameters import routes as parameter_routes
from server.api.preflight import routes as preflight_routes
from server.api.recordings import routes as recording_routes
from server.api.relay import routes as relay_routes
from server.api.system import routes as system_routes
from server.api.system import share_routes, tower_routes
from server.api.teams import routes as team_routes
from server.api.tiles import admin_routes as map_admin_routes
from server.api.tiles import elevation_routes, tile_routes
from server.api.tiles import routes as map_routes
from server.api.video import routes as video_routes
from server.api.zones import routes as zone_routes

ROUTERS: Final[tuple[APIRouter, ...]] = (
    session_routes.router,
    proof_routes.router,
    preference_routes.router,
    second_factor_routes.router,
    passkey_routes.router,
    fleet_routes.router,
    enrolment_routes.router,
    loan_routes.router,
    restraint_routes.router,
    agent_update_routes.router,
    team_routes.router,
    control_routes.router,
    settings_routes.router,
    safety_routes.router,
    receiver_routes.router,
    signing_routes.router,
    preflight_routes.router,
    plan_routes.router,
    parameter_routes.router,
    command_routes.router,
    controller_routes.router,
    library_routes.router,
    log_routes.router,
    operation_routes.router,
    alert_routes.router,
    alert_channel_routes.router,
    alert_push_routes.router,
    alert_delivery_routes.router,
    recording_routes.router,
    flight_routes.router,
    flight_import_routes.router,
    identification_routes.router,
    display_video_routes.router,
    statistics_routes.router,
    link_places_routes.router,
    maintenance_routes.router,
    relay_routes.router,
    video_routes.router,
    map_routes.router,
    map_admin_routes.router,
    elevation_routes.router,
    tile_routes.router,
    zone_routes.router,
    token_routes.router,
    user_routes.router,
    audit_routes.router,
    system_routes.router,
    share_routes.router,
    tower_routes.router,
    health.router,
    metrics_routes.router,
)


@cache
def included_routes() -> tuple[BaseRoute, ...]:
    """Returns the routes of all routers as an application holds them.

    Their models take a third of a second, at the first match. One process makes them once, for however many towers: a
    route belongs to none of them, and finds its own by the request (`Parts`).
    """
    including = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, generate_unique_id_function=_operation_id)
    for router in ROUTERS:
        including.include_router(router)
    return tuple(including.routes)


def _operation_id(route: APIRoute) -> str:
    return route.name
