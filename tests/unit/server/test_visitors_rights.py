"""What another tower says of its browser is not believed: name, role and scopes are looked up here."""

from typing import Any

from hub_world import LATER, NAMES, HubWorld, record, role_of
from hypothesis import given
from hypothesis import strategies as st

from server.kernel.fleet import FleetSnapshot, SignInRecord, UserRecord
from server.kernel.people import Principal, Role, SignInId, TokenId
from server.kernel.scopes import ALL_SCOPES, Scope
from server.towers.core.messages import Attach, Detach, attach_of
from server.towers.core.visitors import Visitors
from wire.ids import UserId

ALICE, BOB, ADMIN, NOBODY = 1, 2, 9, 77
WATCH = TokenId(5)
"""A token of the admin that only watches."""
SIGN_INS: dict[SignInId, SignInRecord] = {
    10: SignInRecord(UserId(ALICE)),
    20: SignInRecord(UserId(BOB)),
    90: SignInRecord(UserId(ADMIN)),
    WATCH: SignInRecord(UserId(ADMIN), frozenset({Scope.WATCH})),
}


class Scene:
    """A tower with these sign-ins, and what another tower says. `looked_up`: how often it wanted the database."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.apply(SIGN_INS)
        self.visitors = Visitors(self.hub, send=lambda tower, message: None, begin_writing=lambda visitor: lambda: None)
        self.looked_up = 0
        self.visitors.on_unknown = self.look_up

    def look_up(self) -> None:
        self.looked_up += 1

    def apply(self, sign_ins: dict[SignInId, SignInRecord], *, disabled: frozenset[int] = frozenset()) -> None:
        self.world.revision += 1
        users = {UserId(one): UserRecord(name, role_of(one), one in disabled) for one, name in NAMES.items()}
        records = (record(1, (1,)), record(2, (2,)))
        self.hub.apply_fleet(FleetSnapshot(self.world.revision, records, users, sign_ins))

    def hear(self, attach: Attach) -> Principal | None:
        """Whose rights the browser has then; None: it sees nothing."""
        self.visitors.heard("other", attach, 0.0)
        found = [one.viewer for one in self.hub.state.browsers.values()]
        assert len(found) <= 1
        return found[0] if found else None


def attach(user_id: int, signed_in_by: int, *, by_token: bool = False, **more: Any) -> Attach:
    said = {"name": "x", "role": "admin", "scopes": sorted(one.value for one in ALL_SCOPES), "address": ""} | more
    return Attach(1, user_id, signed_in_by=signed_in_by, by_token=by_token, expires_at=LATER, **said)


@given(
    user_id=st.sampled_from([ALICE, BOB, ADMIN, NOBODY]),
    sign_in=st.sampled_from([*SIGN_INS, 11, TokenId(10), TokenId(90)]),
    role=st.one_of(st.sampled_from([one.value for one in Role]), st.text(max_size=9)),
    scopes=st.lists(st.one_of(st.sampled_from([one.value for one in Scope]), st.text(max_size=9))),
    name=st.text(max_size=20),
)
def test_a_claim_gives_nothing_that_the_sign_in_has_not(
    user_id: int, sign_in: SignInId, role: str, scopes: list[str], name: str
) -> None:
    number, by_token = (sign_in.id, True) if isinstance(sign_in, TokenId) else (sign_in, False)
    seen = Scene().hear(attach(user_id, number, by_token=by_token, role=role, scopes=scopes, name=name))
    known = SIGN_INS.get(sign_in)
    if known is None or known.user_id != user_id:
        assert seen is None
        return
    assert seen == Principal(UserId(user_id), NAMES[user_id], role_of(user_id), sign_in, LATER, scopes=known.scopes)


def test_an_honest_word_gives_what_the_other_tower_knows_too() -> None:
    viewer = Principal(UserId(ADMIN), "admin", Role.ADMIN, WATCH, LATER, scopes=frozenset({Scope.WATCH}))
    assert Scene().hear(attach_of(1, viewer, "")) == viewer


def test_a_newer_session_waits_for_the_database_and_then_counts() -> None:
    scene = Scene()
    assert scene.hear(attach(ALICE, 99)) is None
    assert (scene.looked_up, scene.visitors.unknown_sessions()) == (1, {99})
    scene.hub.fleet.note_sign_ins({99: SignInRecord(UserId(ALICE))})
    scene.visitors.fleet_changed(0.0)
    (browser,) = scene.hub.state.browsers.values()
    assert (browser.viewer.role, scene.visitors.unknown_sessions()) == (Role.OPERATOR, set())


def test_a_session_that_never_was_is_asked_for_once_for_each_word_of_it() -> None:
    scene = Scene()
    for _ in range(3):
        assert scene.hear(attach(ADMIN, 99)) is None
    scene.visitors.fleet_changed(0.0)
    assert not len(scene.visitors)
    scene.visitors.heard("other", Detach(1), 0.0)
    assert scene.visitors.unknown_sessions() == set()


def test_what_has_ended_does_not_count_again() -> None:
    scene = Scene()
    scene.hub.fleet.note_sign_ins({99: SignInRecord(UserId(ALICE))})
    scene.hub.end_sessions([99, 90])
    assert scene.hear(attach(ALICE, 99)) is None
    assert scene.hear(attach(ADMIN, 90)) is None
    scene.hub.fleet.note_sign_ins({99: SignInRecord(UserId(ALICE))})
    assert scene.hear(attach(ALICE, 99)) is None


def test_a_disabled_account_and_a_revoked_token_give_nothing() -> None:
    scene = Scene()
    scene.apply({key: one for key, one in SIGN_INS.items() if key != WATCH}, disabled=frozenset({ALICE}))
    assert scene.hear(attach(ALICE, 10)) is None
    assert scene.hear(attach(ADMIN, WATCH.id, by_token=True)) is None
    assert scene.looked_up == 0, "tokens come with the fleet"


def test_a_replayed_word_after_a_change_of_role_gives_the_new_role() -> None:
    scene = Scene()
    replayed = attach(ALICE, 10)
    assert scene.hear(replayed) is not None
    users = {UserId(ALICE): UserRecord("alice", Role.OBSERVER, disabled=False)}
    scene.world.revision += 1
    scene.hub.apply_fleet(FleetSnapshot(scene.world.revision, (record(1, (1,)),), users, SIGN_INS))
    seen = scene.hear(replayed)
    assert seen is not None
    assert (seen.role, seen.may_fly) == (Role.OBSERVER, False)


def test_a_snapshot_forgets_newer_sessions_that_it_lacks() -> None:
    scene = Scene()
    scene.hub.fleet.note_sign_ins({30: SignInRecord(UserId(ALICE)), 99: SignInRecord(UserId(ALICE))})
    scene.apply(SIGN_INS | {95: SignInRecord(UserId(BOB))})
    assert not scene.hub.fleet.knows_sign_in(30)
    assert scene.hub.fleet.knows_sign_in(99)
