"""`/api/v1/users`: user administration, for admins."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path

from server.accounts.store import users
from server.accounts.store.password_policy import TooManyJudgements
from server.accounts.store.passwords import TooManySignIns
from server.accounts.store.sessions import Sessions
from server.accounts.store.tables import UserRow
from server.accounts.store.users import LastAdmin, UnknownUser, UserChange, UserNameTaken
from server.accounts.store.views import AccountView, NewUser, UserPatch
from server.http.access import Admin, ProvedAdmin
from server.http.dependencies import (
    AuditDep,
    DatabaseDep,
    EventHandlerDep,
    HubDep,
    PasswordPolicyDep,
    PasswordsDep,
    RosterDep,
    SessionsDep,
)
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.kernel.names import clean_name
from wire.ids import UserId

router = APIRouter(prefix="/api/v1/users", tags=["users"], responses=answers(NotSignedIn, SessionExpired, AdminsOnly))

UserPath = Annotated[int, Path(ge=1, le=2**31 - 1)]


def _view(sessions: Sessions, row: UserRow) -> AccountView:
    return AccountView.of(row, must_add=sessions.lacks_demanded_factor(row))


@router.get("")
async def list_users(admin: Admin, database: DatabaseDep, sessions: SessionsDep) -> list[AccountView]:
    """Lists all users by id."""
    async with database.reading() as session:
        return [_view(sessions, row) for row in await users.list_users(session)]


@router.post("", status_code=201, responses=answers(UserNameTaken, TooManyJudgements, TooManySignIns))
async def create_user(
    admin: ProvedAdmin,
    password_policy: PasswordPolicyDep,
    passwords: PasswordsDep,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    sessions: SessionsDep,
    body: NewUser,
) -> AccountView:
    """Creates a user, who can sign in at once. Names must differ by more than upper and lower case."""
    clean_name(body.name)
    await password_policy.check(body.password, body.name)
    password_hash = await passwords.hash(body.password)
    async with database.writing() as session:
        row = await users.create_user(
            session, name=body.name, role=body.role, password_hash=password_hash, action=audit.action(admin)
        )
    await roster.refresh()
    return _view(sessions, row)


@router.get("/{user_id}", responses=answers(UnknownUser))
async def get_user(admin: Admin, database: DatabaseDep, sessions: SessionsDep, user_id: UserPath) -> AccountView:
    """Returns one user."""
    async with database.reading() as session:
        return _view(sessions, await users.get_user(session, user_id))


@router.patch("/{user_id}", responses=answers(UnknownUser, LastAdmin, TooManyJudgements, TooManySignIns))
async def change_user(
    admin: ProvedAdmin,
    database: DatabaseDep,
    password_policy: PasswordPolicyDep,
    passwords: PasswordsDep,
    audit: AuditDep,
    roster: RosterDep,
    hub: HubDep,
    event_handler: EventHandlerDep,
    sessions: SessionsDep,
    user_id: UserPath,
    body: UserPatch,
) -> AccountView:
    """Changes role, password, or whether the user may sign in. A new password ends all sessions and tokens."""
    password_hash = None
    if body.password is not None:
        async with database.reading() as session:
            name = (await users.get_user(session, user_id)).name
        await password_policy.check(body.password, name)
        password_hash = await passwords.hash(body.password)
    change = UserChange(role=body.role, disabled=body.disabled, password_hash=password_hash)
    async with database.writing() as session:
        row = await users.change_user(session, user_id=user_id, change=change, action=audit.action(admin))
    await roster.refresh()
    if body.disabled or password_hash is not None:
        why = "the account was disabled" if body.disabled else "an admin has set a new password"
        hub.end_user(UserId(user_id), why)
    await event_handler.caught_up()  # rights that the user loses are gone before the response
    return _view(sessions, row)


@router.delete("/{user_id}/second-factor", responses=answers(UnknownUser))
async def reset_second_factor(
    admin: ProvedAdmin,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    hub: HubDep,
    event_handler: EventHandlerDep,
    sessions: SessionsDep,
    user_id: UserPath,
) -> AccountView:
    """Removes a lost second factor: the user is left with the password alone, and all sessions and tokens end. Does
    nothing if there is no second factor."""
    async with database.writing() as session:
        row, had_one = await users.reset_second_factor(session, user_id=user_id, action=audit.action(admin))
    if had_one:
        await roster.refresh()
        hub.end_user(UserId(user_id), "an admin has removed the second factor")
        await event_handler.caught_up()
    return _view(sessions, row)


@router.delete("/{user_id}", status_code=204, responses=answers(UnknownUser, LastAdmin))
async def delete_user(
    admin: ProvedAdmin,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    hub: HubDep,
    event_handler: EventHandlerDep,
    user_id: UserPath,
) -> None:
    """Deletes a user with their sessions and ownerships. The audit trail keeps the name."""
    # In two steps: a drone that they hold must change hands with a new epoch while it still has a holder.
    async with database.writing() as session:
        gone = UserChange(disabled=True)
        await users.change_user(session, user_id=user_id, change=gone, action=audit.action(admin))
    await roster.refresh()
    hub.end_user(UserId(user_id), "the account was deleted")
    await event_handler.caught_up()
    async with database.writing() as session:
        await users.delete_user(session, user_id=user_id, action=audit.action(admin))
    await roster.refresh()
