"""Who may do what: one access check for REST, WebSocket, UDP and video alike.

Three tables decide; nothing else compares roles:
- `NEEDS`: the scopes that an action needs. A session has every scope, an API token those it was created with.
- `REACH`: how far each role of an account reaches with an action: nowhere, own objects, or all objects.
- `RIGHTS` in `server.kernel.relations`: what a relation to a drone allows.

`judge` checks all three at the start of a request. `reaches` checks one object; `reach_of` tells whether a list or
query covers all objects or only the user's own; `roles_with` is the inverse, for an SQL condition.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final

from server.kernel.people import Principal, Role
from server.kernel.refusal import Refusal
from server.kernel.relations import Relation, Right, may
from server.kernel.scopes import Scope
from wire.ids import UserId

PROOF_MAX_AGE: Final = timedelta(minutes=5)


class ProofNeeded(Refusal):
    """The last proof of identity is too old for this action."""

    def __init__(self) -> None:
        super().__init__("confirm your identity first: this needs a proof from the last 5 minutes")


def is_fresh(proved_at: datetime | None, now: datetime) -> bool:
    """A proof from the future (the clock was set back) does not count."""
    return proved_at is not None and proved_at <= now < proved_at + PROOF_MAX_AGE


class NotSignedIn(Refusal):
    """The request carries neither a session cookie nor a token."""

    def __init__(self) -> None:
        super().__init__("sign in first")


class SessionExpired(Refusal):
    """The session of the request's cookie has ended."""

    def __init__(self) -> None:
        super().__init__("the session has ended: sign in again")


class BadToken(Refusal):
    """The token of the request is invalid: unknown, expired or revoked. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("this token is not valid: it may have expired or been revoked")


class ScopeMissing(Refusal):
    """The token lacks the scope."""

    def __init__(self, missing: Collection[Scope]) -> None:
        super().__init__(f"this token does not allow that: it lacks the scope {' and '.join(sorted(missing))}")


class InPersonOnly(Refusal):
    """A token cannot manage tokens, sessions, passwords, users or keys of drones, nor change how its owner's sticks
    are read."""

    def __init__(self) -> None:
        super().__init__("this needs a person: sign in with name and password, not with a token")


class PasswordChangeNeeded(Refusal):
    """Another person knows the password."""

    def __init__(self) -> None:
        super().__init__("choose a password of your own first")


class SecondFactorDemanded(Refusal):
    """The tower requires a second factor of admins, and this admin has none."""

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
    """The drone does not exist, or this user may not see it."""

    def __init__(self) -> None:
        super().__init__("there is no such drone")


class Action(StrEnum):
    KNOW_ONESELF = "know-oneself"
    SEE_SQUAD = "see-squad"
    SEE_DRONE = "see-drone"
    FLY = "fly"
    COMMAND = "command"
    """Take control from another user, give it back, assist. Users with reach ALL outrank all others."""
    HOLD_SEVERAL = "hold-several"
    """Have the controls of more than one drone at a time."""
    ADMINISTER = "administer"
    READ_METRICS = "read-metrics"
    CHANGE_PREFERENCES = "change-preferences"
    MANAGE_TEAMS = "look-after-teams"
    """Be in teams: see them, join and leave. A user's own teams are those they belong to."""
    LEAD_TEAMS = "lead-teams"
    """Create teams, change them, lend their drones. Which teams is decided where the members are known."""
    SEE_MISSIONS = "see-missions"
    """In the library, which decides what shared missions the user may see."""
    CHANGE_MISSIONS = "change-missions"
    SHARE_WITH_EVERYBODY = "share-with-everybody"
    """Missions that they share are visible beyond their teams."""
    SEE_CREDENTIALS = "see-credentials"
    """See which tokens, sessions and factors exist."""
    PROVE_ONESELF = "prove-oneself"
    CHANGE_CREDENTIALS = "change-credentials"
    """Tokens, sessions and the second factor."""
    SET_UP_SECOND_FACTOR = "set-up-second-factor"
    CHANGE_PASSWORD = "change-password"  # noqa: S105
    CHANGE_USERS = "change-users"
    """Accounts and credentials of others: with this right one can create an account to return with."""
    CHANGE_DRONE_KEYS = "change-drone-keys"
    """Enrol an agent, or revoke a drone's key: with this right one can speak for a drone in its agent's place."""


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
    Action.CHANGE_DRONE_KEYS: frozenset(),
}
"""The scopes that a token must have, all of them. A session has every scope."""


