"""Whose account the files of a drone count for, by what the hub knows. Read in the tower's loop, passed to threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from server.live.hub import Hub
from server.store.file_budget import NOBODY, Account

FileAccounts = Callable[[], Mapping[int, Account]]
"""Of all drones, by id."""


def file_accounts(hub: Hub) -> dict[int, Account]:
    """A drone of several owners is put down to the one whose account is the oldest."""
    drones = hub.state.drones.values()
    return {drone.drone_id: min((owner.id for owner in drone.record.owners), default=NOBODY) for drone in drones}
