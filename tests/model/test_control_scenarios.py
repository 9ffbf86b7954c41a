"""The hard cases of the model, one by one: chance finds them now and then, these tests run them every time."""

from itertools import permutations

import pytest
from test_control_model import ALICE, BOB, ONE, ROOT, TOOR, ControlModel

from server.control.core.lease import Event


@pytest.fixture
def model():
    made = ControlModel()
    made.everybody_comes(((ALICE, Event.ACQUIRE),))
    yield made
    made.teardown()


def flown(model: ControlModel) -> dict[int, set[int]]:
    """Returns epoch to the users whose sticks reached the autopilot of drone 1. Checks the invariants."""
    model.one_person_flies_in_one_epoch_and_has_a_right_to()
    return {epoch: who for (drone_id, epoch), who in model.flown.items() if drone_id == ONE}


def test_sticks_that_were_on_the_way_when_the_controls_were_taken_do_not_arrive(model: ControlModel) -> None:
    model.sticks("holder", ONE, (True,))
    on_the_way = list(model.network)
    model._ask(ROOT, ONE, Event.TAKE, at_once=True)
    model.control_messages(ONE, 100)
    model.everything_arrives()
    for drone_id, datagram in on_the_way:
        model.agents[drone_id].datagram(datagram, model.now)
    assert flown(model) == {}
    model.sticks_that_arrive("holder", ONE, (True, False))
    assert flown(model) == {2: {ROOT}}


def test_the_epoch_on_the_data_channel_fences_even_if_the_control_channel_is_slow(model: ControlModel) -> None:
    model.sticks("holder", ONE, (True,))
    old = model.network.pop()
    model._ask(ROOT, ONE, Event.TAKE, at_once=True)
    model.sticks("holder", ONE, (True,))
    new = model.network.pop()  # the order to hold is lost
    for drone_id, datagram in (new, old):
        model.agents[drone_id].datagram(datagram, model.now)
    assert flown(model) == {2: {ROOT}}


def test_from_the_request_to_take_on_nobodys_sticks_pass(model: ControlModel) -> None:
    model._ask(ROOT, ONE, Event.TAKE, at_once=False)
    model.sticks_that_arrive("holder", ONE, (True,))
    model.tower.step(0)  # written, but the hub has not been notified
    for user_id in (ALICE, ROOT):
        model._sticks(user_id, ONE, (True,))
    model.everything_arrives()
    assert flown(model) == {}


@pytest.mark.parametrize("order", sorted(set(permutations((0, 0, 1, 1)))))
def test_two_admins_race_and_one_of_them_wins_each_epoch(model: ControlModel, order: tuple[int, ...]) -> None:
    """Covers every order of the database's answers, with sticks from all users between them."""
    racing = []
    for user_id in (ROOT, TOOR):
        model._ask(user_id, ONE, Event.TAKE, at_once=False)
        racing.append(model.tower.running[-1])
    for number in order:
        if racing[number] in model.tower.running:
            model.tower._go_on(racing[number])
        for user_id in (ALICE, ROOT, TOOR):
            model._sticks(user_id, ONE, (True,))
        model.everything_arrives()
        model.the_tower_believes_what_is_in_the_store()
    flown(model)
    lease = model.store.leases[ONE]
    assert lease.taken_from == ALICE
    assert lease.epoch in (2, 3)


def test_a_take_that_is_refused_leaves_the_holder_flying(model: ControlModel) -> None:
    model._ask(ROOT, ONE, Event.TAKE, at_once=False)
    model._ask(ALICE, ONE, Event.RELEASE, at_once=False)
    model.tower.step(1)  # alice's release is written first
    model.tower.settle()
    model._ask(BOB, ONE, Event.ACQUIRE, at_once=True)
    assert model.store.leases[ONE].epoch == 3
    model.sticks_that_arrive("holder", ONE, (True,))
    assert flown(model) == {3: {BOB}}


@pytest.mark.parametrize("first", ["asked", "lost"])
def test_who_loses_the_right_while_the_controls_are_taken_has_no_part_in_the_lease(
    model: ControlModel, first: str
) -> None:
    """Before the fix the user lost the right as the holder, when already recorded as the one the controls were taken
    from."""
    if first == "asked":
        model._ask(ROOT, ONE, Event.TAKE, at_once=False)
    model.rights_change(ALICE, ONE, "no owner")
    if first == "lost":
        model._ask(ROOT, ONE, Event.TAKE, at_once=False)
    while model.tower.running:
        model.tower.step(0)
    model.tower.settle()
    lease = model.store.leases[ONE]
    assert (lease.holder, lease.taken_from) == (ROOT, None)


