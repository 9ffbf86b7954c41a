"""The relay of one running tower: hub, UDP socket and heartbeat, opened and closed with the application."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Final

from server.anonymous.core.budget import AnonymousBudget
from server.link.api.data_endpoint import DataEndpoint, open_data_endpoint
from server.link.core.close_drones import close_addresses
from server.live.hub import Hub
from server.runtime.aligned_timers import rest
from server.runtime.garbage import FullSearch

TICK_S: Final = 0.1
TICKS_A_SECOND: Final = 10


@asynccontextmanager
async def running_relay(
    hub: Hub, anonymous: AnonymousBudget, *, host: str, port: int, may_act: Callable[[], bool]
) -> AsyncIterator[DataEndpoint]:
    """Opens the data channel's socket and runs the hub's periodic work. `may_act`: called before anything is sent to an
    agent. Raises OSError if the port is in use."""
    endpoint = await open_data_endpoint(hub, host, port, anonymous)
    endpoint.may_act = may_act
    hub.video.fan_out.later = _soon
    beating = asyncio.create_task(_beat(hub, endpoint))
    try:
        yield endpoint
    finally:
        beating.cancel()
        await asyncio.gather(beating, return_exceptions=True)
        endpoint.close()


def _soon(call: Callable[[float], None]) -> None:
    asyncio.get_running_loop().call_soon(lambda: call(time.monotonic()))


async def _beat(hub: Hub, endpoint: DataEndpoint) -> None:
    ticks = 0
    search = FullSearch(time.monotonic())
    while True:
        due_at = await rest(TICK_S)
        now = time.monotonic()
        hub.state.traffic.loop_late.observe(max(0.0, now - due_at))
        hub.tick(now)
        while hub.state.publish_waiting():  # noqa: ASYNC110
            await asyncio.sleep(0)
        endpoint.follow(close_addresses(hub.state))
        ticks += 1
        if ticks % TICKS_A_SECOND == 0:
            try:
                hub.each_second(time.monotonic())
            except Exception as error:
                hub.state.on_fault("noise", None, error)
            search.check(now, flown_by_hand=hub.state.anybody_flies_by_hand(now))
