"""One assembled tower: the parts that routes use, the background work, and the application itself."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI

from server.alerts.core.announcer import Announcer
from server.audit.store.sealer import AuditSealer
from server.fleet.store.loans import LoanExpiry
from server.http.dependencies import Parts
from server.http.part import Common
from server.operations.store import OperationAuditWriter

if TYPE_CHECKING:
    from server.monitoring.api.tracing.tracing import Tracing
    from server.towers.api.several_towers import SeveralTowers


@dataclass(frozen=True, kw_only=True)
class Tower(Parts):
    loan_expiry: LoanExpiry
    audit_writer: OperationAuditWriter
    audit_sealer: AuditSealer
    announcer: Announcer
    common: Common
    several: SeveralTowers | None = None
    """None without a bus."""
    tracing: Tracing | None = None
    """None without a collector for traces."""
    before_shutdown: list[Callable[[], Awaitable[None]]] = field(default_factory=list)
    """Run in order while connections are still open, to send close messages."""

    def hold_flown_by_hand(self) -> None:
        """Called when the lock on the database may run out while another process waits for it."""
        reason = "the database does not answer, and another tower may take the place of this one"
        self.hub.holds.order_where_flown_by_hand(reason, time.monotonic())


class TowerApp(FastAPI):
    """The application of one tower. Only start-up and shutdown see it as a whole; routes do not (`Parts`)."""

    def __init__(self, tower: Tower, **options: Any) -> None:
        super().__init__(**options)
        self.tower = tower
