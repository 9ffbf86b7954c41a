"""What ends a program's flight, on a fake clock."""

from typing import Any

import pytest

from control_tower.events import ControlChanged, DroneChanged, DroneRemoved, Event, HoldStep, Notice
from control_tower.flight_watch import TOWER_WAITS_S, FlightWatch
from control_tower.values import DroneState, Loss, LossCause, User

ME, ADMIN = User(7, "alice"), User(1, "root")
DRONE, EPOCH = 3, 12


def state(**changed: Any) -> DroneChanged:
    fields: dict[str, Any] = {
        "id": DRONE,
        "name": "Kestrel",
        "online": True,
        "armed": True,
        "airborne": True,
        "holder": ME,
        "epoch": EPOCH,
        "relation": "owner",
        "offered": False,
        "hold_open": False,
        "hold_words": "",
    }
    return DroneChanged(DRONE, DroneState(**(fields | changed)))


def hold(step: str = "ordered", epoch: int = EPOCH) -> HoldStep:
    return HoldStep(DRONE, epoch, step, "in ALT_HOLD", "order")


def watch() -> FlightWatch:
    return FlightWatch(DRONE, ME.id, EPOCH, offline_s=10.0)


def first_loss(watch: FlightWatch, *events: Event) -> Loss | None:
    for event in events:
        if (loss := watch.event(event, 100.0)) is not None:
            return loss
    return watch.check(100.0, tower_there=True)


@pytest.mark.parametrize(
    "event",
    [
        state(),
        state(holder=ADMIN, epoch=EPOCH - 1),
        state(holder=None, epoch=EPOCH - 1),
        ControlChanged(DRONE, "acquired", EPOCH, ME, ME, ""),
        ControlChanged(DRONE, "assisting", EPOCH + 1, ME, ADMIN, ""),
        ControlChanged(DRONE, "released", EPOCH - 1, None, ADMIN, ""),
        ControlChanged(DRONE + 1, "taken", EPOCH, ADMIN, ADMIN, ""),
        hold(epoch=EPOCH - 1),
        hold("not_needed"),
        Notice(DRONE, "warning", "late", "late", 1),
        DroneRemoved(DRONE + 1),
    ],
    ids=repr,
)
def test_what_is_no_loss(event: Event) -> None:
    assert first_loss(watch(), event) is None


@pytest.mark.parametrize("change", ["taken", "revoked", "expired", "released", "given"])
def test_controls_in_other_hands_end_it_with_the_reason(change: str) -> None:
    holder = ADMIN if change == "taken" else None
    loss = first_loss(
        watch(),
        state(holder=holder, epoch=EPOCH + 1),
        ControlChanged(DRONE, change, EPOCH + 1, holder, ADMIN, "a helicopter"),
    )
    assert loss == Loss(LossCause.TAKEN, f"the controls were {change} by root: a helicopter")


def test_the_new_state_alone_ends_it_too() -> None:
    assert first_loss(watch(), state(holder=ADMIN, epoch=EPOCH + 1)) == Loss(
        LossCause.TAKEN, "root has the controls of Kestrel"
    )


def test_a_drone_that_left_the_squad_ends_it() -> None:
    loss = first_loss(watch(), DroneRemoved(DRONE))
    assert loss is not None
    assert loss.cause is LossCause.TAKEN


@pytest.mark.parametrize("event", [hold(), hold("confirmed"), hold("unconfirmed"), state(hold_open=True)], ids=repr)
def test_a_hold_ends_it_and_leaves_the_controls(event: Event) -> None:
    loss = first_loss(watch(), event)
    assert loss is not None
    assert (loss.cause, loss.still_holder) == (LossCause.HELD, True)


def test_the_hold_that_was_there_at_the_beginning_does_not_and_the_next_does() -> None:
    flight = watch()
    flight.expect_hold()
    assert first_loss(flight, state(), hold(), hold("confirmed"), state(hold_open=True), state(hold_open=True)) is None
    assert first_loss(flight, state(hold_open=False)) is None
    assert first_loss(flight, hold()) is not None


def test_a_take_on_the_ground_is_followed_by_no_hold() -> None:
    flight = watch()
    flight.expect_hold()
    assert first_loss(flight, hold("ordered"), hold("not_needed")) is None
    assert first_loss(flight, hold()) is not None


def test_a_tower_out_of_reach_ends_it_when_the_tower_counts_the_pilot_as_lost() -> None:
    flight = watch()
    assert flight.check(50.0, tower_there=False) is None
    assert flight.check(50.0 + TOWER_WAITS_S - 0.1, tower_there=False) is None
    assert flight.check(52.0, tower_there=True) is None
    assert flight.check(53.0, tower_there=False) is None
    loss = flight.check(53.0 + TOWER_WAITS_S, tower_there=False)
    assert loss is not None
    assert (loss.cause, loss.still_holder) == (LossCause.TOWER_LOST, False)


def test_an_offline_drone_ends_it_after_the_patience_of_the_program() -> None:
    flight = watch()
    flight.event(state(online=False), 20.0)
    flight.event(state(online=False, armed=None), 25.0)
    assert flight.check(29.9, tower_there=True) is None
    flight.event(state(), 29.9)
    assert flight.check(40.0, tower_there=True) is None
    flight.event(state(online=False), 50.0)
    loss = flight.check(60.0, tower_there=True)
    assert loss is not None
    assert loss.cause is LossCause.DRONE_LOST
