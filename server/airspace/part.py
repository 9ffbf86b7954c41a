"""The air around drones: zones, aircraft nearby, separation."""

from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager
from typing import Final

from server.airspace.api import router
from server.airspace.store.follow import ZoneFollower
from server.http.part import Common, Part, Services
from server.runtime.background import in_background


def _services(common: Common) -> Iterable[object]:
    return (ZoneFollower(common.database, common.hub.zones, common.side_thread),)


@asynccontextmanager
async def _running(_common: Common, services: Services) -> AsyncIterator[None]:
    follower = services.of(ZoneFollower)
    await follower.refresh()
    async with in_background("zones", follower.follow):
        yield


PART: Final = Part(
    routers=(router,),
    tags={"zones": "Where drones may not be, not above a height, or only."},
    services=_services,
    running=_running,
)
