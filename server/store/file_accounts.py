"""To whom the files of a drone are put down, by what the hub knows. Asked in the tower's loop, told to threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from server.live.hub import Hub
from server.store.file_budget import NOBODY, Account

FileAccounts = Callable[[], Mapping[int, Account]]
"""Of each drone there is, by its number."""


def file_accounts(hub: Hub) -> dict[int, Account]:
    """A drone of several owners is put down to the one whose account is the oldest."""
    drones = hub.state.drones.values()
    return {drone.drone_id: min((owner.id for owner in drone.record.owners), default=NOBODY) for drone in drones}
