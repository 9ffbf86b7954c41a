"""Browsers that show alerts by web push: alert channels whose address and keys come from the browser. Contains the
rules; independent of HTTP.

A browser belongs to whoever subscribed in it last. Its subscription ends with the sign-out there, not when the session
expires: whoever waits for alerts is away from the console.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.alerts.core.severity import Severity
from server.alerts.io.push_encryption import BrowserKeys
from server.alerts.store.channels.channels import Drones, about, check_address, get_channel, shown_target
from server.alerts.store.channels.refusals import (
    MAX_BROWSERS,
    BadAlertChannel,
    TooManyBrowsers,
    UnknownAlertChannel,
)
from server.alerts.store.channels.tables import AlertChannelRow
from server.audit.store.action import AuditAction
from server.audit.store.trail import TOWER
from server.runtime.vault import Vault


@dataclass(frozen=True, slots=True)
class Subscription:
    """What a browser has from its push service, and what it is called."""

    endpoint: str
    keys: BrowserKeys
    browser: str


def read_subscription(endpoint: str, p256dh: str, auth: str, browser: str, *, may_be_private: bool) -> Subscription:
    """Raises BadAlertChannel."""
    check_address(endpoint, "of a push service", may_be_private=may_be_private)
    if not browser.isprintable():
        raise BadAlertChannel("the name of the browser has characters that cannot be shown")
    try:
        return Subscription(endpoint, BrowserKeys.read(p256dh, auth), browser)
    except ValueError:
        raise BadAlertChannel("these are no keys of a push subscription") from None


async def add_browser(
    session: AsyncSession,
    subscription: Subscription,
    *,
    user_id: int,
    session_id: int,
    severity: Severity,
    drones: Drones,
    vault: Vault,
    action: AuditAction,
) -> AlertChannelRow:
    """Replaces what the tower knew of this browser, of whichever user. In `Database.writing()`. Raises
    TooManyBrowsers."""
    await session.get(UserRow, user_id, with_for_update=True)  # browsers are counted one user at a time
    same = select(AlertChannelRow).where(
        AlertChannelRow.kind == "push", AlertChannelRow.target == subscription.endpoint
    )
    for known in await session.scalars(same):
        await session.delete(known)
    await session.flush()
    mine = AlertChannelRow.user_id == user_id, AlertChannelRow.kind == "push"
    if (await session.scalar(select(func.count()).select_from(AlertChannelRow).where(*mine)) or 0) >= MAX_BROWSERS:
        raise TooManyBrowsers
    row = AlertChannelRow(
        user_id=user_id,
        kind="push",
        target=subscription.endpoint,
        secret_sealed=vault.seal(subscription.keys.text, about=about(user_id)),
        severity=severity.value,
        drones=drones,
        code_hash=None,
        created_at=action.at,
        session_id=session_id,
        browser=subscription.browser,
    )
    session.add(row)
    await session.flush()
    action.record(session, "alert_channel.added", channel=row.id, kind=row.kind, target=shown_target(row))
    return row


async def keep_browser(session: AsyncSession, channel_id: int, *, user_id: int, session_id: int) -> AlertChannelRow:
    """The browser is here with a new session: the sign-out of that one ends it from now on. In `Database.writing()`.
    Raises UnknownAlertChannel."""
    row = await get_channel(session, channel_id, user_id)
    if row.kind != "push":
        raise UnknownAlertChannel
    row.session_id = session_id
    return row


async def end_browsers(
    session: AsyncSession, action: AuditAction, *, user_id: int | None = None, session_id: int | None = None
) -> None:
    """Of a user, or those that were here last with this session; call it before the session is deleted. In
    `Database.writing()`."""
    mine = AlertChannelRow.user_id == user_id if session_id is None else AlertChannelRow.session_id == session_id
    for row in await session.scalars(select(AlertChannelRow).where(AlertChannelRow.kind == "push", mine)):
        await _end(session, row, action, "its session has ended")


async def end_gone_browser(session: AsyncSession, channel_id: int, now: datetime) -> None:
    """Its push service says that the subscription has ended. In `Database.writing()`."""
    row = await session.get(AlertChannelRow, channel_id)
    if row is not None and row.kind == "push":
        await _end(session, row, AuditAction(by=TOWER, at=now), "ended by the browser")


async def _end(session: AsyncSession, row: AlertChannelRow, action: AuditAction, reason: str) -> None:
    target = shown_target(row)
    action.record(session, "alert_channel.deleted", channel=row.id, kind=row.kind, target=target, reason=reason)
    await session.delete(row)
