"""Who may come in and what they may do: one judgement for REST, WebSocket, UDP and video alike.

Two ways to sign in: a browser's session cookie, for everything that its user may do, and an API token in the
`Authorization` header, for what its scopes say and its owner may do. `NEEDS` is the one table of which scopes an action
takes. Where a token comes with a request, no cookie of it is looked at.

Not theirs and not there get the same answer: `judge` is told how the user stands to a drone (`server.fleet.relations`,
which has the table of who may do what with one), or None when there is no such drone, and refuses both with the same
words.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Annotated, Any, Final, assert_never

from fastapi import Depends, Request
from starlette.datastructures import Headers
from starlette.requests import HTTPConnection

from server.accounts.reauthentication import ProofNeeded, is_fresh
from server.accounts.scopes import Scope
from server.accounts.sessions import Principal
from server.accounts.tables import Role
from server.anonymous.budget import admitted
from server.fleet.relations import Relation, Right, may
from server.refusal import Refusal
from server.tower import address_of, tower_of

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
    """A token cannot look after tokens, sessions, passwords, users, nor change how its owner's sticks are read."""

    def __init__(self) -> None:
        super().__init__("this is done in person: sign in with name and password, not with a token")


class PasswordChangeNeeded(Refusal):
    """Somebody else knows the password."""

    def __init__(self) -> None:
        super().__init__("choose a password of your own first")


class SecondFactorDemanded(Refusal):
    """The tower is set to demand a second factor of admins, and this admin has none."""

    def __init__(self) -> None:
        super().__init__("admins of this tower need a second factor: set one up under your account first")


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
    LOOK_AFTER_TEAMS = "look-after-teams"
    """Teams, and lending their drones: whose team it is, is decided where that is known."""
    SEE_CREDENTIALS = "see-credentials"
    """Which tokens, sessions and factors there are."""
    PROVE_ONESELF = "prove-oneself"
    CHANGE_CREDENTIALS = "change-credentials"
    """One's tokens, sessions and second factor."""
    SET_UP_SECOND_FACTOR = "set-up-second-factor"
    CHANGE_PASSWORD = "change-password"  # noqa: S105
    CHANGE_USERS = "change-users"
    """Accounts and credentials of others: whoever may, can make an account to come back with."""


NEEDS: Final[Mapping[Action, frozenset[Scope]]] = {
    Action.KNOW_ONESELF: frozenset(),
    Action.SEE_SQUAD: frozenset({Scope.WATCH}),
    Action.SEE_DRONE: frozenset({Scope.WATCH}),
    Action.FLY: frozenset({Scope.FLY}),
    Action.COMMAND: frozenset({Scope.FLY, Scope.ADMIN}),
    Action.ADMINISTER: frozenset({Scope.ADMIN}),
    Action.READ_METRICS: frozenset({Scope.METRICS}),
    Action.LOOK_AFTER_TEAMS: frozenset({Scope.ADMIN}),
    Action.SEE_CREDENTIALS: frozenset(),
    Action.PROVE_ONESELF: frozenset(),
    Action.CHANGE_CREDENTIALS: frozenset(),
    Action.SET_UP_SECOND_FACTOR: frozenset(),
    Action.CHANGE_PREFERENCES: frozenset(),
    Action.CHANGE_PASSWORD: frozenset(),
    Action.CHANGE_USERS: frozenset(),
}
"""Which scopes a token must have, all of them. A session has every scope."""

WITH_ANY_PASSWORD: Final = frozenset({Action.KNOW_ONESELF, Action.PROVE_ONESELF, Action.CHANGE_PASSWORD})
"""What may be done before the first password was changed."""

WITHOUT_DEMANDED_FACTOR: Final = WITH_ANY_PASSWORD | {Action.SEE_CREDENTIALS, Action.SET_UP_SECOND_FACTOR}
"""What an admin may do who needs a second factor and has none."""

IN_PERSON: Final = frozenset(
    {
        Action.SET_UP_SECOND_FACTOR,
        Action.SEE_CREDENTIALS,
        Action.PROVE_ONESELF,
        Action.CHANGE_CREDENTIALS,
        Action.CHANGE_PREFERENCES,
        Action.CHANGE_PASSWORD,
        Action.CHANGE_USERS,
    }
)
"""What no token is for, whatever its scopes."""

