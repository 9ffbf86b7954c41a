"""Writes the audit trail: who did what, in the same transaction as the deed. Never put a secret into `detail`."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.tables import AuditEventRow


@dataclass(frozen=True)
class Actor:
    """Who did it. `user_id` is None for somebody who is not signed in, and for the command line."""

    user_id: int | None
    name: str
    address: str = ""


COMMAND_LINE: Final = Actor(None, "tower command")
TOWER: Final = Actor(None, "tower")
"""For what the tower does by itself."""


def record(
    session: AsyncSession,
    *,
    at: datetime,
    actor: Actor,
    action: str,
    drone_id: int | None = None,
    **detail: Any,
) -> None:
    """Actions are named `noun.verb` in the past tense, like `user.created`."""
    session.add(
        AuditEventRow(
            at=at,
            actor_id=actor.user_id,
            actor_name=actor.name[:64],
            action=action,
            drone_id=drone_id,
            detail=detail,
            address=actor.address[:64],
        )
    )
