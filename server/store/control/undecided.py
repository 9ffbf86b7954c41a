"""A TAKE that the database does not decide: the drone holds, and nobody's commands pass until it is decided.

It is never carried out late. When the database takes writes again, the trail has that it failed, the lease is what the
database says, and whoever has the controls by that lease goes on.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.domain.people import UserRef
from server.live.hub import Hub
from server.store.control.lease_store import Ask, LeaseStore
from server.store.database import DatabaseUnavailable, LockLost
from wire.ids import DroneId

DECIDED_WITHIN_S: Final = 0.1
"""After this the drone holds without the database. An ordinary commit takes a few milliseconds."""
TRY_AGAIN_AFTER_S: Final = 0.5

_log = structlog.get_logger(__name__)


class ControlUndecided(DatabaseUnavailable):
    """The database did not decide a TAKE. The message says what holds until it does."""

    def __init__(self) -> None:
        super().__init__(
            "the controls did not change hands, because the database does not answer. The drone was told to hold, and "
            "nobody's commands pass until the database answers: take the controls again then"
        )


class UndecidedTakes:
    """One for the control service. `fence` and `unfence`: count the reasons for a drone's fence."""

    def __init__(
        self, store: LeaseStore, hub: Hub, *, fence: Callable[[DroneId], None], unfence: Callable[[DroneId], None]
    ) -> None:
        self._store = store
        self._hub = hub
        self._fence = fence
        self._unfence = unfence
        self._open: dict[DroneId, asyncio.Task[None]] = {}

    def hold(self, drone_id: DroneId, name: str, *, interrupts: bool) -> None:
        """At once, whatever the database does. Everybody who may see the drone is told."""
        reason = f"{name} takes the controls, and the database has not decided it yet"
        self._hub.holds.order(drone_id, reason, interrupts=interrupts)
        words = f"{reason}: nobody's commands pass until it has."
        self._hub.changes.notify_undecided(drone_id, "warning", words)

    def wait_for_decision(self, ask: Ask, by: UserRef | None, now: float) -> None:
        """The fence stays until the database answers."""
        drone_id = ask.drone_id
        if drone_id not in self._open:
            self._fence(drone_id)
            self._open[drone_id] = asyncio.create_task(self._settle(ask, by, now))

    async def _settle(self, ask: Ask, by: UserRef | None, now: float) -> None:
        drone_id, began = ask.drone_id, asyncio.get_running_loop().time()
        try:
            while True:
                try:
                    lease = await self._store.settle(ask)
                    break
                except LockLost:
                    return
                except (SQLAlchemyError, OSError):
                    await asyncio.sleep(TRY_AGAIN_AFTER_S)
            now += asyncio.get_running_loop().time() - began
            drone = self._hub.state.drones.get(drone_id)
            if drone is not None and lease.epoch > drone.lease.epoch:
                self._hub.apply_lease(drone_id, lease, event="taken", by=by, reason=ask.reason, now=now)
        finally:
            del self._open[drone_id]
            self._unfence(drone_id)
        drone = self._hub.state.drones.get(drone_id)
        holder = drone.lease.holder if drone is not None else None
        who = f"{holder.name} has the controls" if holder else "nobody has the controls"
        self._hub.changes.notify_undecided(drone_id, "info", f"The database answers again: {who}.")
        _log.warning("take_settled", drone_id=drone_id, epoch=lease.epoch)

    async def stop(self) -> None:
        """What is open stays undecided: the next start reads the leases."""
        tasks = list(self._open.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