WITH_FRESH_PROOF: Final = frozenset(
    {Action.CHANGE_CREDENTIALS, Action.SET_UP_SECOND_FACTOR, Action.CHANGE_PASSWORD, Action.CHANGE_USERS}
)
"""What a stolen cookie is not enough for: see `server/accounts/reauthentication.py`."""

FOR_ADMINS: Final = frozenset({Action.ADMINISTER, Action.READ_METRICS, Action.CHANGE_USERS})
"""What an operator may not do, with whatever they signed in."""


@dataclass(frozen=True)
class AccessRequest:
    """`relation`: to the drone in question; None when there is no such drone, or no drone is in question.

    `now`: for what needs a fresh proof; without it no proof is fresh.
    """

    principal: Principal
    action: Action
    relation: Relation | None = None
    now: datetime | None = None


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
    if principal.must_add_second_factor and action not in WITHOUT_DEMANDED_FACTOR:
        return Verdict(SecondFactorDemanded())
    missing = NEEDS[action] - principal.scopes
    if missing:
        return Verdict(ScopeMissing(missing))
    if action in IN_PERSON and not principal.in_person:
        return Verdict(InPersonOnly())
    is_admin = principal.role is Role.ADMIN
    if action in FOR_ADMINS and not is_admin:
        return Verdict(AdminsOnly())
    if action in WITH_FRESH_PROOF and (request.now is None or not is_fresh(principal.proved_at, request.now)):
        return Verdict(ProofNeeded())
    match action:
        case Action.SEE_DRONE:
            seen = request.relation is not None and may(request.relation, Right.SEE)
            return Verdict() if seen else Verdict(UnknownDrone())
        case Action.KNOW_ONESELF | Action.SEE_SQUAD | Action.FLY | Action.COMMAND | Action.LOOK_AFTER_TEAMS:
            return Verdict()  # whose drone it is, and who has its controls, is decided where that is known
        case Action.ADMINISTER | Action.READ_METRICS | Action.CHANGE_USERS:
            return Verdict()
        case Action.SEE_CREDENTIALS | Action.PROVE_ONESELF | Action.CHANGE_CREDENTIALS:
            return Verdict()
        case Action.CHANGE_PREFERENCES | Action.CHANGE_PASSWORD | Action.SET_UP_SECOND_FACTOR:
            return Verdict()
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
    found: Principal | BadToken | SessionExpired
    if token is not None:
        found = await tower.tokens.find(token, tower.clock(), address=address_of(connection)) or BadToken()
    else:
        cookie = connection.cookies.get(COOKIE)
        if not cookie:
            return NotSignedIn()
        found = await tower.sessions.find(cookie, tower.clock()) or SessionExpired()
    if not isinstance(found, Refusal):
        admitted(connection)
    return found


async def admit(request: Request, action: Action) -> Principal:
    """The principal of the request, if it may do that now. Ask again where a body was waited for: who sent the
    beginning of it may have lost their right since. Raises the refusal."""
    found = await authenticate(request)
    if isinstance(found, Refusal):
        raise found
    verdict = judge(AccessRequest(found, action, now=tower_of(request).clock()))
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
TeamKeeper = Annotated[Principal, who_may(Action.LOOK_AFTER_TEAMS)]
MetricsReader = Annotated[Principal, who_may(Action.READ_METRICS)]
InPerson = Annotated[Principal, who_may(Action.SEE_CREDENTIALS)]
Oneself = Annotated[Principal, who_may(Action.CHANGE_PREFERENCES)]
"""Whoever is signed in, in person."""
Prover = Annotated[Principal, who_may(Action.PROVE_ONESELF)]
"""Whoever may confirm that it is them: in person, before anything else that is asked of an account."""
Proved = Annotated[Principal, who_may(Action.CHANGE_CREDENTIALS)]
"""Whoever is signed in, in person, and proved who they are a moment ago."""
FactorSetter = Annotated[Principal, who_may(Action.SET_UP_SECOND_FACTOR)]
PasswordChanger = Annotated[Principal, who_may(Action.CHANGE_PASSWORD)]
ProvedAdmin = Annotated[Principal, who_may(Action.CHANGE_USERS)]
"""An admin in person, who proved who they are a moment ago."""
