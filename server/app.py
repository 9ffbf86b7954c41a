"""Puts the tower together: the only place that knows every capability. Nothing is opened before the lifespan begins."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from typing import Final

from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute

from server.accounts.passwords import Passwords
from server.accounts.sessions import Sessions
from server.accounts.throttle import SignInThrottle
from server.clock import Clock, utc_now
from server.database import open_database
from server.fleet.live_picture import LivePicture
from server.fleet.roster import Roster
from server.guards import SecurityHeaders, UnexpectedErrors
from server.origin import OriginCheck
from server.problems import handle_problems
from server.schema import check_schema
from server.settings import Settings
from server.tower import Tower

API: Final = "/api/v1"
LARGEST_BODY_BYTES: Final = 64 * 1024
"""No request of the API comes near; whatever does is a mistake or an attack."""


def create_app(settings: Settings, *, live_picture: LivePicture, clock: Clock = utc_now) -> FastAPI:
    tower = _compose(settings, live_picture, clock)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        async with AsyncExitStack() as stack:
            stack.push_async_callback(tower.database.close)
            await check_schema(tower.database)
            await tower.passwords.warm_up()
            await tower.roster.refresh()
            await stack.enter_async_context(_in_background(tower.roster.follow()))
            # The relay opens its UDP endpoint here, as the last thing: from then on agents are answered.
            yield

    app = FastAPI(
        title="Control Tower",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url=f"{API}/openapi.json",
        redirect_slashes=False,
        max_body_size=LARGEST_BODY_BYTES,
        generate_unique_id_function=_operation_id,
    )
    app.state.tower = tower
    handle_problems(app)
    for router in _routers():
        app.include_router(router, prefix=API)
    # The last one added is the outermost.
    app.add_middleware(OriginCheck, public_url=settings.public_url)
    app.add_middleware(UnexpectedErrors)
    app.add_middleware(SecurityHeaders, api_prefix="/api/")
    return app


def _routers() -> list[APIRouter]:
    """Every capability's routes. The relay (live, agent) and control hang theirs in here."""
    return []


def _compose(settings: Settings, live_picture: LivePicture, clock: Clock) -> Tower:
    database = open_database(settings.database_url)
    return Tower(
        settings=settings,
        clock=clock,
        database=database,
        passwords=Passwords(
            concurrency=settings.argon2_concurrency,
            memory_kib=settings.argon2_memory_kib,
            rounds=settings.argon2_rounds,
        ),
        sessions=Sessions(database, idle_s=settings.session_idle_s, lifetime_s=settings.session_lifetime_s),
        throttle=SignInThrottle(),
        picture=live_picture,
        roster=Roster(database, live_picture),
    )


def _operation_id(route: APIRoute) -> str:
    return route.name


@asynccontextmanager
async def _in_background(work: object) -> AsyncIterator[None]:
    task = asyncio.ensure_future(work)  # type: ignore[call-overload]
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
