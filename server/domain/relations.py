"""A user's relation to a drone and what it allows: the one table for REST, WebSocket, UDP, video and leases.

`access.py` has the other table: what an account may do that concerns no drone. Pure: knows no database and no live
state. The caller passes owners, loans and team of the drone (`Ties`); `relation_of` returns the strongest relation, and
`may` looks it up in `RIGHTS`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from server.domain.people import Role
from wire.ids import UserId


class TeamRole(StrEnum):
    """The role of a team member."""

    OBSERVER = "observer"
    OPERATOR = "operator"
    ADMIN = "admin"


class Relation(StrEnum):
    """From the strongest to the weakest; the stronger one of two applies."""

    ADMIN = "admin"
    """An admin of the tower, whoever owns the drone."""
    TEAM_ADMIN = "team-admin"
    OWNER = "owner"
    TEAM_OPERATOR = "team-operator"
    BORROWER = "borrower"
    OBSERVER = "observer"
    """An observer in its team, or an account that only watches and was given the drone."""
    STRANGER = "stranger"


class Right(StrEnum):
    """What can be done with one drone."""

    SEE = "see"
    """Its state, its place, its frames, its live video."""
    READ = "read"
    """What is kept of it (recordings, flight logs), and asking the drone itself for something."""
    FLY = "fly"
    """Have the controls, and what comes with them; say "stay"."""
    TAKE = "take"
    """Take the controls from somebody, give them back, assist."""
    ERASE = "erase"
    """Delete what is kept of it."""
    LEND = "lend"
    RECORD = "record"
    """Begin and end recordings of its video."""
    REHEARSE = "rehearse"
    """Rehearse the loss of the operator or of the tower."""
    CANCEL = "cancel"
    """Stop an operation of somebody else. The holder with the turn may as well."""


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
    Right.RECORD: _TOWER_ADMINS,
    Right.REHEARSE: _TOWER_ADMINS,
    Right.CANCEL: _TOWER_ADMINS,
}
"""Who has which right. A stranger has none: to them the drone does not exist. What is not here (settings, credentials,
owners, names) is for admins of the tower alone."""

OF_THE_HOLDER: Final = frozenset({Right.RECORD, Right.REHEARSE})
"""What the holder of the controls may do as well."""


@dataclass(frozen=True)
class Ties:
    """Whom a drone has to do with. `crew`: the members of its team."""

    owners: frozenset[UserId] = frozenset()
    borrowers: frozenset[UserId] = frozenset()
    crew: Mapping[UserId, TeamRole] = field(default_factory=dict)


def relation_of(ties: Ties, user_id: UserId, role: Role) -> Relation:
    """The strongest relation of this user, whose account has this role, to the drone."""
    if role is Role.ADMIN:
        return Relation.ADMIN
    relation = relation_by_ties(ties, user_id)
    if role is Role.OBSERVER and relation is not Relation.STRANGER:
        return Relation.OBSERVER
    return relation


def relation_by_ties(ties: Ties, user_id: UserId) -> Relation:
    """The same by the drone's people alone, whatever the account."""
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
    """Whether this relation to a drone has this right. `holds`: the user has its controls."""
    return relation in RIGHTS[right] or (holds and right in OF_THE_HOLDER)
