"""Deliveries that the tower has given up: who did not hear of which alert, and why. For admins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from sqlalchemy import Select, func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.alerts.store.channels.tables import AlertChannelRow, AlertDeliveryRow
from server.storage.database import DatabaseSession

MAX_LISTED: Final = 200
GivenUp = tuple[AlertDeliveryRow, AlertChannelRow, UserRow]


def _given_up(*what: Any) -> Select[Any]:
    return select(*what).where(AlertDeliveryRow.ended_at.is_not(None), AlertDeliveryRow.problem != "")


async def list_given_up(session: DatabaseSession, *, before: int | None, limit: int) -> Sequence[GivenUp]:
    """Newest first, each with its channel and user. `before`: the id of a delivery, only those that follow it in the
    list. They are kept for KEPT_FOR (`outbox.py`)."""
    query = (
        _given_up(AlertDeliveryRow, AlertChannelRow, UserRow)
        .join(AlertChannelRow, AlertChannelRow.id == AlertDeliveryRow.channel_id)
        .join(UserRow, UserRow.id == AlertChannelRow.user_id)
        .order_by(AlertDeliveryRow.id.desc())
        .limit(min(limit, MAX_LISTED))
    )
    if before is not None:
        query = query.where(AlertDeliveryRow.id < before)
    return [(delivery, channel, user) for delivery, channel, user in (await session.execute(query)).all()]


async def count_given_up(session: AsyncSession | DatabaseSession) -> int:
    """How many are in the list."""
    return await session.scalar(_given_up(func.count(AlertDeliveryRow.id))) or 0
