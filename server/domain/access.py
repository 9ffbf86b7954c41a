"""Who may do what: one judgement for REST, WebSocket, UDP and video.

Three tables decide, and no other code compares roles:

- `NEEDS`: the scopes that an action requires. A session has every scope, an API token those of its creation.
- `REACH`: how far each account role reaches with it: nowhere, to its own objects, or to everybody's.
- `RIGHTS` in `server.domain.relations`: what a relation to a drone allows.

`judge` checks all of them on each request. `reaches` answers for one object, `reach_of` for a list or a query, which
then shows all or one's own; `roles_with` is the reverse, for an SQL condition.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final

from server.domain.people import Principal, Role
from server.domain.refusal import Refusal
from server.domain.relations import Relation, Right, may
from server.domain.scopes import Scope
from wire.ids import UserId

PROOF_MAX_AGE: Final = timedelta(minutes=5)


class ProofNeeded(Refusal):
    """The last proof of identity is too old for this request."""

    def __init__(self) -> None:
        super().__init__("confirm your identity first: this needs a proof from the last 5 minutes")


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
    """The token is invalid: unknown, expired or revoked. The message does not say which, on purpose."""

    def __init__(self) -> None:
        super().__init__("this token is not valid: it may have expired or been revoked")


class ScopeMissing(Refusal):
    """The token lacks the scope."""

    def __init__(self, missing: Collection[Scope]) -> None:
        super().__init__(f"this token does not allow that: it lacks the scope {' and '.join(sorted(missing))}")


class InPersonOnly(Refusal):
    """A token cannot look after tokens, sessions, passwords, users, nor change how its owner's sticks are read."""

    def __init__(self) -> None:
        super().__init__("this needs a person: sign in with name and password, not with a token")


class PasswordChangeNeeded(Refusal):
    """Somebody else knows the password."""

    def __init__(self) -> None:
        super().__init__("choose a password of your own first")


class SecondFactorDemanded(Refusal):
    """The tower is set to demand a second factor of admins, and this admin has none."""

    def __init__(self) -> None:
        super().__init__("admins of this tower need a second factor: set one up in your account first")


class AdminsOnly(Refusal):
    def __init__(self) -> None:
        super().__init__("only an admin may do this")


class ReadOnlyAccount(Refusal):
    """The role of the account is observer."""

    def __init__(self) -> None:
        super().__init__("this account can only watch: its role is observer")


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
    """Take the controls from somebody, give them back, assist. A role that reaches everywhere outranks all others."""
    HOLD_SEVERAL = "hold-several"
    """Have the controls of more than one drone at a time."""
    ADMINISTER = "administer"
    READ_METRICS = "read-metrics"
    CHANGE_PREFERENCES = "change-preferences"
    MANAGE_TEAMS = "look-after-teams"
    """Be in teams: see them, join and leave. One's own are those that one is in."""
    LEAD_TEAMS = "lead-teams"
    """Make teams, change them, lend their drones: which team, is decided where its members are known."""
    SEE_MISSIONS = "see-missions"
    """In the library. Which shared ones are one's own to see, the library knows."""
    CHANGE_MISSIONS = "change-missions"
    SHARE_WITH_EVERYBODY = "share-with-everybody"
    """What they share is not for their teams alone."""
    SEE_CREDENTIALS = "see-credentials"
    """Which tokens, sessions and factors there are."""
    PROVE_ONESELF = "prove-oneself"
    CHANGE_CREDENTIALS = "change-credentials"
    """Tokens, sessions and the second factor."""
    SET_UP_SECOND_FACTOR = "set-up-second-factor"
    CHANGE_PASSWORD = "change-password"  # noqa: S105
    CHANGE_USERS = "change-users"
    """Accounts and credentials of others. This right allows creating an account to come back with."""


