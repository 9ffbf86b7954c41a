"""A TAKE that the database has not decided: the drone holds, and no commands pass until the decision.

It is never carried out late. When the database accepts writes again, the trail records the failure, the lease is what
the database contains, and its holder continues.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.control.core.lease import Refused
from server.control.store.lease_store import Ask, Committed, LeaseStore
from server.kernel.people import UserRef
from server.live.hub import Hub
from server.live.live_drone import LeaseView
from server.storage.database import DatabaseUnavailable, LockLost
from wire.ids import DroneId

DECIDED_WITHIN_S: Final = 0.1
"""After this time the drone holds without the database. An ordinary commit takes a few milliseconds."""
TRY_AGAIN_AFTER_S: Final = 0.5
MAX_UNSETTLED: Final = 32
"""Takes of one drone that each get a row in the trail. Later ones are not recorded."""

_log = structlog.get_logger(__name__)


class ControlUndecided(DatabaseUnavailable):
    """The database did not decide a TAKE. The message tells the state until it does."""

    def __init__(self) -> None:
        super().__init__(
            "the controls did not change hands, because the database does not answer. The drone was told to hold, and "
            "nobody's commands pass until the database answers: take control again then"
        )


@dataclass
class _Unsettled:
    """The undecided takes of one drone."""

    by: UserRef | None
    clock_offset_s: float
    """Offset from the event loop's time to `now`."""
    asks: list[Ask] = field(default_factory=list)
    committing: set[asyncio.Task[Committed | Refused]] = field(default_factory=set)
    reason: str = ""
    task: asyncio.Task[None] | None = None


class UndecidedTakes:
    """One instance per control service. `fence` and `unfence`: count the reasons for a drone's fence."""

    def __init__(
        self, store: LeaseStore, hub: Hub, *, fence: Callable[[DroneId], None], unfence: Callable[[DroneId], None]
    ) -> None:
        self._store = store
        self._hub = hub
        self._fence = fence
        self._unfence = unfence
        self._open: dict[DroneId, _Unsettled] = {}

    def hold(self, drone_id: DroneId, name: str, *, interrupts: bool) -> None:
        """Orders a hold at once, whatever the state of the database, and notifies all who may see the drone."""
        reason = f"{name} takes control, and the database has not confirmed it yet"
        self._hub.holds.order(drone_id, reason, interrupts=interrupts)
        words = f"{reason}: nobody's commands pass until it has."
        self._hub.changes.notify_undecided(drone_id, "warning", words)

    def wait_for_decision(
        self, ask: Ask, by: UserRef | None, now: float, committing: asyncio.Task[Committed | Refused]
    ) -> None:
        """Keeps the fence until the database responds. `committing` is cancelled, but may have succeeded all the
        same."""
        committing.cancel()
        drone_id = ask.drone_id
        unsettled = self._open.get(drone_id)
        if unsettled is None:
            self._fence(drone_id)
            unsettled = self._open[drone_id] = _Unsettled(by, now - asyncio.get_running_loop().time())
            unsettled.task = asyncio.create_task(self._settle(drone_id, unsettled))
        unsettled.committing.add(committing)
        if len(unsettled.asks) < MAX_UNSETTLED:
            unsettled.asks.append(ask)

    async def _settle(self, drone_id: DroneId, unsettled: _Unsettled) -> None:
        lease: LeaseView | None = None
        try:
            while unsettled.asks or unsettled.committing:
                if unsettled.committing:
                    # The lease can be read only when nothing can change it any more.
                    await asyncio.wait(unsettled.committing)
                    unsettled.committing = {one for one in unsettled.committing if not one.done()}
                    continue
                try:
                    lease = await self._store.settle(unsettled.asks[0])
                    unsettled.reason = unsettled.asks.pop(0).reason
                except LockLost:
                    return
                except (SQLAlchemyError, OSError):
                    await asyncio.sleep(TRY_AGAIN_AFTER_S)
            now = unsettled.clock_offset_s + asyncio.get_running_loop().time()
            drone = self._hub.state.drones.get(drone_id)
            if lease is not None and drone is not None and lease.epoch > drone.lease.epoch:
                by, reason = unsettled.by, unsettled.reason
                self._hub.apply_lease(drone_id, lease, event="taken", by=by, reason=reason, now=now)
        finally:
            del self._open[drone_id]
            self._unfence(drone_id)
        holder = drone.lease.holder if drone is not None else None
        who = f"{holder.name} has the controls" if holder else "nobody has the controls"
        self._hub.changes.notify_undecided(drone_id, "info", f"The database answers again: {who}.")
        _log.warning("take_settled", drone_id=drone_id, epoch=lease.epoch if lease else None)

    async def stop(self) -> None:
        """Open takes stay undecided: the next start reads the leases."""
        tasks = [one.task for one in self._open.values() if one.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
