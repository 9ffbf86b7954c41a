"""Who may do what: one judgement for REST, WebSocket, UDP and video alike.

`NEEDS` is the one table of the scopes that an action takes. A session has every scope, an API token those that it was
made with. `judge` is told the relation of the user to a drone (`server.domain.relations` has the table of rights), or
None where there is no such drone, and refuses both with the same words.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final, assert_never

from server.domain.people import Principal, Role
from server.domain.refusal import Refusal
from server.domain.relations import Relation, Right, may
from server.domain.scopes import Scope

PROOF_MAX_AGE: Final = timedelta(minutes=5)


class ProofNeeded(Refusal):
    """The last proof is too old for what was asked."""

    def __init__(self) -> None:
        super().__init__("confirm first that it is you: this needs a proof that is not older than 5 minutes")


def is_fresh(proved_at: datetime | None, now: datetime) -> bool:
    """A proof from the future (a clock that was put back) counts for nothing."""
    return proved_at is not None and proved_at <= now < proved_at + PROOF_MAX_AGE


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
    MANAGE_TEAMS = "manage-teams"
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
    Action.MANAGE_TEAMS: frozenset({Scope.ADMIN}),
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
"""What a stolen cookie is not enough for: see `server/store/accounts/reauthentication.py`."""


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
        case Action.KNOW_ONESELF | Action.SEE_SQUAD | Action.FLY | Action.COMMAND | Action.MANAGE_TEAMS:
            return Verdict()  # whose drone it is, and who has its controls, is decided where that is known
        case Action.ADMINISTER | Action.READ_METRICS | Action.CHANGE_USERS:
            return Verdict()
        case Action.SEE_CREDENTIALS | Action.PROVE_ONESELF | Action.CHANGE_CREDENTIALS:
            return Verdict()
        case Action.CHANGE_PREFERENCES | Action.CHANGE_PASSWORD | Action.SET_UP_SECOND_FACTOR:
            return Verdict()
        case _:
            assert_never(action)
