"""Who may come in and what they may do: one judgement for REST, WebSocket, UDP and video alike.

Two ways to sign in: a browser's session cookie, for everything that its user may do, and an API token in the
`Authorization` header, for what its scopes say and its owner may do. `NEEDS` is the one table of which scopes an action
takes. Where a token comes with a request, no cookie of it is looked at.

Not theirs and not there get the same answer: `judge` is told the owners of a drone, or None when there is no such
drone, and refuses both with the same words.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, Final, assert_never

from fastapi import Depends, Request
from starlette.datastructures import Headers
from starlette.requests import HTTPConnection

from server.accounts.scopes import Scope
from server.accounts.sessions import Principal
from server.accounts.tables import Role
from server.refusal import Refusal
from server.tower import tower_of
from wire.ids import UserId

COOKIE: Final = "tower_session"


class NotSignedIn(Refusal):
    """Neither a session cookie nor a token came with the request."""

    def __init__(self) -> None:
        super().__init__("sign in first")


class SessionExpired(Refusal):
    """A session cookie came, but its session has ended."""

    def __init__(self) -> None:
        super().__init__("the session has ended: sign in again")


class BadToken(Refusal):
    """A token came, but it is not good: never was, expired, revoked. On purpose not said which."""

    def __init__(self) -> None:
        super().__init__("this token is not valid: it may have expired or been revoked")


class ScopeMissing(Refusal):
    """The token was not made for this."""

    def __init__(self, missing: Collection[Scope]) -> None:
        super().__init__(f"this token was not made for that: it lacks the scope {' and '.join(sorted(missing))}")


class InPersonOnly(Refusal):
    """A token cannot look after tokens, sessions, passwords, nor change how its owner's sticks are read."""

    def __init__(self) -> None:
        super().__init__("this is done in person: sign in with name and password, not with a token")


class PasswordChangeNeeded(Refusal):
    """Somebody else knows the password."""

    def __init__(self) -> None:
        super().__init__("choose a password of your own first")


class AdminsOnly(Refusal):
    def __init__(self) -> None:
        super().__init__("only an admin may do this")


class UnknownDrone(Refusal):
    """No such drone, or none that this user may see."""

    def __init__(self) -> None:
        super().__init__("there is no such drone")


class Action(StrEnum):
    KNOW_ONESELF = "know-oneself"
    SEE_SQUAD = "see-squad"
    SEE_DRONE = "see-drone"
    FLY = "fly"
    COMMAND = "command"
    """Take the controls from somebody, give them back, assist."""
    ADMINISTER = "administer"
    READ_METRICS = "read-metrics"
    CHANGE_PREFERENCES = "change-preferences"
    LOOK_AFTER_TOKENS = "look-after-tokens"
    """One's tokens, sessions and second factor."""
    CHANGE_PASSWORD = "change-password"  # noqa: S105


NEEDS: Final[Mapping[Action, frozenset[Scope]]] = {
    Action.KNOW_ONESELF: frozenset(),
    Action.SEE_SQUAD: frozenset({Scope.WATCH}),
    Action.SEE_DRONE: frozenset({Scope.WATCH}),
    Action.FLY: frozenset({Scope.FLY}),
    Action.COMMAND: frozenset({Scope.FLY, Scope.ADMIN}),
    Action.ADMINISTER: frozenset({Scope.ADMIN}),
    Action.READ_METRICS: frozenset({Scope.METRICS}),
    Action.LOOK_AFTER_TOKENS: frozenset(),
    Action.CHANGE_PREFERENCES: frozenset(),
    Action.CHANGE_PASSWORD: frozenset(),
}
"""Which scopes a token must have, all of them. A session has every scope."""

WITH_ANY_PASSWORD: Final = frozenset({Action.KNOW_ONESELF, Action.CHANGE_PASSWORD})
"""What may be done before the first password was changed."""


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
    principal, action = request.principal, request.action
    if principal.must_change_password and action not in WITH_ANY_PASSWORD:
        return Verdict(PasswordChangeNeeded())
    missing = NEEDS[action] - principal.scopes
    if missing:
        return Verdict(ScopeMissing(missing))
    is_admin = principal.role is Role.ADMIN
    match action:
        case Action.ADMINISTER | Action.READ_METRICS:
            return Verdict() if is_admin else Verdict(AdminsOnly())
        case Action.SEE_DRONE:
            owners = request.owner_ids
            seen = owners is not None and (is_admin or principal.user_id in owners)
            return Verdict() if seen else Verdict(UnknownDrone())
        case Action.LOOK_AFTER_TOKENS | Action.CHANGE_PREFERENCES | Action.CHANGE_PASSWORD:
            return Verdict() if principal.in_person else Verdict(InPersonOnly())
        case Action.KNOW_ONESELF | Action.SEE_SQUAD | Action.FLY | Action.COMMAND:
            return Verdict()  # whose drone it is, and who has its controls, is decided where that is known
        case _:
            assert_never(action)


def token_in(headers: Headers) -> str | None:
    """The text behind `Authorization: Bearer`, or None where there is no such header."""
    scheme, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else None


async def authenticate(connection: HTTPConnection) -> Principal | NotSignedIn | SessionExpired | BadToken:
    """Who sent this request or opens this WebSocket. Does not raise the refusal."""
    tower = tower_of(connection)
    token = token_in(connection.headers)
    if token is not None:
        return await tower.tokens.find(token, tower.clock()) or BadToken()
    cookie = connection.cookies.get(COOKIE)
    if not cookie:
        return NotSignedIn()
    return await tower.sessions.find(cookie, tower.clock()) or SessionExpired()


async def admit(request: Request, action: Action) -> Principal:
    """The principal of the request, if it may do that now. Ask again where a body was waited for: who sent the
    beginning of it may have lost their right since. Raises the refusal."""
    found = await authenticate(request)
    if isinstance(found, Refusal):
        raise found
    verdict = judge(AccessRequest(found, action))
    if verdict.refusal is not None:
        raise verdict.refusal
    return found


def who_may(action: Action) -> Any:
    """A route's dependency: the principal of the request, if it may do that."""

    async def checked(request: Request) -> Principal:
        return await admit(request, action)

    checked.action = action  # type: ignore[attr-defined]  # for the test that walks all routes
    return Depends(checked)


Anybody = Annotated[Principal, who_may(Action.KNOW_ONESELF)]
"""Whoever is signed in, however."""
Viewer = Annotated[Principal, who_may(Action.SEE_SQUAD)]
Pilot = Annotated[Principal, who_may(Action.FLY)]
Commander = Annotated[Principal, who_may(Action.COMMAND)]
Admin = Annotated[Principal, who_may(Action.ADMINISTER)]
MetricsReader = Annotated[Principal, who_may(Action.READ_METRICS)]
InPerson = Annotated[Principal, who_may(Action.LOOK_AFTER_TOKENS)]
Oneself = Annotated[Principal, who_may(Action.CHANGE_PREFERENCES)]
"""Whoever is signed in, in person."""
PasswordChanger = Annotated[Principal, who_may(Action.CHANGE_PASSWORD)]
