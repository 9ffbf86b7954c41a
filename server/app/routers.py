"""Every route of the tower."""

from functools import cache
from typing import Final

from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from starlette.routing import BaseRoute

from server.accounts.api import (
    passkey_routes,
    preference_routes,
    proof_routes,
    second_factor_routes,
    session_routes,
    token_routes,
    user_routes,
)
from server.airspace import api as zone_routes
from server.alerts.api import channel_routes as alert_channel_routes
from server.alerts.api import delivery_routes as alert_delivery_routes
from server.alerts.api import push_routes as alert_push_routes
from server.alerts.api import routes as alert_routes
from server.audit import api as audit_routes
from server.control.api import receiver_routes, safety_routes, settings_routes, signing_routes
from server.control.api import routes as control_routes
from server.fleet.api import enrolment_routes, loan_routes, restraint_routes
from server.fleet.api import routes as fleet_routes
from server.fleet.api import update_routes as agent_update_routes
from server.flights.api import display_video_routes, link_places_routes, statistics_routes
from server.flights.api import import_routes as flight_import_routes
from server.flights.api import routes as flight_routes
from server.http import health
from server.identification import api as identification_routes
from server.link.api import routes as relay_routes
from server.logs import api as log_routes
from server.maps.api import admin_routes as map_admin_routes
from server.maps.api import elevation_routes, tile_routes
from server.maps.api import routes as map_routes
from server.monitoring.api import routes as metrics_routes
from server.operations.api import controller_routes
from server.operations.api import flying_routes as command_routes
from server.operations.api import routes as operation_routes
from server.parameters import api as parameter_routes
from server.plans.api import library_routes, plan_routes
from server.readiness.api import maintenance_routes
from server.readiness.api import routes as preflight_routes
from server.teams import api as team_routes
from server.towers.api import share_routes, system_routes, tower_routes
from server.video.api import recording_routes
from server.video.api import routes as video_routes

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
