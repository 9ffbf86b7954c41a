"""How a user relates to a drone, and what that allows: one table for REST, WebSocket, UDP, video and leases alike.

`access.py` has the other table: what an account may do apart from drones.

Pure: no database and no live state. The caller passes the owners, borrowers and team of the drone (`Ties`);
`relation_of` returns the strongest relation, and `may` looks it up in `RIGHTS`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from server.kernel.people import Role
from wire.ids import UserId


class TeamRole(StrEnum):
    """The role of a member in a team."""

    OBSERVER = "observer"
    OPERATOR = "operator"
    ADMIN = "admin"


class Relation(StrEnum):
    """From the strongest to the weakest: a user with two relations has the stronger one."""

    ADMIN = "admin"
    """An admin of the tower, whoever owns the drone."""
    TEAM_ADMIN = "team-admin"
    OWNER = "owner"
    TEAM_OPERATOR = "team-operator"
    BORROWER = "borrower"
    OBSERVER = "observer"
    """An observer of its team, or an account that only watches and has the drone for any reason."""
    STRANGER = "stranger"


class Right(StrEnum):
    """What a user can do with one drone."""

    SEE = "see"
    """Its state, its position, its frames, its live video."""
    READ = "read"
    """Its stored files (recordings, flight logs), and requests to the drone itself."""
    FLY = "fly"
    """Have its controls and send what needs them; say "stay"."""
    TAKE = "take"
    """Take control from another user, give it back, assist."""
    ERASE = "erase"
    """Delete its stored files."""
    LEND = "lend"
    RECORD = "record"
    """Start and end recordings of its video."""
    REHEARSE = "rehearse"
    """Rehearse the loss of the operator or of the tower."""
    ACKNOWLEDGE = "acknowledge"
    """Acknowledge its alerts. Everybody who sees the drone sees them."""
    CHECKLIST = "checklist"
    """Change its own lines of the preflight checklist."""
    MAINTAIN = "maintain"
    """Say what maintenance the drone needs, and that it was done. Whoever may read its flights sees what is due."""
    RESTRAIN = "restrain"
    """Mute, limit or quarantine it."""
    CANCEL = "cancel"
    """Cancel another user's operation. The user with the controls and the turn may do so as well."""


_TOWER_ADMINS: Final = frozenset({Relation.ADMIN})
_ADMINS: Final = _TOWER_ADMINS | {Relation.TEAM_ADMIN}
_PILOTS: Final = _ADMINS | {Relation.OWNER, Relation.TEAM_OPERATOR, Relation.BORROWER}

RIGHTS: Final[Mapping[Right, frozenset[Relation]]] = {
    Right.SEE: _PILOTS | {Relation.OBSERVER},
    Right.READ: _PILOTS,
    Right.FLY: _PILOTS,
    Right.TAKE: _ADMINS,
    Right.ERASE: _ADMINS | {Relation.OWNER},
    Right.LEND: _ADMINS,
    Right.RESTRAIN: _ADMINS,
    Right.RECORD: _TOWER_ADMINS,
    Right.REHEARSE: _TOWER_ADMINS,
    Right.CHECKLIST: _ADMINS | {Relation.OWNER},
    Right.MAINTAIN: _ADMINS | {Relation.OWNER},
    Right.CANCEL: _TOWER_ADMINS,
    Right.ACKNOWLEDGE: _PILOTS,
}
"""Who has which right. A stranger has none: to them the drone does not exist. Everything else (settings, credentials,
owners, names) is for admins of the tower alone."""

OF_THE_HOLDER: Final = frozenset({Right.RECORD, Right.REHEARSE})
"""Rights that the holder has as well."""


@dataclass(frozen=True)
class Ties:
    """The people related to a drone. `crew`: the members of its team."""

    owners: frozenset[UserId] = frozenset()
    borrowers: frozenset[UserId] = frozenset()
    crew: Mapping[UserId, TeamRole] = field(default_factory=dict)


def relation_of(ties: Ties, user_id: UserId, role: Role) -> Relation:
    """Returns the strongest relation of this user, whose account has this role, to the drone."""
    if role is Role.ADMIN:
        return Relation.ADMIN
    relation = relation_by_ties(ties, user_id)
    if role is Role.OBSERVER and relation is not Relation.STRANGER:
        return Relation.OBSERVER
    return relation


def relation_by_ties(ties: Ties, user_id: UserId) -> Relation:
    """The relation by the drone's people alone, regardless of the account's role."""
    team_role = ties.crew.get(user_id)
    if team_role is TeamRole.ADMIN:
        return Relation.TEAM_ADMIN
    if user_id in ties.owners:
        return Relation.OWNER
    if team_role is TeamRole.OPERATOR:
        return Relation.TEAM_OPERATOR
    if user_id in ties.borrowers:
        return Relation.BORROWER
    return Relation.OBSERVER if team_role is TeamRole.OBSERVER else Relation.STRANGER


def may(relation: Relation, right: Right, *, holds: bool = False) -> bool:
    """Whether a user with this relation to a drone has this right. `holds`: the user has its controls."""
    return relation in RIGHTS[right] or (holds and right in OF_THE_HOLDER)