WITH_ANY_PASSWORD: Final = frozenset({Action.KNOW_ONESELF, Action.PROVE_ONESELF, Action.CHANGE_PASSWORD})
"""Actions allowed before the first password is changed."""


WITHOUT_DEMANDED_FACTOR: Final = WITH_ANY_PASSWORD | {Action.SEE_CREDENTIALS, Action.SET_UP_SECOND_FACTOR}
"""Actions allowed to an admin who needs a second factor and has none."""


IN_PERSON: Final = frozenset(
    {
        Action.SET_UP_SECOND_FACTOR,
        Action.SEE_CREDENTIALS,
        Action.PROVE_ONESELF,
        Action.CHANGE_CREDENTIALS,
        Action.CHANGE_PREFERENCES,
        Action.CHANGE_PASSWORD,
        Action.CHANGE_USERS,
        Action.CHANGE_DRONE_KEYS,
    }
)
"""Actions that need a session; no token allows them, whatever its scopes."""


WITH_FRESH_PROOF: Final = frozenset(
    {
        Action.CHANGE_CREDENTIALS,
        Action.SET_UP_SECOND_FACTOR,
        Action.CHANGE_PASSWORD,
        Action.CHANGE_USERS,
        Action.CHANGE_DRONE_KEYS,
    }
)
"""Actions for which a stolen cookie is not enough: see `server/accounts/store/reauthentication.py`."""


class Reach(StrEnum):
    """How far a role reaches with an action."""

    NONE = "none"
    OWN = "own"
    """The user's own sessions, tokens, missions and teams, and the drones that the user has a relation to
    (`RIGHTS`)."""
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
    Action.CHANGE_DRONE_KEYS: _row(_ALL, _NONE, _NONE),
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
"""Every action has a row, every role a column: tests/unit/server/test_server_access.py contains a second copy."""


TOKEN_SCOPES: Final[Mapping[Role, frozenset[Scope]]] = {
    Role.ADMIN: frozenset(Scope),
    Role.OPERATOR: frozenset({Scope.WATCH, Scope.FLY}),
    Role.OBSERVER: frozenset({Scope.WATCH}),
}
"""The scopes that a new API token of such an account may have."""


def reach_of(role: Role, action: Action) -> Reach:
    """How far an account of this role reaches with an action. What the sign-in allows is checked in `judge`."""
    return REACH[action][role]


def reaches(principal: Principal, action: Action, owner: UserId) -> bool:
    """Whether this user's account may perform the action on an object of `owner`: a session, a token, a mission."""
    reach = REACH[action][principal.role]
    return reach is Reach.ALL or (reach is Reach.OWN and owner == principal.user_id)


def reaches_all(role: Role, action: Action) -> bool:
    """Whether the role may perform the action on the objects of all users."""
    return REACH[action][role] is Reach.ALL


def is_demanded_a_factor(role: Role) -> bool:
    """Whether a tower with TOWER_ADMINS_NEED_SECOND_FACTOR requires a second factor of such an account."""
    return reaches_all(role, Action.ADMINISTER)


def roles_with(action: Action, reach: Reach) -> list[str]:
    """Roles with that reach, as stored in the database: for a condition of a query."""
    return [role.value for role, found in REACH[action].items() if found is reach]


def refusals_for_roles(action: Action) -> Sequence[type[AdminsOnly] | type[ReadOnlyAccount]]:
    """The refusals of roles that cannot perform the action at all; empty if every role can."""
    reaches = set(REACH[action].values())
    if Reach.NONE not in reaches:
        return ()
    return (ReadOnlyAccount,) if Reach.OWN in reaches else (AdminsOnly,)


@dataclass(frozen=True)
class AccessRequest:
    """`relation`: to the drone concerned; None if the drone does not exist, or no drone is concerned.

    `everybody`: the request is for a list that covers all users.
    `now`: for actions that need a fresh proof; without it no proof is fresh.
    """

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
    """Checks the sign-in first, then the account, then the object."""
    principal, action = request.principal, request.action
    refusal = _why_not_so_signed_in(principal, action) or _why_not_with_reach(request)
    if refusal is not None:
        return Verdict(refusal)
    if action in WITH_FRESH_PROOF and (request.now is None or not is_fresh(principal.proved_at, request.now)):
        return Verdict(ProofNeeded())
    if action is Action.SEE_DRONE and (request.relation is None or not may(request.relation, Right.SEE)):
        return Verdict(UnknownDrone())
    return Verdict()  # other rights to a drone, and who holds it, are checked where they are known


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
