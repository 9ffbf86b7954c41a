"""`/api/v1/users`: users administration, for admins."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Request

from server.api.access import Admin, ProvedAdmin
from server.api.http.problem_docs import answers
from server.api.tower import address_of, tower_of
from server.domain.access import AdminsOnly, NotSignedIn, SessionExpired
from server.domain.names import clean_name
from server.domain.people import Principal
from server.store.accounts import users
from server.store.accounts.password_policy import TooManyJudgements
from server.store.accounts.passwords import TooManySignIns
from server.store.accounts.tables import UserRow
from server.store.accounts.users import LastAdmin, UnknownUser, UserChange, UserNameTaken
from server.store.accounts.views import AccountView, NewUser, UserPatch
from server.store.audit.action import AuditAction
from wire.ids import UserId

router = APIRouter(prefix="/api/v1/users", tags=["users"], responses=answers(NotSignedIn, SessionExpired, AdminsOnly))

UserPath = Annotated[int, Path(ge=1, le=2**31 - 1)]


def _action(request: Request, admin: Principal) -> AuditAction:
    return AuditAction(by=admin, at=tower_of(request).clock(), address=address_of(request))


def _view(request: Request, row: UserRow) -> AccountView:
    return AccountView.of(row, must_add=tower_of(request).sessions.lacks_demanded_factor(row))


@router.get("")
async def list_users(request: Request, admin: Admin) -> list[AccountView]:
    """Every user, in the order of their ids."""
    async with tower_of(request).database.reading() as session:
        return [_view(request, row) for row in await users.list_users(session)]


@router.post("", status_code=201, responses=answers(UserNameTaken, TooManyJudgements, TooManySignIns))
async def create_user(request: Request, admin: ProvedAdmin, body: NewUser) -> AccountView:
    """Creates a user who can sign in at once. Names differ by more than upper and lower case."""
    tower = tower_of(request)
    clean_name(body.name)
    await tower.password_policy.check(body.password, body.name)
    password_hash = await tower.passwords.hash(body.password)
    async with tower.database.writing() as session:
        row = await users.create_user(
            session, name=body.name, role=body.role, password_hash=password_hash, action=_action(request, admin)
        )
    await tower.roster.refresh()
    return _view(request, row)


@router.get("/{user_id}", responses=answers(UnknownUser))
async def get_user(request: Request, admin: Admin, user_id: UserPath) -> AccountView:
    """One user."""
    async with tower_of(request).database.reading() as session:
        return _view(request, await users.get_user(session, user_id))


@router.patch("/{user_id}", responses=answers(UnknownUser, LastAdmin, TooManyJudgements, TooManySignIns))
async def change_user(request: Request, admin: ProvedAdmin, user_id: UserPath, body: UserPatch) -> AccountView:
    """Changes role, password or whether the user may sign in. A new password signs out everywhere and ends tokens."""
    tower = tower_of(request)
    password_hash = None
    if body.password is not None:
        async with tower.database.reading() as session:
            name = (await users.get_user(session, user_id)).name
        await tower.password_policy.check(body.password, name)
        password_hash = await tower.passwords.hash(body.password)
    change = UserChange(role=body.role, disabled=body.disabled, password_hash=password_hash)
    async with tower.database.writing() as session:
        row = await users.change_user(session, user_id=user_id, change=change, action=_action(request, admin))
    await tower.roster.refresh()
    if body.disabled or password_hash is not None:
        why = "the account was disabled" if body.disabled else "an admin has set a new password"
        tower.hub.end_user(UserId(user_id), why)
    await tower.event_handler.caught_up()  # what they lose with it, they have lost when this is answered
    return _view(request, row)


@router.delete("/{user_id}/second-factor", responses=answers(UnknownUser))
async def reset_second_factor(request: Request, admin: ProvedAdmin, user_id: UserPath) -> AccountView:
    """For somebody who has lost it: back to the password alone, signed out everywhere, their tokens ended.
    Harmless where there is none."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        row, had_one = await users.reset_second_factor(session, user_id=user_id, action=_action(request, admin))
    if had_one:
        await tower.roster.refresh()
        tower.hub.end_user(UserId(user_id), "an admin has removed the second factor")
        await tower.event_handler.caught_up()
    return _view(request, row)


@router.delete("/{user_id}", status_code=204, responses=answers(UnknownUser, LastAdmin))
async def delete_user(request: Request, admin: ProvedAdmin, user_id: UserPath) -> None:
    """Deletes a user, their sessions and ownerships. The audit trail keeps the name."""
    tower = tower_of(request)
    # In two steps: a drone that they hold must change hands properly, with a new epoch, while there is still a holder.
    async with tower.database.writing() as session:
        gone = UserChange(disabled=True)
        await users.change_user(session, user_id=user_id, change=gone, action=_action(request, admin))
    await tower.roster.refresh()
    tower.hub.end_user(UserId(user_id), "the account was deleted")
    await tower.event_handler.caught_up()
    async with tower.database.writing() as session:
        await users.delete_user(session, user_id=user_id, action=_action(request, admin))
    await tower.roster.refresh()
