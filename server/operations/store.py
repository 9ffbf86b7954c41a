"""Writes into the audit trail who had what done with which drone, and how it ended. No request waits for it.

A pilot's command is one row, `command.given`, with its result, whether it came as an operation or as a frame that
passed through the hub. Longer work (plans, parameters, following) has one row at its beginning and one at its end.
"""

import asyncio
from collections import deque
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, Final

import structlog
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from server.audit.store.trail import Actor, record
from server.kernel.clock import Clock
from server.operations.core.observed_commands import CommandObserved
from server.operations.core.operation import Lane, Operation, State
from server.storage.database import Database

MAX_WAITING: Final = 5000
"""While the database is unreachable. The oldest stay, because they record the beginning."""
AT_ONCE: Final = 200
TRY_AGAIN_AFTER_S: Final = 1.0
CAUGHT_UP_WITHIN_S: Final = 5.0
COMMAND: Final = "command.given"
_RESULTS: Final = {State.DONE: "accepted", State.TIMED_OUT: "no answer"}
"""Results of operations, in the words used for an autopilot's acknowledgement."""
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class _Note:
    at: datetime
    actor: Actor
    action: str
    address: str
    drone_id: int
    detail: dict[str, Any]
    request_id: str = ""


class OperationAuditWriter:
    """One instance per tower: the service calls `began` and `ended`, `work` runs in the background."""

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock
        self._waiting: deque[_Note] = deque()
        self._something = asyncio.Event()
        self._running: dict[int, Operation] = {}
        """Commands that have not ended."""

    def began(self, operation: Operation) -> None:
        """Recorded before the drone can have executed any of it; a command is recorded when it ends."""
        _log.info("operation_began", **_traced(operation), what=dict(operation.order.about))
        if _is_command(operation):
            self._running[operation.id] = operation
        elif operation.order.writes or operation.order.audited:
            self._note(operation, "operation.began", dict(operation.order.about))

    def ended(self, operation: Operation) -> None:
        """Recorded with the text that users received."""
        outcome = {"state": operation.state.value, "words": operation.words, "code": operation.code}
        _log.info("operation_ended", **_traced(operation), **outcome)
        if _is_command(operation):
            # An operation that was given up may end again when its agent is back: it already has its row.
            if self._running.pop(operation.id, None) is not None:
                self._note_command(operation, _RESULTS.get(operation.state, operation.state.value))
        elif operation.order.writes or operation.order.audited:
            self._note(operation, "operation.ended", outcome)

    def observed(self, command: CommandObserved) -> None:
        """Records a command that was sent as frames, with its acknowledgement."""
        detail: dict[str, Any] = {"command": command.command, "result": command.result, "way": "frames"}
        detail |= {"count": command.count} if command.count > 1 else {}
        actor = Actor(command.by.id, command.by.name)
        note = _Note(command.at, actor, COMMAND, command.address, command.drone_id, detail | command.detail)
        self._put(note)

    def tower_ends(self) -> None:
        """Records running commands too."""
        for operation in list(self._running.values()):
            self._note_command(operation, "not known: the tower was stopped")
        self._running.clear()

    async def work(self) -> None:
        """Runs until cancelled; then writes what is queued, if the database allows."""
        try:
            while True:
                await self._something.wait()
                self._something.clear()
                await self._write_all()
        except asyncio.CancelledError:
            self.tower_ends()
            raise
        finally:
            await self._write_last()

    async def _write_last(self) -> None:
        if not self._waiting:
            return
        try:
            async with asyncio.timeout(CAUGHT_UP_WITHIN_S):
                await asyncio.shield(self._write_once())
        except (SQLAlchemyError, OSError) as error:  # TimeoutError is an OSError
            _log.error("operations_not_recorded", count=len(self._waiting), error=type(error).__name__)

    def _note(self, operation: Operation, action: str, detail: dict[str, Any]) -> None:
        by = operation.by
        if by is None:
            return
        order = operation.order
        about = {"operation": str(operation.id), "work": order.work, "kind": order.kind, "hash": order.hash, **detail}
        named = {name: value for name, value in about.items() if value not in (None, "")}
        note = _Note(
            self._clock(),
            Actor(by.id, by.name),
            action,
            operation.address,
            operation.drone_id,
            named,
            operation.request_id,
        )
        self._put(note)

    def _note_command(self, operation: Operation, result: str) -> None:
        if operation.by is None:
            return
        outcome = {"result": result, "way": "operation", "operation": str(operation.id)}
        said = {"words": operation.words, "code": operation.code}
        detail = operation.order.about | outcome | {name: value for name, value in said.items() if value}
        actor = Actor(operation.by.id, operation.by.name)
        note = (operation.began_at, actor, COMMAND, operation.address, operation.drone_id, detail)
        self._put(_Note(*note, operation.request_id))

    def _put(self, note: _Note) -> None:
        if len(self._waiting) >= MAX_WAITING:
            _log.error("operation_not_recorded", drone_id=note.drone_id, what=note.action)
            return
        self._waiting.append(note)
        self._something.set()

    async def _write_all(self) -> None:
        while self._waiting:
            try:
                await self._write_once()
            except IntegrityError:  # the user was deleted meanwhile; the name stays
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
                    request_id=one.request_id,
                )
        for _ in notes:
            self._waiting.popleft()


def _traced(operation: Operation) -> dict[str, Any]:
    """What finds its log lines, in the tower and in the agent."""
    return {
        "operation": str(operation.id),
        "request_id": operation.request_id,
        "drone_id": operation.drone_id,
        "work": operation.order.work,
        "by": operation.by.name if operation.by else None,
    }


def _is_command(operation: Operation) -> bool:
    return operation.order.lane is Lane.COMMANDS
