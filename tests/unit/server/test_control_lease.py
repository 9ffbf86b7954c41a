"""The lease table: every cell is filled, and the invariants hold for every order of events."""

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.control.core.lease import (
    TABLE,
    TOWER,
    Actor,
    Changed,
    Event,
    Lease,
    Order,
    Phase,
    Refused,
    decide,
)
from wire.ids import Epoch, UserId

OPERATOR, OTHER, ADMIN, SECOND_ADMIN = UserId(1), UserId(2), UserId(8), UserId(9)
PEOPLE = [OPERATOR, OTHER, ADMIN, SECOND_ADMIN]

FIVE, SIX = Epoch(5), Epoch(6)
FREE = Lease(epoch=FIVE)
HELD = Lease(holder=OPERATOR, epoch=FIVE)
ASSISTED = Lease(holder=OPERATOR, assistant=ADMIN, epoch=FIVE)
TAKEN = Lease(holder=ADMIN, taken_from=OPERATOR, epoch=FIVE)
VIEW_TAKEN = Lease(holder=ADMIN, taken_from=OPERATOR, view_taken=True, epoch=FIVE)
OFFERED = Lease(holder=ADMIN, taken_from=OPERATOR, offered=True, epoch=FIVE)
OFFERED_VIEW_TAKEN = Lease(holder=ADMIN, taken_from=OPERATOR, offered=True, view_taken=True, epoch=FIVE)
HOLD = (Order.HOLD,)
IF_BY_HAND = (Order.HOLD_IF_FLOWN_BY_HAND,)


def owner(user_id: UserId = OPERATOR, **more: bool) -> Actor:
    return Actor(user_id, is_owner=True, **more)


def admin(user_id: UserId = ADMIN, **more: bool) -> Actor:
    return Actor(user_id, is_admin=True, **more)


def team_admin(user_id: UserId = ADMIN, **more: bool) -> Actor:
    return Actor(user_id, is_team_admin=True, is_owner=True, **more)


def tower(about: UserId | None = None) -> Actor:
    return Actor(None, is_tower=True, about=about)


def free() -> Lease:
    return Lease(epoch=SIX)


def held(holder: UserId, assistant: UserId | None = None) -> Lease:
    return Lease(holder=holder, assistant=assistant, epoch=SIX)


def taken(holder: UserId = ADMIN, *, offered: bool = False, view_taken: bool = False) -> Lease:
    return Lease(holder=holder, taken_from=OPERATOR, offered=offered, view_taken=view_taken, epoch=SIX)


def test_every_cell_of_the_table_is_filled() -> None:
    assert set(TABLE) == set(product(Phase, Event))


