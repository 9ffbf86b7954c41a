"""The hard cases of two towers, one by one: chance finds them now and then, these tests run them every time."""

from collections.abc import Iterator

import pytest
from test_two_towers_model import TwoTowersModel
from two_towers import ALICE, BOB, ONE, ROOT, TOOR, TWO, A, B

from server.control.core.lease import Event
from server.towers.core.place import Place


@pytest.fixture
def model() -> Iterator[TwoTowersModel]:
    """The drone is at home at A. Alice, connected to both, has acquired it through B."""
    made = TwoTowersModel()
    made.everybody_comes(((B, ALICE, Event.ACQUIRE),))
    assert made.store.leases[ONE].holder == ALICE
    yield made
    made.teardown()


def flown(model: TwoTowersModel) -> dict[int, set[int]]:
    model.one_person_flies_in_one_epoch_and_has_a_right_to()
    return {epoch: who for (drone_id, epoch), who in model.flown.items() if drone_id == ONE}


@pytest.mark.parametrize("number", [A, B])
def test_the_holder_flies_through_either_tower(model: TwoTowersModel, number: int) -> None:
    model.sticks(number, "holder", ONE, arrives=True)
    assert flown(model) == {1: {ALICE}}


def test_a_take_over_the_bus_fences_at_the_home_before_it_is_answered(model: TwoTowersModel) -> None:
    model.sticks(B, "holder", ONE, arrives=True)
    model.asks(B, ROOT, ONE, Event.TAKE, at_once=False)
    model.bus_delivers_all()
    home = model.towers[A]
    assert home.hub.state.drones[ONE].fenced, "before the database has decided"
    model.sticks_of(A, ALICE, ONE)
    model.sticks_of(B, ALICE, ONE)
    model.bus_delivers_all()
    model.everything_arrives()
    assert model.towers[B].answered_takes == []
    model.everything_settles()
    assert model.towers[B].answered_takes == [(ONE, 2)]
    assert model.agents[ONE].held_at == 2
    model.sticks(B, "taken_from", ONE, arrives=True)
    model.sticks(B, "holder", ONE, arrives=True)
    assert flown(model) == {1: {ALICE}, 2: {ROOT}}


def test_a_take_that_the_bus_loses_is_not_answered_and_changes_nothing(model: TwoTowersModel) -> None:
    model.asks(B, ROOT, ONE, Event.TAKE, at_once=False)
    model.bus.on_the_way.clear()
    model.everything_settles()
    assert (model.towers[B].answered_takes, model.store.leases[ONE].epoch) == ([], 1)


def test_a_take_that_the_bus_repeats_is_carried_out_once(model: TwoTowersModel) -> None:
    model.asks(B, ROOT, ONE, Event.TAKE, at_once=False)
    asked = list(model.bus.on_the_way)
    model.everything_settles()
    for to, packet in asked:
        model._deliver(to, packet)
    model.everything_settles()
    assert model.store.leases[ONE].epoch == 2


def test_sticks_that_the_bus_repeats_pass_once(model: TwoTowersModel) -> None:
    model.sticks_of(B, ALICE, ONE)
    sent = list(model.bus.on_the_way)
    model.bus_delivers_all()
    for to, packet in sent:
        model._deliver(to, packet)
    assert model.towers[A].hub.state.traffic.frames_to_agents == 1


def test_what_the_bus_delivers_late_is_not_carried_out(model: TwoTowersModel) -> None:
    model.asks(B, ROOT, ONE, Event.TAKE, at_once=False)
    late = list(model.bus.on_the_way)
    model.bus.on_the_way.clear()
    model.sticks_of(B, ALICE, ONE)
    late += model.bus.on_the_way
    model.bus.on_the_way.clear()
    model._time_passes(0.9)
    for to, packet in late:
        model._deliver(to, packet)
    model.everything_settles()
    assert model.store.leases[ONE].epoch == 1
    assert flown(model) == {}


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("claim_is_under_way", [True, False])
def test_who_was_taken_from_elsewhere_does_not_fly_when_the_drone_comes_back(
    model: TwoTowersModel, claim_is_under_way: bool, told: bool
) -> None:
    """The first tower believed that it was still the drone's home, and that Alice was the holder."""
    model.sticks(A, "holder", ONE, arrives=True)
    model.agent_is_taken_elsewhere_and_comes_back(ONE, claim_is_under_way, told)
    assert model.store.leases[ONE].holder == TOOR
    assert ALICE not in flown(model).get(2, set())


def test_of_two_towers_that_believe_to_be_the_home_one_changes_the_lease(model: TwoTowersModel) -> None:
    model.connect(ONE, B, noticed=False)
    model.towers[B].settle()
    model.bus.on_the_way.clear()
    places = [tower.hub.state.drones[ONE].place for tower in model.towers]
    assert places == [Place.HERE, Place.HERE]
    for number, user_id in ((A, ROOT), (B, TOOR)):
        model.towers[number].ask(user_id, ONE, Event.TAKE, watch=True)
    for tower in model.towers:
        tower.settle()
    assert model.store.leases[ONE].holder == TOOR


def test_a_take_whose_tower_dies_before_it_orders_the_hold_becomes_a_hold_at_the_next(model: TwoTowersModel) -> None:
    model.asks(A, ROOT, ONE, Event.TAKE, at_once=False)
    model.towers[A].step(0)
    model.towers[A].step(0)  # written; the hub does not know yet
    assert model.store.leases[ONE].epoch == 2
    assert model.agents[ONE].held_at < 2
    model.tower_dies(A)
    model.connect(ONE, B, noticed=False)
    model.everything_settles()
    assert model.agents[ONE].held_at == 2


def test_a_holder_elsewhere_counts_as_gone_when_the_bus_is_silent(model: TwoTowersModel) -> None:
    model.towers[A].close_browser(ALICE)
    model.everything_settles()
    model.sticks(B, "holder", ONE, arrives=True)
    for _ in range(40):
        model.bus.on_the_way.clear()
        model._time_passes(0.1)
    assert model.towers[A].hub.state.traffic.holds_ordered > 0
    assert model.store.leases[ONE].holder == ALICE, "the grace time is not over"


def test_a_right_that_ends_before_the_drone_comes_home_ends_the_controls(model: TwoTowersModel) -> None:
    """Found in review: what the hub notices about a drone that is not at home is dropped."""
    model.store.accounts[ALICE].owns.discard(ONE)
    model.store.revision += 1
    model.towers[B].read_fleet()
    model.connect(ONE, B, noticed=True)
    model.everything_settles()
    assert model.store.leases[ONE].holder is None


def test_an_operator_holds_one_drone_over_both_towers(model: TwoTowersModel) -> None:
    model.asks(B, BOB, ONE, Event.ACQUIRE, at_once=True)
    model.asks(A, ALICE, TWO, Event.ACQUIRE, at_once=True)
    assert [lease.holder for lease in model.store.leases.values()] == [ALICE, None]


def test_a_tower_that_ends_closes_no_browser_of_another(model: TwoTowersModel) -> None:
    model.towers[A].hub.close_all()
    model.towers[A].flush()
    model.bus_delivers_all()
    assert set(model.towers[B].browsers) == {ALICE, BOB, ROOT, TOOR}
    assert len(model.towers[A].towers.visitors) == 0


def test_an_account_that_ends_at_one_tower_ends_at_the_other(model: TwoTowersModel) -> None:
    model.browser(A, ALICE, "signs out")
    model.everything_settles()
    assert ALICE not in model.towers[B].browsers
    assert model.agents[ONE].held_at or model.store.leases[ONE].holder is None
