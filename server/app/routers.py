"""Every route of the tower: those of the parts, and whether the tower is well."""

from functools import cache
from typing import Final

from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from starlette.routing import BaseRoute

from server.http import health
from server.http.part import Part
from server.runtime.capabilities import in_every_capability

PARTS: Final[tuple[Part, ...]] = tuple(module.PART for module in in_every_capability("part"))
ROUTERS: Final[tuple[APIRouter, ...]] = (*(router for part in PARTS for router in part.routers), health.router)
TAGS: Final = {
    **{name: about for part in PARTS for name, about in part.tags.items()},
    "health": "Whether the tower is well.",
}
"""The groups of routes in the OpenAPI document, in its order, and what each is about."""


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
