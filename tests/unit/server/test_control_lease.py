"""The lease table: every cell filled, and the laws that must hold whatever happens in whatever order."""

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.control.lease import TABLE, Actor, Changed, Event, Lease, Order, Phase, Refused, decide
from wire.ids import Epoch, UserId

OPERATOR, OTHER, ADMIN, SECOND_ADMIN = UserId(1), UserId(2), UserId(8), UserId(9)

FREE = Lease(epoch=Epoch(5))
HELD = Lease(holder=OPERATOR, epoch=Epoch(5))
TAKEN = Lease(holder=ADMIN, taken_from=OPERATOR, epoch=Epoch(5))


def owner(user_id: UserId = OPERATOR, **more: bool) -> Actor:
    return Actor(user_id, is_admin=False, is_owner=True, **more)


def admin(user_id: UserId = ADMIN, **more: bool) -> Actor:
    return Actor(user_id, is_admin=True, is_owner=False, **more)


def test_every_cell_of_the_table_is_filled() -> None:
    assert set(TABLE) == set(product(Phase, Event))


@pytest.mark.parametrize(
    ("lease", "event", "actor", "holder", "taken_from", "orders"),
    [
        (FREE, Event.ACQUIRE, owner(), OPERATOR, None, ()),
        (FREE, Event.ACQUIRE, admin(), ADMIN, None, ()),
        (HELD, Event.RELEASE, owner(), None, None, (Order.HOLD_IF_FLOWN_BY_HAND,)),
        (FREE, Event.TAKE, admin(), ADMIN, None, (Order.HOLD,)),
        (HELD, Event.TAKE, admin(), ADMIN, OPERATOR, (Order.HOLD,)),
        (TAKEN, Event.TAKE, admin(SECOND_ADMIN), SECOND_ADMIN, OPERATOR, (Order.HOLD,)),
        (TAKEN, Event.GIVE, admin(), OPERATOR, None, (Order.HOLD,)),
        (TAKEN, Event.RELEASE, admin(), None, None, (Order.HOLD_IF_FLOWN_BY_HAND,)),
        (HELD, Event.REVOKE, admin(), None, None, (Order.HOLD,)),
        (TAKEN, Event.REVOKE, admin(), None, None, (Order.HOLD,)),
    ],
)
def test_what_is_allowed(
    lease: Lease,
    event: Event,
    actor: Actor,
    holder: UserId | None,
    taken_from: UserId | None,
    orders: tuple[Order, ...],
) -> None:
    assert decide(lease, event, actor) == Changed(Lease(holder, taken_from, Epoch(6)), orders)


@pytest.mark.parametrize(
    ("lease", "event", "actor", "code"),
    [
        (FREE, Event.ACQUIRE, Actor(OTHER, is_admin=False, is_owner=False), "not-an-owner"),
        (FREE, Event.ACQUIRE, owner(holds_another=True), "holds-another"),
        (HELD, Event.ACQUIRE, owner(), "already-yours"),
        (HELD, Event.ACQUIRE, owner(OTHER), "held-by-other"),
        (TAKEN, Event.ACQUIRE, owner(), "taken-away"),
        (TAKEN, Event.ACQUIRE, owner(OTHER), "held-by-other"),
        (FREE, Event.RELEASE, owner(), "not-the-holder"),
        (HELD, Event.RELEASE, owner(OTHER), "not-the-holder"),
        (TAKEN, Event.RELEASE, owner(), "not-the-holder"),
        (FREE, Event.TAKE, owner(), "admins-only"),
        (HELD, Event.TAKE, owner(OTHER), "admins-only"),
        (TAKEN, Event.TAKE, owner(), "admins-only"),
        (TAKEN, Event.TAKE, admin(), "already-yours"),
        (FREE, Event.GIVE, admin(), "nothing-to-give"),
        (HELD, Event.GIVE, admin(), "nothing-to-give"),
        (HELD, Event.GIVE, owner(), "admins-only"),
        (TAKEN, Event.GIVE, admin(SECOND_ADMIN), "not-the-holder"),
        (TAKEN, Event.GIVE, admin(operator_may_fly=False), "cannot-receive"),
        (FREE, Event.REVOKE, admin(), "not-the-holder"),
    ],
)
def test_what_is_refused(lease: Lease, event: Event, actor: Actor, code: str) -> None:
    outcome = decide(lease, event, actor)
    assert isinstance(outcome, Refused)
    assert outcome.code == code
    assert outcome.words


actors = st.builds(
    Actor,
    user_id=st.sampled_from([OPERATOR, OTHER, ADMIN, SECOND_ADMIN]),
    is_admin=st.booleans(),
    is_owner=st.booleans(),
    holds_another=st.booleans(),
    operator_may_fly=st.booleans(),
)


@given(st.lists(st.tuples(st.sampled_from(Event), actors), max_size=40))
def test_the_laws_hold_in_any_order(events: list[tuple[Event, Actor]]) -> None:
    lease = Lease()
    for event, actor in events:
        outcome = decide(lease, event, actor)
        if isinstance(outcome, Refused):
            continue
        assert outcome.lease.epoch == lease.epoch + 1
        if event in (Event.TAKE, Event.GIVE):
            assert actor.is_admin
            assert Order.HOLD in outcome.orders
        if outcome.lease.taken_from is not None:
            assert outcome.lease.holder not in (None, outcome.lease.taken_from)
        if lease.holder not in (None, actor.user_id):
            # The controls never leave somebody without a hold.
            assert Order.HOLD in outcome.orders
        lease = outcome.lease
