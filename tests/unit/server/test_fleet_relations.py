"""Permissions for a drone: an independent copy of the table, and each person's relation to the drone."""

from itertools import product

import pytest

from server.kernel.people import Role
from server.kernel.relations import (
    RIGHTS,
    Relation,
    Right,
    TeamRole,
    Ties,
    may,
    relation_by_ties,
    relation_of,
)
from wire.ids import UserId

# For each relation in turn, from the tower's admin to the stranger.
ROWS = {
    Right.SEE: "+ + + + + + -",
    Right.READ: "+ + + + + - -",
    Right.FLY: "+ + + + + - -",
    Right.TAKE: "+ + - - - - -",
    Right.ERASE: "+ + + - - - -",
    Right.LEND: "+ + - - - - -",
    Right.RESTRAIN: "+ + - - - - -",
    Right.RECORD: "+ - - - - - -",
    Right.REHEARSE: "+ - - - - - -",
    Right.CHECKLIST: "+ + + - - - -",
    Right.MAINTAIN: "+ + + - - - -",
    Right.CANCEL: "+ - - - - - -",
    Right.ACKNOWLEDGE: "+ + + + + - -",
}
ME, OTHER = UserId(1), UserId(2)


@pytest.mark.parametrize(("right", "relation"), list(product(Right, Relation)))
def test_the_table(right: Right, relation: Relation) -> None:
    row = dict(zip(Relation, ROWS[right].split(), strict=True))
    assert may(relation, right) is (row[relation] == "+")


@pytest.mark.parametrize(("right", "relation"), list(product(Right, Relation)))
def test_the_holder_may_record_and_rehearse_too(right: Right, relation: Relation) -> None:
    assert may(relation, right, holds=True) is (may(relation, right) or right in {Right.RECORD, Right.REHEARSE})


def test_there_is_no_right_beside_the_table() -> None:
    assert set(RIGHTS) == set(Right) == set(ROWS)


@pytest.mark.parametrize(
    ("owns", "borrows", "team", "relation"),
    [
        (False, False, None, Relation.STRANGER),
        (True, False, None, Relation.OWNER),
        (False, True, None, Relation.BORROWER),
        (True, True, None, Relation.OWNER),
        (False, False, TeamRole.OBSERVER, Relation.OBSERVER),
        (False, True, TeamRole.OBSERVER, Relation.BORROWER),
        (True, False, TeamRole.OBSERVER, Relation.OWNER),
        (False, False, TeamRole.OPERATOR, Relation.TEAM_OPERATOR),
        (False, True, TeamRole.OPERATOR, Relation.TEAM_OPERATOR),
        (True, False, TeamRole.OPERATOR, Relation.OWNER),
        (False, False, TeamRole.ADMIN, Relation.TEAM_ADMIN),
        (True, True, TeamRole.ADMIN, Relation.TEAM_ADMIN),
    ],
)
def test_the_strongest_counts(owns: bool, borrows: bool, team: TeamRole | None, relation: Relation) -> None:
    ties = Ties(
        owners=frozenset({OTHER} | ({ME} if owns else set())),
        borrowers=frozenset({ME} if borrows else ()),
        crew={OTHER: TeamRole.ADMIN} | ({ME: team} if team else {}),
    )
    assert relation_of(ties, ME, Role.OPERATOR) is relation_by_ties(ties, ME) is relation
    given = relation is not Relation.STRANGER
    assert relation_of(ties, ME, Role.OBSERVER) is (Relation.OBSERVER if given else Relation.STRANGER)
    assert relation_of(ties, ME, Role.ADMIN) is Relation.ADMIN


def test_a_stronger_relation_never_has_fewer_rights() -> None:
    for stronger, weaker in zip(list(Relation), list(Relation)[1:], strict=False):
        assert {right for right in Right if may(weaker, right)} <= {right for right in Right if may(stronger, right)}