@pytest.mark.parametrize(
    ("lease", "event", "actor", "after", "orders"),
    [
        (FREE, Event.ACQUIRE, owner(), held(OPERATOR), ()),
        (FREE, Event.ACQUIRE, admin(), held(ADMIN), ()),
        (FREE, Event.TAKE, admin(), held(ADMIN), HOLD),
        (HELD, Event.RELEASE, owner(), free(), IF_BY_HAND),
        (HELD, Event.TAKE, admin(), taken(), HOLD),
        (HELD, Event.TAKE, admin(watch=False), taken(view_taken=True), HOLD),
        (FREE, Event.TAKE, team_admin(), held(ADMIN), HOLD),
        (HELD, Event.TAKE, team_admin(), taken(), HOLD),
        (HELD, Event.TAKE, team_admin(watch=False), taken(view_taken=True), HOLD),
        (HELD, Event.ASSIST, team_admin(), held(OPERATOR, ADMIN), ()),
        (ASSISTED, Event.ASSIST_END, team_admin(SECOND_ADMIN), held(OPERATOR), ()),
        (TAKEN, Event.TAKE, team_admin(SECOND_ADMIN), taken(SECOND_ADMIN), HOLD),
        (TAKEN, Event.GIVE, team_admin(), taken(offered=True), HOLD),
        (OFFERED, Event.TAKE, team_admin(), taken(), ()),
        (HELD, Event.ASSIST, admin(), held(OPERATOR, ADMIN), ()),
        (HELD, Event.REVOKE, admin(), free(), HOLD),
        (HELD, Event.REVOKE, tower(OPERATOR), free(), HOLD),
        (HELD, Event.EXPIRE, tower(OPERATOR), free(), IF_BY_HAND),
        (ASSISTED, Event.ASSIST_END, admin(), held(OPERATOR), ()),
        (ASSISTED, Event.ASSIST_END, admin(SECOND_ADMIN), held(OPERATOR), ()),
        (ASSISTED, Event.ASSIST_END, Actor(ADMIN), held(OPERATOR), ()),
        (ASSISTED, Event.ASSIST_END, tower(ADMIN), held(OPERATOR), ()),
        (ASSISTED, Event.TURN, tower(), held(OPERATOR, ADMIN), ()),
        (ASSISTED, Event.RELEASE, owner(), free(), IF_BY_HAND),
        (ASSISTED, Event.TAKE, admin(), taken(), HOLD),
        (ASSISTED, Event.EXPIRE, tower(OPERATOR), free(), IF_BY_HAND),
        (TAKEN, Event.TAKE, admin(SECOND_ADMIN), taken(SECOND_ADMIN), HOLD),
        (VIEW_TAKEN, Event.TAKE, admin(SECOND_ADMIN, watch=False), taken(SECOND_ADMIN, view_taken=True), HOLD),
        (TAKEN, Event.TAKE, admin(OPERATOR), held(OPERATOR), HOLD),
        (TAKEN, Event.GIVE, admin(), taken(offered=True), HOLD),
        (VIEW_TAKEN, Event.GIVE, admin(), taken(offered=True, view_taken=True), HOLD),
        (TAKEN, Event.RELEASE, admin(), free(), IF_BY_HAND),
        (TAKEN, Event.REVOKE, tower(ADMIN), free(), HOLD),
        (TAKEN, Event.FORGET, tower(OPERATOR), held(ADMIN), ()),
        (TAKEN, Event.EXPIRE, tower(ADMIN), free(), IF_BY_HAND),
        (OFFERED, Event.ACCEPT, owner(sticks_centred=True), held(OPERATOR), HOLD),
        (OFFERED_VIEW_TAKEN, Event.ACCEPT, owner(sticks_centred=True), held(OPERATOR), HOLD),
        (OFFERED, Event.TAKE, admin(), taken(), ()),
        (OFFERED_VIEW_TAKEN, Event.TAKE, admin(), taken(view_taken=True), ()),
        (OFFERED, Event.TAKE, admin(SECOND_ADMIN), taken(SECOND_ADMIN), HOLD),
        (OFFERED, Event.OFFER_LAPSED, tower(), taken(), ()),
        (OFFERED_VIEW_TAKEN, Event.OFFER_LAPSED, tower(), taken(view_taken=True), ()),
        (OFFERED, Event.RELEASE, admin(), free(), IF_BY_HAND),
        (OFFERED, Event.REVOKE, tower(ADMIN), free(), HOLD),
        (OFFERED, Event.FORGET, tower(OPERATOR), held(ADMIN), ()),
        (OFFERED, Event.EXPIRE, tower(ADMIN), free(), IF_BY_HAND),
    ],
)
def test_what_is_allowed(lease: Lease, event: Event, actor: Actor, after: Lease, orders: tuple[Order, ...]) -> None:
    assert decide(lease, event, actor) == Changed(after, orders)


