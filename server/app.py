"""Puts the tower together: the only place that knows every capability. Nothing is opened before the lifespan begins."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from importlib.metadata import version
from typing import Final

from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute

from server import health
from server.accounts import preference_routes, second_factor_routes, session_routes, token_routes, user_routes
from server.accounts.passwords import Passwords
from server.accounts.sealed_factors import prepare_vault
from server.accounts.sessions import Sessions
from server.accounts.sign_in import Door
from server.accounts.throttle import SignInThrottle
from server.accounts.tokens import ApiTokens
from server.audit import routes as audit_routes
from server.background import in_background
from server.body import BodyCheck
from server.clock import Clock, utc_now
from server.console import serve_console
from server.control import routes as control_routes
from server.control import safety_routes, settings_routes
from server.control.after_start import end_assistance
from server.control.desk import ControlDesk
from server.control.lease_store import DatabaseLeaseStore
from server.control.loss_checks import LossChecks
from server.control.rehearsal import Rehearsals
from server.control.settings_store import load_into
from server.control.watchman import Watchman
from server.database import open_database
from server.fleet import enrolment_routes, loan_routes
from server.fleet import routes as fleet_routes
from server.fleet.drones import deleted_among
from server.fleet.enrolment_news import EnrolmentNews
from server.fleet.loans import LoanKeeper
from server.fleet.roster import Roster
from server.flight_commands import routes as command_routes
from server.flight_logs import routes as log_routes
from server.flight_logs.receiving import LogReceiver
from server.flight_logs.shelf import LogShelf
from server.guards import SecurityHeaders, UnexpectedErrors
from server.listening import CannotListen
from server.metrics import routes as metrics_routes
from server.missions import library_routes, plan_routes
from server.operations import routes as operation_routes
from server.operations.clerk import OperationClerk
from server.origin import OriginCheck
from server.parameters import routes as parameter_routes
from server.problem_docs import describe_problems
from server.problems import handle_problems
from server.recordings import routes as recording_routes
from server.recordings.recordings import new_recordings
from server.recordings.source import HubVideo
from server.relay import routes as relay_routes
from server.relay.flood_gate import FloodLimits
from server.relay.hub import Hub
from server.relay.running import running_relay
from server.relay.socket_bounds import SocketBounds
from server.schema import check_schema
from server.separation.bounds import SeparationBounds
from server.settings import Settings
from server.system import routes as system_routes
from server.system.loop_lag import LoopLag
from server.tile_source import TileAddresses
from server.tiles import routes as tile_routes
from server.tower import Tower
from server.vault import Vault
from server.video import routes as video_routes

ROUTERS: Final[tuple[APIRouter, ...]] = (
    session_routes.router,
    preference_routes.router,
    second_factor_routes.router,
    fleet_routes.router,
    enrolment_routes.router,
    loan_routes.router,
    control_routes.router,
    settings_routes.router,
    safety_routes.router,
    plan_routes.router,
    parameter_routes.router,
    command_routes.router,
    library_routes.router,
    log_routes.router,
    operation_routes.router,
    recording_routes.router,
    relay_routes.router,
    video_routes.router,
    tile_routes.router,
    token_routes.router,
    user_routes.router,
    audit_routes.router,
    system_routes.router,
    health.router,
    metrics_routes.router,
)
_TAGS: Final = (
    {"name": "session", "description": "Signing in and out."},
    {"name": "tokens", "description": "API tokens: how a program signs in for a user."},
    {"name": "drones", "description": "The squad, and its administration."},
    {"name": "enrolment", "description": "How the agent of a drone comes by its credential."},
    {"name": "control", "description": "Who has the controls of a drone."},
    {"name": "plans", "description": "Missions, fences and rally points on board of a drone."},
    {"name": "parameters", "description": "The parameters of a drone's autopilot."},
    {"name": "commands", "description": "What a drone is told to do."},
    {"name": "logs", "description": "Flight logs, on board and fetched."},
    {"name": "video", "description": "How it is with the video of a drone."},
    {"name": "recordings", "description": "Recorded video."},
    {"name": "missions", "description": "The library of missions."},
    {"name": "operations", "description": "Work at drones that is going on."},
    {"name": "map", "description": "The tiles of the map."},
    {"name": "users", "description": "Users administration, for admins."},
    {"name": "audit", "description": "Who did what, for admins."},
    {"name": "metrics", "description": "What the tower counts, for Prometheus."},
    {"name": "system", "description": "How the tower itself is, for admins."},
    {"name": "health", "description": "Whether the tower is well."},
)


def create_app(settings: Settings, *, clock: Clock = utc_now) -> FastAPI:
    tower = _compose(settings, clock)
    app = FastAPI(
        title="Control Tower",
        version=version("control-tower"),
        description="Fly and watch drones through the internet. Live data is on the WebSocket `/api/v1/live`.",
        openapi_tags=[dict(one) for one in _TAGS],
        lifespan=_lifespan,
        docs_url=None,  # the usual pages load scripts from elsewhere
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
        redirect_slashes=False,
        generate_unique_id_function=_operation_id,
    )
    app.state.tower = tower
    app.state.metrics_registry = metrics_routes.new_registry(tower)
    handle_problems(app)
    describe_problems(app, [route for router in ROUTERS for route in router.routes])
    for router in ROUTERS:
        app.include_router(router)
    serve_console(app, settings.web)
    # The last one added is the outermost.
    app.add_middleware(BodyCheck)
    app.add_middleware(OriginCheck, settings=settings)
    app.add_middleware(UnexpectedErrors)
    tiles_from = settings.tiles.origin if isinstance(settings.tiles, TileAddresses) else None
    app.add_middleware(SecurityHeaders, api_prefix="/api/", tiles_from=tiles_from)
    return app


def _compose(settings: Settings, clock: Clock) -> Tower:
    database = open_database(settings.database_url)
    vault = Vault.of(settings)
    passwords = Passwords(
        concurrency=settings.argon2_concurrency,
        memory_kib=settings.argon2_memory_kib,
        rounds=settings.argon2_rounds,
    )
    sessions = Sessions(database, idle_s=settings.session_idle_s, lifetime_s=settings.session_lifetime_s)
    hub = Hub(
        FloodLimits(
            user_per_s=settings.user_frames_per_s,
            user_burst=settings.user_frames_burst,
            drone_per_s=settings.drone_frames_per_s,
            drone_burst=settings.drone_frames_burst,
            agent_per_s=settings.agent_frames_per_s,
            agent_burst=settings.agent_frames_burst,
        ),
        SocketBounds(per_user=settings.user_sockets, per_address=settings.address_sockets),
        clock,
        SeparationBounds(
            horizontal_m=settings.separation_horizontal_m,
            vertical_m=settings.separation_vertical_m,
            ahead_s=settings.separation_ahead_s,
        ),
        SocketBounds(per_user=settings.user_video_sockets, per_address=settings.address_video_sockets),
    )
    loss_checks = LossChecks(hub=hub, database=database, clock=clock)
    rehearsals = Rehearsals(hub=hub, database=database, clock=clock)
    roster = Roster(database, hub, clock)
    enrolment_news = EnrolmentNews(database, hub, clock)
    desk = ControlDesk(DatabaseLeaseStore(database, clock), hub, on_changed=loss_checks.look_again)
    mb = 1_000_000
    log_shelf = LogShelf(
        settings.files,
        budget_bytes=settings.files_budget_mb * mb,
        largest_bytes=settings.file_largest_mb * mb,
    )
    clerk = OperationClerk(database, clock)
    hub.operations.on_began, hub.operations.on_ended = clerk.began, clerk.ended
    return Tower(
        settings=settings,
        clock=clock,
        database=database,
        vault=vault,
        passwords=passwords,
        sessions=sessions,
        tokens=ApiTokens(database),
        door=Door(database, passwords, sessions, SignInThrottle(), vault),
        hub=hub,
        desk=desk,
        roster=roster,
        loan_keeper=LoanKeeper(database, hub, roster, clock),
        loss_checks=loss_checks,
        rehearsals=rehearsals,
        watchman=Watchman(
            desk=desk,
            hub=hub,
            database=database,
            clock=clock,
            loss_checks=loss_checks,
            rehearsals=rehearsals,
            agent_linked=enrolment_news.agent_linked,
        ),
        enrolment_news=enrolment_news,
        clerk=clerk,
        log_shelf=log_shelf,
        log_receiver=LogReceiver(log_shelf),
        recordings=new_recordings(settings, hub=hub, video=HubVideo(hub), database=database, clock=clock),
        loop_lag=LoopLag(),
        started_at=clock(),
    )


async def _deleted_with_files(tower: Tower) -> frozenset[int]:
    """Drones that were deleted, and of which there still are files."""
    there = await asyncio.to_thread(lambda: tower.log_shelf.drone_ids() | tower.recordings.store.drone_ids())
    async with tower.database.reading() as session:
        return await deleted_among(session, there - frozenset(tower.hub.drone_ids()))


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    tower: Tower = app.state.tower
    settings = tower.settings
    async with AsyncExitStack() as stack:
        stack.push_async_callback(tower.database.close)
        await check_schema(tower.database)
        await prepare_vault(tower.vault, tower.database)
        await tower.passwords.warm_up()
        await end_assistance(tower.database, tower.clock)
        tower.hub.on_event = tower.watchman.noticed
        stack.push_async_callback(tower.watchman.stop)
        stack.push_async_callback(tower.rehearsals.stop)
        stack.push_async_callback(tower.enrolment_news.stop)
        await tower.loss_checks.load()
        await tower.roster.refresh()
        await load_into(tower.hub, tower.database)
        deleted = await _deleted_with_files(tower)
        await asyncio.to_thread(tower.log_shelf.sweep, deleted)
        await stack.enter_async_context(tower.recordings.working(deleted))
        for drone_id in tower.hub.drone_ids():
            tower.loss_checks.look_again(drone_id)
        await stack.enter_async_context(in_background("roster", tower.roster.follow))
        await stack.enter_async_context(in_background("loans", tower.loan_keeper.watch))
        await stack.enter_async_context(in_background("operations trail", tower.clerk.work))
        await stack.enter_async_context(in_background("loop lag", tower.loop_lag.watch))
        # Last: from here on agents are answered.
        try:
            relay = running_relay(tower.hub, host=settings.udp_host, port=settings.udp_port)
            app.state.data_endpoint = await stack.enter_async_context(relay)
        except OSError as error:
            raise CannotListen("TOWER_UDP_PORT", settings.udp_host, settings.udp_port, error) from error
        tower.before_shutdown.append(_good_bye(tower))
        yield


def _good_bye(tower: Tower) -> Callable[[], Awaitable[None]]:
    async def say_good_bye() -> None:
        tower.hub.say_good_bye()

    return say_good_bye


def _operation_id(route: APIRoute) -> str:
    return route.name