NEEDS: Final[Mapping[Action, frozenset[Scope]]] = {
    Action.KNOW_ONESELF: frozenset(),
    Action.SEE_SQUAD: frozenset({Scope.WATCH}),
    Action.SEE_DRONE: frozenset({Scope.WATCH}),
    Action.FLY: frozenset({Scope.FLY}),
    Action.COMMAND: frozenset({Scope.FLY, Scope.ADMIN}),
    Action.ADMINISTER: frozenset({Scope.ADMIN}),
    Action.READ_METRICS: frozenset({Scope.METRICS}),
    Action.HOLD_SEVERAL: frozenset({Scope.FLY}),
    Action.MANAGE_TEAMS: frozenset({Scope.ADMIN}),
    Action.LEAD_TEAMS: frozenset({Scope.ADMIN}),
    Action.SEE_MISSIONS: frozenset({Scope.WATCH}),
    Action.CHANGE_MISSIONS: frozenset({Scope.FLY}),
    Action.SHARE_WITH_EVERYBODY: frozenset({Scope.FLY}),
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


class Reach(StrEnum):
    """How far a role reaches with an action."""

    NONE = "none"
    OWN = "own"
    """Own objects: sessions, tokens, missions, teams, and the drones with a relation to the user (`RIGHTS` says
    how)."""
    ALL = "all"


_NONE, _OWN, _ALL = Reach.NONE, Reach.OWN, Reach.ALL
_ROLES: Final = (Role.ADMIN, Role.OPERATOR, Role.OBSERVER)


def _row(*reaches: Reach) -> Mapping[Role, Reach]:
    return dict(zip(_ROLES, reaches, strict=True))


REACH: Final[Mapping[Action, Mapping[Role, Reach]]] = {
    #                                  admin operator observer
    Action.KNOW_ONESELF: _row(_OWN, _OWN, _OWN),
    Action.SEE_SQUAD: _row(_ALL, _OWN, _OWN),
    Action.SEE_DRONE: _row(_ALL, _OWN, _OWN),
    Action.FLY: _row(_ALL, _OWN, _NONE),
    Action.COMMAND: _row(_ALL, _OWN, _NONE),
    Action.HOLD_SEVERAL: _row(_ALL, _NONE, _NONE),
    Action.ADMINISTER: _row(_ALL, _NONE, _NONE),
    Action.READ_METRICS: _row(_ALL, _NONE, _NONE),
    Action.CHANGE_USERS: _row(_ALL, _NONE, _NONE),
    Action.MANAGE_TEAMS: _row(_ALL, _OWN, _OWN),
    Action.LEAD_TEAMS: _row(_ALL, _OWN, _NONE),
    Action.SEE_MISSIONS: _row(_ALL, _OWN, _OWN),
    Action.CHANGE_MISSIONS: _row(_ALL, _OWN, _NONE),
    Action.SHARE_WITH_EVERYBODY: _row(_ALL, _NONE, _NONE),
    Action.SEE_CREDENTIALS: _row(_ALL, _OWN, _OWN),
    Action.CHANGE_CREDENTIALS: _row(_ALL, _OWN, _OWN),
    Action.PROVE_ONESELF: _row(_OWN, _OWN, _OWN),
    Action.SET_UP_SECOND_FACTOR: _row(_OWN, _OWN, _OWN),
    Action.CHANGE_PREFERENCES: _row(_OWN, _OWN, _OWN),
    Action.CHANGE_PASSWORD: _row(_OWN, _OWN, _OWN),
}
"""Every action has a row, every role a column: tests/unit/server/test_server_access.py has it a second time."""


TOKEN_SCOPES: Final[Mapping[Role, frozenset[Scope]]] = {
    Role.ADMIN: frozenset(Scope),
    Role.OPERATOR: frozenset({Scope.WATCH, Scope.FLY}),
    Role.OBSERVER: frozenset({Scope.WATCH}),
}
"""What a new API token of such an account may be for."""


def reach_of(role: Role, action: Action) -> Reach:
    """How far an account of this role gets with it. What its sign-in allows is another question (`judge`)."""
    return REACH[action][role]


def reaches(principal: Principal, action: Action, owner: UserId) -> bool:
    """Whether this user's account may do so with what is `owner`'s: a session, a token, a mission."""
    reach = REACH[action][principal.role]
    return reach is Reach.ALL or (reach is Reach.OWN and owner == principal.user_id)


def reaches_all(role: Role, action: Action) -> bool:
    """Whether it may do so with everybody's."""
    return REACH[action][role] is Reach.ALL


def is_demanded_a_factor(role: Role) -> bool:
    """Whether a tower with TOWER_ADMINS_NEED_SECOND_FACTOR demands a second factor of such an account."""
    return reaches_all(role, Action.ADMINISTER)


def roles_with(action: Action, reach: Reach) -> list[str]:
    """Whose reach that is, as the database writes it: for a condition of a query."""
    return [role.value for role, found in REACH[action].items() if found is reach]


def refusals_for_roles(action: Action) -> Sequence[type[AdminsOnly] | type[ReadOnlyAccount]]:
    """With what an account is refused that gets nowhere with it; empty where each gets somewhere."""
    reaches = set(REACH[action].values())
    if Reach.NONE not in reaches:
        return ()
    return (ReadOnlyAccount,) if Reach.OWN in reaches else (AdminsOnly,)


@dataclass(frozen=True)
class AccessRequest:
    """`relation`: to the drone in question; None if there is no such drone, or no drone is in question. `everybody`:
    for a list of all users' objects. `now`: for actions that need a fresh proof; without it no proof is fresh."""

    principal: Principal
    action: Action
    relation: Relation | None = None
    everybody: bool = False
    now: datetime | None = None


@dataclass(frozen=True)
class Verdict:
    refusal: Refusal | None = None

    @property
    def allowed(self) -> bool:
        return self.refusal is None


def judge(request: AccessRequest) -> Verdict:
    """The sign-in first, then the account, then the object."""
    principal, action = request.principal, request.action
    refusal = _why_not_so_signed_in(principal, action) or _why_not_with_reach(request)
    if refusal is not None:
        return Verdict(refusal)
    if action in WITH_FRESH_PROOF and (request.now is None or not is_fresh(principal.proved_at, request.now)):
        return Verdict(ProofNeeded())
    if action is Action.SEE_DRONE and (request.relation is None or not may(request.relation, Right.SEE)):
        return Verdict(UnknownDrone())
    return Verdict()  # what else may be done with a drone, and who has its controls, is decided where that is known


def _why_not_so_signed_in(principal: Principal, action: Action) -> Refusal | None:
    if principal.must_change_password and action not in WITH_ANY_PASSWORD:
        return PasswordChangeNeeded()
    if principal.must_add_second_factor and action not in WITHOUT_DEMANDED_FACTOR:
        return SecondFactorDemanded()
    missing = NEEDS[action] - principal.scopes
    if missing:
        return ScopeMissing(missing)
    if action in IN_PERSON and not principal.in_person:
        return InPersonOnly()
    return None


def _why_not_with_reach(request: AccessRequest) -> Refusal | None:
    reach = reach_of(request.principal.role, request.action)
    if reach is Reach.ALL:
        return None
    if reach is Reach.NONE:
        return refusals_for_roles(request.action)[0]()
    return AdminsOnly() if request.everybody else None
