"""The rules of user accounts: create, change, delete, and the errors of sign-in. Independent of HTTP.

Every function takes a session of `Database.writing()`, so that a change and its audit record are committed together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store import second_factor
from server.accounts.store.sessions import end_sessions_of
from server.accounts.store.tables import UserRow
from server.accounts.store.tokens import end_tokens_of
from server.alerts.store.channels.browsers import end_browsers
from server.audit.store.action import AuditAction
from server.fleet.store.snapshot import begin_fleet_change
from server.kernel.names import clean_name, is_name, name_key
from server.kernel.people import Role
from server.kernel.refusal import Refusal, RetryLater


class WrongSignIn(Refusal):
    """Unknown name, wrong password or disabled account. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("the name or the password is wrong")


class SignInThrottled(RetryLater):
    def __init__(self, *, retry_after_s: float) -> None:
        super().__init__("too many failed attempts: wait before the next one", retry_after_s=retry_after_s)


class UnknownUser(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no such user")


class UserNameTaken(Refusal):
    def __init__(self) -> None:
        super().__init__("another user has this name")


class LastAdmin(Refusal):
    def __init__(self) -> None:
        super().__init__("the last admin who can sign in must not be demoted, disabled or deleted")


@dataclass(frozen=True)
class UserChange:
    """The values to change; None leaves a value as it is."""

    role: Role | None = None
    disabled: bool | None = None
    password_hash: str | None = None
    must_change_password: bool = True
    """With `password_hash`: set by someone other than the user."""
    keep_tokens: bool = False
    """With `password_hash`: API tokens stay valid."""


async def find_user(session: AsyncSession, name: str) -> UserRow | None:
    if not is_name(name):
        return None
    return await session.scalar(select(UserRow).where(UserRow.name_key == name_key(clean_name(name))))


async def get_user(session: AsyncSession, user_id: int) -> UserRow:
    row = await session.get(UserRow, user_id)
    if row is None:
        raise UnknownUser
    return row


async def list_users(session: AsyncSession) -> list[UserRow]:
    return list(await session.scalars(select(UserRow).order_by(UserRow.id)))


async def create_user(
    session: AsyncSession,
    *,
    name: str,
    role: Role,
    password_hash: str,
    action: AuditAction,
    must_change_password: bool = True,
) -> UserRow:
    name = clean_name(name)
    await begin_fleet_change(session)
    if await find_user(session, name) is not None:
        raise UserNameTaken
    row = UserRow(
        name=name,
        name_key=name_key(name),
        role=role.value,
        password_hash=password_hash,
        disabled=False,
        created_at=action.at,
        must_change_password=must_change_password,
    )
    session.add(row)
    await session.flush()
    action.record(session, "user.created", user_id=row.id, user=name, role=role.value)
    return row


async def change_user(session: AsyncSession, *, user_id: int, change: UserChange, action: AuditAction) -> UserRow:
    """If the user is disabled or gets a new password, ends all their sessions and API tokens."""
    await begin_fleet_change(session)
    row = await get_user(session, user_id)
    goes_as_admin = change.disabled is True or change.role not in (None, Role.ADMIN)
    if goes_as_admin:
        await _keep_an_admin(session, row)
    if change.role is not None and change.role.value != row.role:
        row.role = change.role.value
        action.record(session, "user.role_changed", **_about(row), role=row.role)
    if change.disabled is not None and change.disabled != row.disabled:
        row.disabled = change.disabled
        event = "user.disabled" if change.disabled else "user.enabled"
        action.record(session, event, **_about(row))
    if change.password_hash is not None:
        row.password_hash = change.password_hash
        row.must_change_password = change.must_change_password
        row.password_changed_at = action.at
        action.record(session, "user.password_changed", **_about(row))
    if change.disabled or change.password_hash is not None:
        await end_browsers(session, action, user_id=row.id)
        await end_sessions_of(session, row.id)
    if change.disabled or (change.password_hash is not None and not change.keep_tokens):
        await end_tokens_of(session, row.id)
    return row


async def reset_second_factor(session: AsyncSession, *, user_id: int, action: AuditAction) -> tuple[UserRow, bool]:
    """For a user who has lost the second factor: a finder may be signed in, so sessions and tokens end as well. Also
    returns whether there was one; without one nothing changes."""
    await begin_fleet_change(session)
    row = await get_user(session, user_id)
    had_one = row.has_second_factor
    await second_factor.reset(session, row, action)
    if had_one:
        await end_browsers(session, action, user_id=row.id)
        await end_sessions_of(session, row.id)
        await end_tokens_of(session, row.id)
    return row, had_one


async def delete_user(session: AsyncSession, *, user_id: int, action: AuditAction) -> None:
    await begin_fleet_change(session)
    row = await get_user(session, user_id)
    await _keep_an_admin(session, row)
    action.record(session, "user.deleted", **_about(row))
    await session.delete(row)


def _about(row: UserRow) -> dict[str, Any]:
    return {"user_id": row.id, "user": row.name}


async def _keep_an_admin(session: AsyncSession, row: UserRow) -> None:
    if row.role != Role.ADMIN or row.disabled:
        return
    others = await session.scalar(
        select(func.count())
        .select_from(UserRow)
        .where(UserRow.role == Role.ADMIN.value, UserRow.disabled.is_(False), UserRow.id != row.id)
    )
    if not others:
        raise LastAdmin