@pytest.mark.parametrize(
    ("lease", "event", "actor", "code"),
    [
        (FREE, Event.ACQUIRE, Actor(OTHER), "not-an-owner"),
        (FREE, Event.ACQUIRE, owner(holds_another=True), "holds-another"),
        (FREE, Event.TAKE, team_admin(holds_another=True), "holds-another"),
        (HELD, Event.TAKE, team_admin(holds_another=True), "holds-another"),
        (HELD, Event.TAKE, team_admin(outranked=True), "held-by-admin"),
        (ASSISTED, Event.TAKE, team_admin(SECOND_ADMIN, outranked=True), "held-by-admin"),
        (TAKEN, Event.TAKE, team_admin(SECOND_ADMIN, outranked=True), "held-by-admin"),
        (TAKEN, Event.TAKE, team_admin(OPERATOR, outranked=True), "held-by-admin"),
        (OFFERED, Event.TAKE, team_admin(SECOND_ADMIN, outranked=True), "held-by-admin"),
        (TAKEN, Event.GIVE, team_admin(SECOND_ADMIN), "not-the-holder"),
        (HELD, Event.ASSIST, team_admin(outranked=True), "held-by-admin"),
        (ASSISTED, Event.ASSIST_END, team_admin(SECOND_ADMIN, outranked=True), "held-by-admin"),
        (HELD, Event.REVOKE, team_admin(), "admins-only"),
        (TAKEN, Event.FORGET, team_admin(SECOND_ADMIN), "admins-only"),
        (FREE, Event.RELEASE, owner(), "not-the-holder"),
        (FREE, Event.TAKE, owner(), "admins-only"),
        (FREE, Event.GIVE, admin(), "nothing-to-give"),
        (FREE, Event.ACCEPT, owner(sticks_centred=True), "nothing-offered"),
        (FREE, Event.ASSIST, admin(), "nobody-to-assist"),
        (FREE, Event.ASSIST, owner(), "admins-only"),
        (FREE, Event.ASSIST_END, admin(), "nobody-assists"),
        (FREE, Event.TURN, tower(), "nobody-assists"),
        (FREE, Event.REVOKE, tower(), "not-the-holder"),
        (FREE, Event.FORGET, tower(), "nothing-taken"),
        (FREE, Event.OFFER_LAPSED, tower(), "nothing-offered"),
        (FREE, Event.EXPIRE, tower(), "not-the-holder"),
        (HELD, Event.ACQUIRE, owner(), "already-yours"),
        (HELD, Event.ACQUIRE, owner(OTHER), "held-by-other"),
        (HELD, Event.RELEASE, owner(OTHER), "not-the-holder"),
        (HELD, Event.TAKE, owner(OTHER), "admins-only"),
        (HELD, Event.TAKE, admin(OPERATOR), "already-yours"),
        (HELD, Event.GIVE, admin(), "nothing-to-give"),
        (HELD, Event.GIVE, owner(), "admins-only"),
        (HELD, Event.ACCEPT, owner(sticks_centred=True), "nothing-offered"),
        (HELD, Event.ASSIST, owner(OTHER), "admins-only"),
        (HELD, Event.ASSIST, admin(OPERATOR), "already-yours"),
        (ASSISTED, Event.ASSIST, admin(), "already-assisting"),
        (ASSISTED, Event.ASSIST, admin(SECOND_ADMIN), "assisted-by-other"),
        (HELD, Event.ASSIST_END, admin(), "nobody-assists"),
        (ASSISTED, Event.ASSIST_END, owner(), "admins-only"),
        (ASSISTED, Event.ASSIST_END, tower(SECOND_ADMIN), "moved-on"),
        (HELD, Event.TURN, tower(), "nobody-assists"),
        (ASSISTED, Event.TURN, admin(), "tower-only"),
        (HELD, Event.REVOKE, owner(OTHER), "admins-only"),
        (HELD, Event.REVOKE, tower(OTHER), "moved-on"),
        (HELD, Event.FORGET, tower(OPERATOR), "nothing-taken"),
        (HELD, Event.OFFER_LAPSED, tower(), "nothing-offered"),
        (HELD, Event.EXPIRE, admin(), "tower-only"),
        (HELD, Event.EXPIRE, tower(OTHER), "moved-on"),
        (TAKEN, Event.ACQUIRE, owner(), "taken-away"),
        (TAKEN, Event.ACQUIRE, owner(OTHER), "held-by-other"),
        (TAKEN, Event.RELEASE, owner(), "not-the-holder"),
        (TAKEN, Event.TAKE, owner(), "admins-only"),
        (TAKEN, Event.TAKE, admin(), "already-yours"),
        (TAKEN, Event.GIVE, admin(SECOND_ADMIN), "not-the-holder"),
        (TAKEN, Event.GIVE, admin(operator_may_fly=False), "cannot-receive"),
        (TAKEN, Event.ACCEPT, owner(sticks_centred=True), "nothing-offered"),
        (TAKEN, Event.ASSIST, admin(SECOND_ADMIN), "cannot-assist"),
        (TAKEN, Event.ASSIST, owner(), "admins-only"),
        (TAKEN, Event.ASSIST_END, admin(), "nobody-assists"),
        (TAKEN, Event.TURN, tower(), "nobody-assists"),
        (TAKEN, Event.REVOKE, tower(OPERATOR), "moved-on"),
        (TAKEN, Event.FORGET, owner(), "admins-only"),
        (TAKEN, Event.FORGET, tower(ADMIN), "moved-on"),
        (TAKEN, Event.OFFER_LAPSED, tower(), "nothing-offered"),
        (OFFERED, Event.ACQUIRE, owner(), "offered"),
        (OFFERED, Event.ACQUIRE, owner(OTHER), "held-by-other"),
        (OFFERED, Event.ACQUIRE, admin(), "already-yours"),
        (OFFERED, Event.RELEASE, owner(), "not-the-holder"),
        (OFFERED, Event.TAKE, owner(), "admins-only"),
        (OFFERED, Event.GIVE, admin(), "already-offered"),
        (OFFERED, Event.GIVE, admin(SECOND_ADMIN), "not-the-holder"),
        (OFFERED, Event.ACCEPT, owner(), "sticks-not-centred"),
        (OFFERED, Event.ACCEPT, owner(OTHER, sticks_centred=True), "not-offered-to-you"),
        (OFFERED, Event.ACCEPT, admin(sticks_centred=True), "not-offered-to-you"),
        (OFFERED, Event.ACCEPT, owner(sticks_centred=True, holds_another=True), "holds-another"),
        (OFFERED, Event.ACCEPT, owner(sticks_centred=True, operator_may_fly=False), "not-an-owner"),
        (OFFERED, Event.ASSIST, admin(SECOND_ADMIN), "cannot-assist"),
        (OFFERED, Event.ASSIST_END, admin(), "nobody-assists"),
        (OFFERED, Event.TURN, tower(), "nobody-assists"),
        (OFFERED, Event.OFFER_LAPSED, admin(), "tower-only"),
        (OFFERED, Event.EXPIRE, tower(OPERATOR), "moved-on"),
    ],
)
def test_what_is_refused(lease: Lease, event: Event, actor: Actor, code: str) -> None:
    outcome = decide(lease, event, actor)
    assert isinstance(outcome, Refused)
    assert outcome.code == code
    assert outcome.words


