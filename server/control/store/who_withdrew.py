"""Who revoked a right of another user, read from the audit trail, because the notification names that user."""

from datetime import datetime, timedelta
from typing import Final

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.tables import AuditEventRow
from server.kernel.people import UserRef
from server.live.hub_events import NOT_OF_ITS_TEAM, RightLost
from wire.ids import UserId

RECENTLY_S: Final = 10.0
"""An action of another process is noticed within a second or two; an older one is unrelated."""

_ACTIONS: Final = (
    "drone.owner_removed",
    "drone.loan_ended",
    "team.member_removed",
    "team.role_changed",
    "team.drone_removed",
    "user.disabled",
    "user.role_changed",
    "user.password_changed",
    "user.deleted",
)
_OF_ALL: Final = "team.drone_removed"
_MAX_ROWS: Final = 50


async def who_withdrew(session: AsyncSession, event: RightLost, now: datetime) -> UserRef | None:
    """Returns the user whose action ended this right; None if it was no user, or is not known."""
    recent = (
        select(AuditEventRow)
        .where(AuditEventRow.action.in_(_ACTIONS), AuditEventRow.at >= now - timedelta(seconds=RECENTLY_S))
        .order_by(AuditEventRow.id.desc())
        .limit(_MAX_ROWS)
    )
    for row in await session.scalars(recent):
        if row.drone_id not in (None, event.drone_id):
            continue
        # A drone that leaves its team leaves all of its members.
        of_all = row.action == _OF_ALL and event.reason == NOT_OF_ITS_TEAM
        if not of_all and row.detail.get("user_id") != event.user_id:
            continue
        # A user who changes their own password is signed out by it; nobody else caused it.
        if row.actor_id is None or row.actor_id == event.user_id:
            return None
        return UserRef(UserId(row.actor_id), row.actor_name)
    return None
