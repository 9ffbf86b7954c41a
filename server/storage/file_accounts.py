"""The account that each drone's files count for, by what the hub knows. Computed in the tower's loop, used in
threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from server.live.hub import Hub
from server.storage.file_budget import NOBODY, Account

FileAccounts = Callable[[], Mapping[int, Account]]
"""The account of each drone, by drone id."""


def file_accounts(hub: Hub) -> dict[int, Account]:
    """A drone of several owners counts for the owner with the oldest account."""
    drones = hub.state.drones.values()
    return {drone.drone_id: min((owner.id for owner in drone.record.owners), default=NOBODY) for drone in drones}