people = st.builds(
    Actor,
    user_id=st.sampled_from(PEOPLE),
    is_admin=st.booleans(),
    is_owner=st.booleans(),
    holds_another=st.booleans(),
    operator_may_fly=st.booleans(),
    watch=st.booleans(),
    sticks_centred=st.booleans(),
)
the_tower = st.builds(tower, st.sampled_from([None, *PEOPLE]))


@given(st.lists(st.tuples(st.sampled_from(Event), people | the_tower), max_size=60))
def test_the_laws_hold_in_any_order(events: list[tuple[Event, Actor]]) -> None:
    lease = Lease()
    for event, actor in events:
        outcome = decide(lease, event, actor)
        if isinstance(outcome, Refused):
            continue
        after = outcome.lease
        assert after.epoch == lease.epoch + 1
        if after.taken_from is not None:
            assert after.holder not in (None, after.taken_from)
        if after.offered or after.view_taken:
            assert after.taken_from is not None
        if after.assistant is not None:
            assert after.holder not in (None, after.assistant)
            assert after.taken_from is None
        if lease.holder not in (None, actor.user_id) and after.holder != lease.holder:
            # The controls never leave a person without an order, and never pass to another person without a hold.
            assert outcome.orders in (HOLD, IF_BY_HAND)
            assert Order.HOLD in outcome.orders or after.holder is None
        if after.holder != lease.holder and after.holder is not None and event is not Event.ACQUIRE:
            assert actor.user_id == after.holder  # nobody receives the controls without a request
        if actor.is_tower:
            assert after.holder in (None, lease.holder)
        lease = after


@given(
    st.sampled_from([FREE, HELD, ASSISTED, TAKEN, VIEW_TAKEN, OFFERED, OFFERED_VIEW_TAKEN]),
    st.sampled_from(Event),
    people,
)
def test_nobody_but_admins_touches_what_is_somebody_elses(lease: Lease, event: Event, actor: Actor) -> None:
    outcome = decide(lease, event, actor)
    part_of_it = actor.user_id in (lease.holder, lease.taken_from, lease.assistant)
    if isinstance(outcome, Changed) and not (actor.is_admin or part_of_it):
        assert lease.phase is Phase.FREE
        assert actor.is_owner


def test_the_towers_own_events_are_the_towers_alone() -> None:
    for phase_lease in (FREE, HELD, ASSISTED, TAKEN, OFFERED):
        for event in (Event.TURN, Event.OFFER_LAPSED, Event.EXPIRE):
            for actor in (owner(), admin(), admin(SECOND_ADMIN)):
                assert isinstance(decide(phase_lease, event, actor), Refused)
    assert tower() == TOWER
