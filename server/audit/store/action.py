"""Who acts, from where and when: what accounts and fleet need for the audit trail, in one object."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.trail import NamedUser, record


@dataclass(frozen=True)
class AuditAction:
    by: NamedUser
    at: datetime
    address: str = ""

    def record(self, session: AsyncSession, action: str, *, drone_id: int | None = None, **detail: Any) -> None:
        record(
            session,
            at=self.at,
            actor=self.by,
            action=action,
            address=self.address,
            drone_id=drone_id,
            detail=detail,
        )
