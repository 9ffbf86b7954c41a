"""How a user stands to a drone, and what that allows: the one table for REST, WebSocket, UDP, video and leases alike.

Pure: it knows no database and no live state. Whoever asks says who owns the drone, to whom it is lent and which team
it belongs to (`Ties`); `relation_of` answers with the strongest relation, and `may` looks it up in `RIGHTS`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from server.domain.people import Role
from wire.ids import UserId


class TeamRole(StrEnum):
    """What a member of a team is."""

    OBSERVER = "observer"
    OPERATOR = "operator"
    ADMIN = "admin"


class Relation(StrEnum):
    """From the strongest to the weakest: somebody who stands in two has the stronger one."""

    ADMIN = "admin"
    """An admin of the tower, whoever owns the drone."""
    TEAM_ADMIN = "team-admin"
    OWNER = "owner"
    TEAM_OPERATOR = "team-operator"
    BORROWER = "borrower"
    OBSERVER = "observer"
    STRANGER = "stranger"


class Right(StrEnum):
    """What can be done with one drone."""

    SEE = "see"
    """Its state, its place, its frames, its live video."""
    READ = "read"
    """What is kept of it (recordings, flight logs), and asking the drone itself for something."""
    FLY = "fly"
    """Have its controls, and what comes with them; say "stay"."""
    TAKE = "take"
    """Take the controls from somebody, give them back, assist."""
    ERASE = "erase"
    """Delete what is kept of it."""
    LEND = "lend"


_ADMINS: Final = frozenset({Relation.ADMIN, Relation.TEAM_ADMIN})
_PILOTS: Final = _ADMINS | {Relation.OWNER, Relation.TEAM_OPERATOR, Relation.BORROWER}

RIGHTS: Final[Mapping[Right, frozenset[Relation]]] = {
    Right.SEE: _PILOTS | {Relation.OBSERVER},
    Right.READ: _PILOTS,
    Right.FLY: _PILOTS,
    Right.TAKE: _ADMINS,
    Right.ERASE: _ADMINS | {Relation.OWNER},
    Right.LEND: _ADMINS,
}
"""Who has which right. A stranger has none: to them the drone does not exist. What is not here (settings, credentials,
owners, names) is for admins of the tower alone."""


@dataclass(frozen=True)
class Ties:
    """Whom a drone has to do with. `crew`: the members of its team."""

    owners: frozenset[UserId] = frozenset()
    borrowers: frozenset[UserId] = frozenset()
    crew: Mapping[UserId, TeamRole] = field(default_factory=dict)


def relation_of(ties: Ties, user_id: UserId, role: Role) -> Relation:
    """The strongest in which this user stands to the drone."""
    if role is Role.ADMIN:
        return Relation.ADMIN
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


def may(relation: Relation, right: Right) -> bool:
    """Whether somebody who stands so to a drone has this right."""
    return relation in RIGHTS[right]
