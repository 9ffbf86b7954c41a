"""Writes into the audit trail who had what done at which drone, and how it ended. Nobody waits for it."""

import asyncio
from collections import deque
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, Final

import structlog
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from server.domain.clock import Clock
from server.live.operations.operation import Operation
from server.store.audit.trail import Actor, record
from server.store.database import Database

MAX_WAITING: Final = 5000
"""While the database is out of reach. The oldest stay: they say what began."""
AT_ONCE: Final = 200
TRY_AGAIN_AFTER_S: Final = 1.0
CAUGHT_UP_WITHIN_S: Final = 5.0
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class _Note:
    at: datetime
    actor: Actor
    action: str
    address: str
    drone_id: int
    detail: dict[str, Any]


class OperationAuditWriter:
    """One for a tower: `began` and `ended` are told by the service, `work` runs beside."""

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock
        self._waiting: deque[_Note] = deque()
        self._something = asyncio.Event()

    def began(self, operation: Operation) -> None:
        """Noted before the drone can have done any of it."""
        if operation.order.writes or operation.order.noted:
            self._note(operation, "operation.began", dict(operation.order.about))

    def ended(self, operation: Operation) -> None:
        """Noted with the words that people were told."""
        if operation.order.writes or operation.order.noted:
            told = {"state": operation.state.value, "words": operation.words, "code": operation.code}
            self._note(operation, "operation.ended", told)

    async def work(self) -> None:
        """Until cancelled; then what waits is written, if the database lets it."""
        try:
            while True:
                await self._something.wait()
                self._something.clear()
                await self._write_all()
        finally:
            if self._waiting:
                await asyncio.wait_for(asyncio.shield(self._write_once()), CAUGHT_UP_WITHIN_S)

    def _note(self, operation: Operation, action: str, detail: dict[str, Any]) -> None:
        by = operation.by
        if by is None:
            return
        if len(self._waiting) >= MAX_WAITING:
            _log.error("operation_not_recorded", drone_id=operation.drone_id, what=action)
            return
        order = operation.order
        about = {"operation": str(operation.id), "work": order.work, "kind": order.kind, "hash": order.hash, **detail}
        named = {name: value for name, value in about.items() if value not in (None, "")}
        note = _Note(self._clock(), Actor(by.id, by.name), action, operation.address, operation.drone_id, named)
        self._waiting.append(note)
        self._something.set()

    async def _write_all(self) -> None:
        while self._waiting:
            try:
                await self._write_once()
            except IntegrityError:  # whoever it was has been deleted meanwhile; their name stays
                self._waiting = deque(replace(one, actor=Actor(None, one.actor.name)) for one in self._waiting)
            except (SQLAlchemyError, OSError) as error:
                _log.error("operation_not_recorded_yet", error=type(error).__name__)
                await asyncio.sleep(TRY_AGAIN_AFTER_S)

    async def _write_once(self) -> None:
        notes = list(self._waiting)[:AT_ONCE]
        async with self._database.writing() as session:
            for one in notes:
                record(
                    session,
                    at=one.at,
                    actor=one.actor,
                    action=one.action,
                    address=one.address,
                    drone_id=one.drone_id,
                    detail=one.detail,
                )
        for _ in notes:
            self._waiting.popleft()
