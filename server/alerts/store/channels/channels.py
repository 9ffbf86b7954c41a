"""Makes, changes and deletes the alert channels of a user. Contains the rules; independent of HTTP."""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal
from urllib.parse import urlsplit

from sqlalchemy import func, select, update
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.alerts.core.severity import Severity
from server.alerts.io.mail_source import MAIL_ADDRESS
from server.alerts.store.channels.refusals import (
    MAX_CHANNELS,
    BadAlertChannel,
    TooManyAlertChannels,
    UnknownAlertChannel,
)
from server.alerts.store.channels.tables import AlertChannelRow
from server.audit.store.action import AuditAction
from server.runtime.vault import Vault, VaultError
from server.storage.database import Database

MAX_CODE_TRIES: Final = 5
_LETTERS: Final = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ"
_CODE_LETTERS: Final = 8
Kind = Literal["mail", "webhook"]
"""Browsers have a way of their own (`browsers.py`)."""
Drones = Literal["all", "own"]


@dataclass(frozen=True, slots=True)
class ChannelWish:
    """What a user asks for. `target`: an e-mail address, or the address of a webhook."""

    kind: Kind
    target: str
    severity: Severity
    drones: Drones


def about(user_id: int) -> str:
    """What the secret of a webhook and the keys of a browser are sealed for."""
    return f"alert channel of user {user_id}"


def check_target(wish: ChannelWish, *, may_be_private: bool) -> None:
    """Raises BadAlertChannel."""
    target = wish.target
    if wish.kind == "mail":
        if not MAIL_ADDRESS.fullmatch(target):
            raise BadAlertChannel("this is no e-mail address")
        return
    check_address(target, "of a webhook", may_be_private=may_be_private)


def check_address(target: str, whose: str, *, may_be_private: bool) -> None:
    """Of a server that the tower is to call. Raises BadAlertChannel."""
    try:
        parts = urlsplit(target)
        port = parts.port
    except ValueError:
        raise BadAlertChannel("this is no web address") from None
    if not target.isascii() or not target.isprintable() or " " in target or port == 0:
        raise BadAlertChannel("this is no web address")
    if parts.scheme != "https" and not (may_be_private and parts.scheme == "http"):
        raise BadAlertChannel(f"the address {whose} begins with https://")
    if not parts.hostname or parts.username or parts.password or parts.fragment:
        raise BadAlertChannel(f"the address {whose} has a host, and no name, password or fragment")


async def list_channels(session: AsyncSession, user_id: int) -> Sequence[AlertChannelRow]:
    """Oldest first."""
    query = select(AlertChannelRow).where(AlertChannelRow.user_id == user_id).order_by(AlertChannelRow.id)
    return (await session.scalars(query)).all()


async def get_channel(session: AsyncSession, channel_id: int, user_id: int) -> AlertChannelRow:
    """Raises UnknownAlertChannel."""
    row = await session.get(AlertChannelRow, channel_id)
    if row is None or row.user_id != user_id:
        raise UnknownAlertChannel
    return row


async def add_channel(
    session: AsyncSession, wish: ChannelWish, *, user_id: int, vault: Vault, action: AuditAction
) -> tuple[AlertChannelRow, str]:
    """Returns the row and, shown once, the secret of a webhook or the code for a mail address. In
    `Database.writing()`. Raises TooManyAlertChannels."""
    await session.get(UserRow, user_id, with_for_update=True)  # the number of channels is counted one user at a time
    count = await session.scalar(
        select(func.count())
        .select_from(AlertChannelRow)
        .where(AlertChannelRow.user_id == user_id, AlertChannelRow.kind != "push")
    )
    if (count or 0) >= MAX_CHANNELS:
        raise TooManyAlertChannels
    is_mail = wish.kind == "mail"
    secret = _new_code() if is_mail else secrets.token_urlsafe(32)
    row = AlertChannelRow(
        user_id=user_id,
        kind=wish.kind,
        target=wish.target,
        secret_sealed=None if is_mail else vault.seal(secret, about=about(user_id)),
        severity=wish.severity.value,
        drones=wish.drones,
        code_hash=_hash(secret) if is_mail else None,
        created_at=action.at,
    )
    session.add(row)
    await session.flush()
    action.record(session, "alert_channel.added", channel=row.id, kind=row.kind, target=shown_target(row))
    return row, secret


async def change_channel(
    session: AsyncSession,
    channel_id: int,
    *,
    user_id: int,
    severity: Severity | None,
    drones: Drones | None,
    action: AuditAction,
) -> AlertChannelRow:
    """In `Database.writing()`. Raises UnknownAlertChannel."""
    row = await get_channel(session, channel_id, user_id)
    row.severity = row.severity if severity is None else severity.value
    row.drones = drones or row.drones
    action.record(session, "alert_channel.changed", channel=row.id, severity=row.severity, drones=row.drones)
    return row


async def confirm_channel(session: AsyncSession, channel_id: int, code: str, *, user_id: int) -> bool:
    """Whether the code is right; a wrong one counts. In `Database.writing()`, which must commit either way. Raises
    UnknownAlertChannel, and BadAlertChannel after too many wrong ones."""
    row = await get_channel(session, channel_id, user_id)
    if row.code_hash is None:
        return True
    if row.code_tries >= MAX_CODE_TRIES:
        raise BadAlertChannel("too many wrong codes: delete this channel and add it again")
    row.code_tries += 1
    if not secrets.compare_digest(row.code_hash, _hash(code.strip().upper())):
        return False
    row.code_hash = None
    return True


async def note_attempt(session: AsyncSession, channel_id: int, problem: str, now: datetime) -> None:
    """Of a test, so that the channel says whether it works. `problem` empty: it was sent. In `Database.writing()`."""
    values: dict[str, object] = {"problem": problem[:200]} | ({} if problem else {"sent_at": now})
    await session.execute(update(AlertChannelRow).where(AlertChannelRow.id == channel_id).values(**values))


async def delete_channel(session: AsyncSession, channel_id: int, *, user_id: int, action: AuditAction) -> None:
    """What is on its way there is deleted with it. In `Database.writing()`. Raises UnknownAlertChannel."""
    row = await get_channel(session, channel_id, user_id)
    action.record(session, "alert_channel.deleted", channel=row.id, kind=row.kind, target=shown_target(row))
    await session.delete(row)


async def reseal_channels(vault: Vault, database: Database) -> None:
    """At start: seals the secrets of channels with the newest key, so that an older one may go."""
    async with database.reading() as session:
        sealed = (await session.execute(select(AlertChannelRow.id, AlertChannelRow.secret_sealed))).all()
    older = [channel_id for channel_id, secret in sealed if secret is not None and not vault.by_newest_key(secret)]
    if not older:
        return
    async with database.writing() as session:
        query = select(AlertChannelRow).where(AlertChannelRow.id.in_(older)).with_for_update()
        for row in await session.scalars(query):
            # A key that is gone leaves a channel whose deliveries fail, in words: the tower starts all the same.
            with suppress(VaultError):
                row.secret_sealed = vault.reseal(row.secret_sealed or "")


def _new_code() -> str:
    return "".join(secrets.choice(_LETTERS) for _ in range(_CODE_LETTERS))


def _hash(code: str) -> str:
    return hashlib.sha256(code.encode()).hexdigest()


def shown_target(row: AlertChannelRow) -> str:
    """For the audit trail and for admins: the path of an address may be a secret of the other side."""
    return row.target if row.kind == "mail" else (urlsplit(row.target).hostname or "")