def test_nobody_flies_under_the_epoch_of_an_assistance_that_the_tower_did_not_survive(model: ControlModel) -> None:
    model._ask(ROOT, ONE, Event.ASSIST, at_once=True)
    model.everything_arrives()
    model.sticks("assistant", ONE, (True,))
    model.everything_settles()
    model.everything_arrives()
    assert flown(model) == {3: {ROOT}}
    model.something_dies(ONE, "tower")
    model.time_passes(0.1)
    model.everything_settles()
    model.sticks_that_arrive("holder", ONE, (True,))
    assert flown(model) == {3: {ROOT}, 4: {ALICE}}


@pytest.mark.parametrize("steps", [0, 1])
def test_a_tower_that_dies_while_it_writes_comes_back_with_what_is_written(model: ControlModel, steps: int) -> None:
    model._ask(ROOT, ONE, Event.TAKE, at_once=False)
    for _ in range(steps):
        model.tower.step(0)
    model.something_dies(ONE, "tower")
    holder = ROOT if steps else ALICE
    assert model.store.leases[ONE].holder == holder
    model.the_tower_believes_what_is_in_the_store()
    model.time_passes(0.1)
    model.sticks_that_arrive("holder", ONE, (True,))
    assert flown(model) == {1 + steps: {holder}}


def test_holder_and_assistant_at_once_fly_in_turns(model: ControlModel) -> None:
    model._ask(ROOT, ONE, Event.ASSIST, at_once=True)
    for _ in range(3):
        model.sticks_that_arrive("holder", ONE, (True,))
        model.sticks("assistant", ONE, (True,))
        model._sticks(ALICE, ONE, (False,))
        model.everything_settles()
        model._sticks(ALICE, ONE, (False,))
        model.everything_arrives()
        model.time_passes(1.1)
        model.everything_settles()
        model.everything_arrives()
    turns = [next(iter(who)) for _, who in sorted(flown(model).items())]
    assert turns == [ALICE, ROOT] * 3


def test_the_operator_flies_again_only_after_their_own_word(model: ControlModel) -> None:
    for user_id, event in ((ROOT, Event.TAKE), (ROOT, Event.GIVE)):
        model._ask(user_id, ONE, event, at_once=True)
    model.sticks_that_arrive("taken_from", ONE, (True,))
    assert flown(model) == {}
    model._ask(ALICE, ONE, Event.ACCEPT, at_once=True)
    model.everything_arrives()
    model.sticks_that_arrive("holder", ONE, (False,))
    assert flown(model) == {}, "after a hold the sticks have to be centred once"
    model.sticks_that_arrive("holder", ONE, (True, False))
    assert flown(model) == {4: {ALICE}}


def test_a_take_reaches_a_link_without_a_control_channel_though_many_copies_are_lost(model: ControlModel) -> None:
    model.time_passes(0.1)
    model.control_channel_breaks_off(ONE)
    model.sticks("holder", ONE, (True,))
    old = model.network.pop()
    model._ask(ROOT, ONE, Event.TAKE, at_once=True)
    for _ in range(8):
        model.network.clear()
        model.time_passes(0.1)
    model.network.clear()
    agent = model.agents[ONE]
    assert agent.is_linked_to(model.tower.hub) and agent.onboard.downlink.epoch == 1
    model.time_passes(0.1)
    model.everything_arrives()
    assert agent.onboard.downlink.epoch == 2 and agent.onboard.hold.active
    agent.datagram(old[1], model.now)
    model.sticks_that_arrive("holder", ONE, (True,))
    assert flown(model) == {2: {ROOT}}


@pytest.mark.parametrize("dark", [False, True])
def test_a_take_that_does_not_reach_an_orphan_ends_it(model: ControlModel, dark: bool) -> None:
    model.time_passes(0.1)
    model.control_channel_breaks_off(ONE)
    model.sticks("holder", ONE, (True,))
    old = model.network.pop()
    model._ask(ROOT, ONE, Event.TAKE, at_once=True)
    for _ in range(4 if dark else 26):
        model.nothing_is_heard_of(ONE, 0.4) if dark else model.time_passes(0.4)
        model.network.clear()
    agent = model.agents[ONE]
    assert agent.linked and not agent.is_linked_to(model.tower.hub)
    agent.datagram(old[1], model.now)
    model.connect(ONE)
    model.everything_arrives()
    model.sticks_that_arrive("holder", ONE, (True,))
    assert flown(model).get(1, {ALICE}) == {ALICE}
    assert agent.onboard.downlink.epoch == 2 and flown(model)[2] == {ROOT}


def test_a_resumed_link_hears_what_its_last_control_channel_lost(model: ControlModel) -> None:
    model.time_passes(0.1)
    model._ask(ROOT, ONE, Event.TAKE, at_once=True)
    model.network.clear()
    model.control_channel_breaks_off(ONE)
    model.link_is_resumed(ONE)
    agent = model.agents[ONE]
    assert agent.has_channel and agent.onboard.downlink.epoch == 1
    model.control_messages(ONE, 100)
    assert agent.onboard.downlink.epoch == 2 and agent.onboard.hold.active
