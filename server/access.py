"""Who may come in and what they may see: one judgement for REST, WebSocket, UDP and video alike.

Not theirs and not there get the same answer: `judge` is told the owners of a drone, or None when there is no such
drone, and refuses both with the same words.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final, assert_never

from fastapi import Depends, Request
from starlette.requests import HTTPConnection

from server.accounts.sessions import Principal
from server.accounts.tables import Role
from server.refusal import Refusal
from server.tower import tower_of
from wire.ids import UserId

COOKIE: Final = "tower_session"


class NotSignedIn(Refusal):
    """No session cookie came with the request."""

    def __init__(self) -> None:
        super().__init__("sign in first")


class SessionExpired(Refusal):
    """A session cookie came, but its session has ended."""

    def __init__(self) -> None:
        super().__init__("the session has ended: sign in again")


class AdminsOnly(Refusal):
    def __init__(self) -> None:
        super().__init__("only an admin may do this")


class UnknownDrone(Refusal):
    """No such drone, or none that this user may see."""

    def __init__(self) -> None:
        super().__init__("there is no such drone")


class Action(StrEnum):
    SEE_DRONE = "see-drone"
    ADMINISTER = "administer"


@dataclass(frozen=True)
class AccessRequest:
    """`owner_ids`: of the drone in question; None when there is no such drone, or no drone is in question."""

    principal: Principal
    action: Action
    owner_ids: Collection[UserId] | None = None


@dataclass(frozen=True)
class Verdict:
    refusal: Refusal | None = None

    @property
    def allowed(self) -> bool:
        return self.refusal is None


def judge(request: AccessRequest) -> Verdict:
    is_admin = request.principal.role is Role.ADMIN
    match request.action:
        case Action.ADMINISTER:
            return Verdict() if is_admin else Verdict(AdminsOnly())
        case Action.SEE_DRONE:
            owners = request.owner_ids
            seen = owners is not None and (is_admin or request.principal.user_id in owners)
            return Verdict() if seen else Verdict(UnknownDrone())
        case _:
            assert_never(request.action)


async def authenticate(connection: HTTPConnection) -> Principal | NotSignedIn | SessionExpired:
    """Who sent this request or opens this WebSocket, by the session cookie. Does not raise the refusal."""
    token = connection.cookies.get(COOKIE)
    if not token:
        return NotSignedIn()
    tower = tower_of(connection)
    return await tower.sessions.find(token, tower.clock()) or SessionExpired()


async def current_user(request: Request) -> Principal:
    found = await authenticate(request)
    if isinstance(found, Refusal):
        raise found
    return found


async def require_admin(principal: Annotated[Principal, Depends(current_user)]) -> Principal:
    verdict = judge(AccessRequest(principal, Action.ADMINISTER))
    if verdict.refusal is not None:
        raise verdict.refusal
    return principal


CurrentUser = Annotated[Principal, Depends(current_user)]
Admin = Annotated[Principal, Depends(require_admin)]
