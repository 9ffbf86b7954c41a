"""Drones whose frames leave at once: those that are held or in focus. Pure."""

from typing import Final

from server.link.core.agent_routes import OVER_CHANNEL, Address
from server.live.live_state import LiveState

MAX_CLOSE: Final = 256
"""Drones. Each costs a file descriptor and a wake-up for each of its datagrams; beyond that, batching is right."""


def close_addresses(state: LiveState) -> frozenset[Address]:
    """The UDP addresses that datagrams of these drones come from, those in focus first, of MAX_CLOSE drones."""
    close = {browser.outbox.focus for browser in state.browsers.values()}
    drones = [state.drones[drone_id] for drone_id in close if drone_id in state.drones]
    drones += [one for one in state.drones.values() if one.lease.holder is not None and one.drone_id not in close]
    found: set[Address] = set()
    for drone in drones[:MAX_CLOSE]:
        if drone.link is not None:
            found.update(drone.link.routes.targets)
    found.discard(OVER_CHANNEL)
    return frozenset(found)
