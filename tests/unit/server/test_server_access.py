"""Authorisation, origins, names and passwords: the rules without a socket."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import product

import pytest

from server.accounts.store.passwords import generate_password
from server.http.origin import origin_matches
from server.kernel.access import (
    WITH_FRESH_PROOF,
    WITHOUT_DEMANDED_FACTOR,
    AccessRequest,
    Action,
    AdminsOnly,
    InPersonOnly,
    ProofNeeded,
    Reach,
    ReadOnlyAccount,
    ScopeMissing,
    SecondFactorDemanded,
    UnknownDrone,
    is_fresh,
    judge,
    reach_of,
    reaches,
    refusals_for_roles,
    roles_with,
)
from server.kernel.names import BadName, clean_name, name_key
from server.kernel.people import Principal, Role, TokenId
from server.kernel.relations import Relation
from server.kernel.scopes import Scope
from wire.ids import UserId

ADMIN = Principal(UserId(1), "Root", Role.ADMIN, 1, datetime(2030, 1, 1, tzinfo=UTC))
OPERATOR = Principal(UserId(2), "Anna", Role.OPERATOR, 2, datetime(2030, 1, 1, tzinfo=UTC))
OBSERVER = Principal(UserId(3), "Olga", Role.OBSERVER, 3, datetime(2030, 1, 1, tzinfo=UTC))
SEE, RULE = Action.SEE_DRONE, Action.ADMINISTER


@pytest.mark.parametrize(
    ("who", "action", "relation", "refusal"),
    [
        (ADMIN, SEE, Relation.ADMIN, None),
        (ADMIN, SEE, None, UnknownDrone),
        (OPERATOR, SEE, Relation.OWNER, None),
        (OPERATOR, SEE, Relation.OBSERVER, None),
        (OPERATOR, SEE, Relation.STRANGER, UnknownDrone),
        (OPERATOR, SEE, None, UnknownDrone),
        (ADMIN, RULE, None, None),
        (OPERATOR, RULE, None, AdminsOnly),
        (OPERATOR, RULE, Relation.TEAM_ADMIN, AdminsOnly),
        (OBSERVER, SEE, Relation.OBSERVER, None),
        (OBSERVER, SEE, Relation.STRANGER, UnknownDrone),
        (OBSERVER, SEE, None, UnknownDrone),
        (OBSERVER, RULE, None, AdminsOnly),
        (OBSERVER, Action.FLY, Relation.OBSERVER, ReadOnlyAccount),
        (OBSERVER, Action.COMMAND, Relation.OBSERVER, ReadOnlyAccount),
        (OBSERVER, Action.CHANGE_MISSIONS, None, ReadOnlyAccount),
        (OBSERVER, Action.LEAD_TEAMS, None, ReadOnlyAccount),
        (OBSERVER, Action.MANAGE_TEAMS, None, None),
    ],
)
def test_the_matrix(who: Principal, action: Action, relation: Relation | None, refusal: type | None) -> None:
    verdict = judge(AccessRequest(who, action, relation))
    assert verdict.allowed is (refusal is None)
    assert (type(verdict.refusal) if verdict.refusal else None) is refusal


# For admin, operator and observer in turn: all drones, their own, none. An independent copy.
REACHES = {
    Action.KNOW_ONESELF: "own own own",
    Action.SEE_SQUAD: "all own own",
    Action.SEE_DRONE: "all own own",
    Action.FLY: "all own none",
    Action.COMMAND: "all own none",
    Action.HOLD_SEVERAL: "all none none",
    Action.ADMINISTER: "all none none",
    Action.READ_METRICS: "all none none",
    Action.CHANGE_USERS: "all none none",
    Action.CHANGE_DRONE_KEYS: "all none none",
    Action.MANAGE_TEAMS: "all own own",
    Action.LEAD_TEAMS: "all own none",
    Action.SEE_MISSIONS: "all own own",
    Action.CHANGE_MISSIONS: "all own none",
    Action.SHARE_WITH_EVERYBODY: "all none none",
    Action.SEE_CREDENTIALS: "all own own",
    Action.CHANGE_CREDENTIALS: "all own own",
    Action.PROVE_ONESELF: "own own own",
    Action.SET_UP_SECOND_FACTOR: "own own own",
    Action.CHANGE_PREFERENCES: "own own own",
    Action.CHANGE_PASSWORD: "own own own",
}


@pytest.mark.parametrize(("action", "who"), list(product(Action, (ADMIN, OPERATOR, OBSERVER))))
def test_how_far_each_role_reaches(action: Action, who: Principal) -> None:
    column = list(Role).index(who.role)
    expected = Reach(REACHES[action].split()[column])
    assert reach_of(who.role, action) is expected
    assert (who.role.value in roles_with(action, expected)) is True
    others = UserId(99)
    assert reaches(who, action, who.user_id) is (expected is not Reach.NONE)
    assert reaches(who, action, others) is (expected is Reach.ALL)
    now = datetime(2029, 1, 1, tzinfo=UTC)
    proved = replace(who, proved_at=now)
    request = AccessRequest(proved, action, Relation.OBSERVER, now=now)
    refused = judge(request).refusal
    assert (refused is None) is (expected is not Reach.NONE)
    assert refused is None or type(refused) in refusals_for_roles(action)
    of_everybody = judge(replace(request, everybody=True)).refusal
    assert (of_everybody is None) is (expected is Reach.ALL)


def test_an_observer_counts_as_nobody_at_the_controls() -> None:
    assert ADMIN.may_fly and OPERATOR.may_fly and not OBSERVER.may_fly


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
        ("fly admin", Action.COMMAND, None, None),  # the control table refuses an operator
        ("admin", Action.ADMINISTER, AdminsOnly, None),
        ("watch fly metrics", Action.ADMINISTER, ScopeMissing, ScopeMissing),
        ("metrics", Action.READ_METRICS, AdminsOnly, None),
        ("admin", Action.READ_METRICS, ScopeMissing, ScopeMissing),
        ("admin fly metrics watch", Action.SEE_CREDENTIALS, InPersonOnly, InPersonOnly),
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
    theirs = judge(AccessRequest(OPERATOR, SEE, Relation.STRANGER))
    missing = judge(AccessRequest(OPERATOR, SEE, None))
    assert str(theirs.refusal) == str(missing.refusal)


@pytest.mark.parametrize(
    ("origin", "asked", "public_url", "same"),
    [
        (None, "http://tower:8000", "", True),
        ("http://tower:8000", "http://tower:8000", "", True),
        ("https://tower", "https://tower", "", True),
        ("https://tower", "https://tower:443", "", True),
        ("http://TOWER", "http://tower:80", "", True),
        ("http://[::1]:8000", "http://[::1]:8000", "", True),
        ("https://tower", "http://inner:8000", "https://tower", True),
        ("http://tower", "http://inner:8000", "https://tower", False),
        # A page from plain HTTP is not the one from TLS, even with the same name and port.
        ("http://tower", "https://tower", "", False),
        ("https://tower", "http://tower", "", False),
        ("http://tower:443", "https://tower", "", False),
        ("https://tower:8000", "http://tower:8000", "", False),
        ("http://tower", "https://tower", "https://tower", False),
        ("http://tower:8001", "http://tower:8000", "", False),
        ("http://evil", "http://tower", "", False),
        ("http://tower.evil", "http://tower", "", False),
        ("http://evil@tower.evil", "http://tower", "", False),
        ("null", "http://tower", "", False),
        ("", "http://tower", "", False),
        ("file://tower", "http://tower", "", False),
        ("http://tower:port", "http://tower", "", False),
        ("http://tower", "http://", "", False),
    ],
)
def test_origins(origin: str | None, asked: str, public_url: str, same: bool) -> None:
    scheme, _, host = asked.partition("://")
    assert origin_matches(origin=origin, scheme=scheme, host=host, public_url=public_url) is same


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


@pytest.mark.parametrize("action", sorted(WITH_FRESH_PROOF))
def test_credentials_change_with_a_fresh_proof_and_never_with_a_token(action: Action) -> None:
    now = datetime(2029, 1, 1, tzinfo=UTC)
    for age_s, refusal in ((0, None), (299, None), (300, ProofNeeded), (-1, ProofNeeded), (None, ProofNeeded)):
        proved_at = None if age_s is None else now - timedelta(seconds=age_s)
        found = judge(AccessRequest(replace(ADMIN, proved_at=proved_at), action, now=now)).refusal
        assert (type(found) if found else None) is refusal, age_s
        assert is_fresh(proved_at, now) is (refusal is None)
    assert isinstance(judge(AccessRequest(replace(ADMIN, proved_at=now), action)).refusal, ProofNeeded)
    with_token = replace(ADMIN, session_id=TokenId(3), proved_at=now)
    assert isinstance(judge(AccessRequest(with_token, action, now=now)).refusal, InPersonOnly)


@pytest.mark.parametrize("action", list(Action))
def test_an_admin_who_lacks_the_demanded_factor_may_only_set_one_up(action: Action) -> None:
    now = datetime(2029, 1, 1, tzinfo=UTC)
    lacking = replace(ADMIN, proved_at=now, must_add_second_factor=True)
    refusal = judge(AccessRequest(lacking, action, Relation.ADMIN, now=now)).refusal
    assert isinstance(refusal, SecondFactorDemanded) is (action not in WITHOUT_DEMANDED_FACTOR)
    assert (refusal is None) is (action in WITHOUT_DEMANDED_FACTOR)


def test_generated_passwords_differ() -> None:
    assert len({generate_password() for _ in range(50)}) == 50
