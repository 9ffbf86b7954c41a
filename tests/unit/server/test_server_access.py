"""The judgement at the door, origins, names and passwords: the rules without a socket."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from server.access import AccessRequest, Action, AdminsOnly, InPersonOnly, ScopeMissing, UnknownDrone, judge
from server.accounts.passwords import BadPassword, check_password, generate_password
from server.accounts.scopes import Scope
from server.accounts.sessions import Principal, TokenId
from server.accounts.tables import Role
from server.names import BadName, clean_name, name_key
from server.origin import origin_matches
from wire.ids import UserId

ADMIN = Principal(UserId(1), "Root", Role.ADMIN, 1, datetime(2030, 1, 1, tzinfo=UTC))
OPERATOR = Principal(UserId(2), "Anna", Role.OPERATOR, 2, datetime(2030, 1, 1, tzinfo=UTC))
SEE, RULE = Action.SEE_DRONE, Action.ADMINISTER


@pytest.mark.parametrize(
    ("who", "action", "owner_ids", "refusal"),
    [
        (ADMIN, SEE, frozenset(), None),
        (ADMIN, SEE, frozenset({2}), None),
        (ADMIN, SEE, None, UnknownDrone),
        (OPERATOR, SEE, frozenset({2, 3}), None),
        (OPERATOR, SEE, frozenset({3}), UnknownDrone),
        (OPERATOR, SEE, frozenset(), UnknownDrone),
        (OPERATOR, SEE, None, UnknownDrone),
        (ADMIN, RULE, None, None),
        (OPERATOR, RULE, None, AdminsOnly),
        (OPERATOR, RULE, frozenset({2}), AdminsOnly),
    ],
)
def test_the_matrix(who: Principal, action: Action, owner_ids: frozenset[int] | None, refusal: type | None) -> None:
    verdict = judge(AccessRequest(who, action, owner_ids))  # type: ignore[arg-type]
    assert verdict.allowed is (refusal is None)
    assert (type(verdict.refusal) if verdict.refusal else None) is refusal


@pytest.mark.parametrize(
    ("scopes", "action", "for_operator", "for_admin"),
    [
        ("", Action.KNOW_ONESELF, None, None),
        ("watch", Action.SEE_SQUAD, None, None),
        ("fly admin metrics", Action.SEE_SQUAD, ScopeMissing, ScopeMissing),
        ("watch fly", Action.FLY, None, None),
        ("watch admin", Action.FLY, ScopeMissing, ScopeMissing),
        ("fly", Action.COMMAND, ScopeMissing, ScopeMissing),
        ("admin", Action.COMMAND, ScopeMissing, ScopeMissing),
        ("fly admin", Action.COMMAND, None, None),  # the table of control says no to an operator
        ("admin", Action.ADMINISTER, AdminsOnly, None),
        ("watch fly metrics", Action.ADMINISTER, ScopeMissing, ScopeMissing),
        ("metrics", Action.READ_METRICS, AdminsOnly, None),
        ("admin", Action.READ_METRICS, ScopeMissing, ScopeMissing),
        ("admin fly metrics watch", Action.LOOK_AFTER_TOKENS, InPersonOnly, InPersonOnly),
        ("admin fly metrics watch", Action.CHANGE_PREFERENCES, InPersonOnly, InPersonOnly),
    ],
)
def test_a_token_is_for_its_scopes_and_no_more_than_its_owner(
    scopes: str, action: Action, for_operator: type | None, for_admin: type | None
) -> None:
    chosen = frozenset(Scope(word) for word in scopes.split())
    for owner, refusal in ((OPERATOR, for_operator), (ADMIN, for_admin)):
        with_token = replace(owner, session_id=TokenId(3), scopes=chosen)
        found = judge(AccessRequest(with_token, action)).refusal
        assert (type(found) if found else None) is refusal
    assert judge(AccessRequest(ADMIN, action)).allowed


def test_not_yours_and_not_there_have_the_same_words() -> None:
    theirs = judge(AccessRequest(OPERATOR, SEE, frozenset({UserId(3)})))
    missing = judge(AccessRequest(OPERATOR, SEE, None))
    assert str(theirs.refusal) == str(missing.refusal)


@pytest.mark.parametrize(
    ("origin", "host", "public_url", "same"),
    [
        (None, "tower:8000", "", True),
        ("http://tower:8000", "tower:8000", "", True),
        ("https://tower", "tower", "", True),
        ("https://tower", "tower:443", "", True),
        ("http://TOWER", "tower:80", "", True),
        ("http://[::1]:8000", "[::1]:8000", "", True),
        ("https://tower", "inner:8000", "https://tower", True),
        ("http://tower", "inner:8000", "https://tower", False),
        ("http://tower:8001", "tower:8000", "", False),
        ("http://evil", "tower", "", False),
        ("http://tower.evil", "tower", "", False),
        ("http://evil@tower.evil", "tower", "", False),
        ("null", "tower", "", False),
        ("", "tower", "", False),
        ("file://tower", "tower", "", False),
        ("http://tower:port", "tower", "", False),
        ("http://tower", "", "", False),
    ],
)
def test_origins(origin: str | None, host: str, public_url: str, same: bool) -> None:
    assert origin_matches(origin=origin, host=host, public_url=public_url) is same


@pytest.mark.parametrize(("one", "other"), [("Anna", "ANNA"), ("straße", "STRASSE"), ("ﬁn", "fin"), ("Ａ", "a")])
def test_names_that_are_the_same(one: str, other: str) -> None:
    assert name_key(one) == name_key(other)


def test_names_are_trimmed_and_composed() -> None:
    assert clean_name("  Zoe\u0308 ") == "Zoë"
    assert clean_name("x" * 64) == "x" * 64


@pytest.mark.parametrize("text", ["", "  ", "x" * 65, "a\tb", "a\x1b[31mb", "a\u202eb", "a\u200bb", "a\ud800"])
def test_what_is_no_name(text: str) -> None:
    with pytest.raises(BadName):
        clean_name(text)


def test_the_password_rule() -> None:
    for good in ("12345678", "ü" * 8, " " * 8, "x" * 256, generate_password()):
        check_password(good)
    for bad in ("", "1234567", "x" * 257):
        with pytest.raises(BadPassword):
            check_password(bad)


def test_generated_passwords_differ() -> None:
    assert len({generate_password() for _ in range(50)}) == 50
