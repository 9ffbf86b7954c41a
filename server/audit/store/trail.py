"""Writes the audit trail: who did what, in the same transaction as the action. Never put a secret into `detail`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, Protocol

from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.tables import AuditEventRow
from server.runtime.request_id import current_request_id


class NamedUser(Protocol):
    """Any object with a user's id and name: an `Actor`, or the `Principal` of a request."""

    @property
    def user_id(self) -> int | None: ...

    @property
    def name(self) -> str: ...


@dataclass(frozen=True)
class Actor:
    """Who did it. `user_id` is None for a client that is not signed in, and for the command line."""

    user_id: int | None
    name: str


COMMAND_LINE: Final = Actor(None, "tower command")
TOWER: Final = Actor(None, "tower")
"""For actions of the tower itself."""


def record(
    session: AsyncSession,
    *,
    at: datetime,
    actor: NamedUser,
    action: str,
    address: str = "",
    drone_id: int | None = None,
    detail: Mapping[str, Any] | None = None,
    request_id: str | None = None,
) -> None:
    """Actions are named `noun.verb` in the past tense, like `user.created`. `request_id`: None for that of the running
    task."""
    session.add(
        AuditEventRow(
            at=at,
            actor_id=actor.user_id,
            actor_name=actor.name[:64],
            action=action,
            drone_id=drone_id,
            detail=dict(detail or {}),
            address=address[:64],
            request_id=(current_request_id() if request_id is None else request_id)[:64],
        )
    )
