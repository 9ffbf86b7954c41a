"""Centred sticks when the pilot's sticks stop and the autopilot would react: each rule of `stick_keeper.py`."""

from typing import Any

import pytest
from onboard_world import LOITER, RTL, STEP_S, World, order, set_mode

from onboard_agent.autopilot.flight_modes import holds_when_centred
from wire.autopilots.px4_multicopter import custom_mode as px4_custom_mode
from wire.control_messages import ControlChanged, HoldCause
from wire.dialect import mavlink

STABILIZE, ALT_HOLD = 0, 2


def turn(world: World, *, assistant: bool, epoch: int) -> None:
    reported = ControlChanged(epoch=epoch, holder="ada", holder_present=True, assistant_flies=assistant)
    world.onboard.message(reported, world.now)


def flown_by_hand(mode: int = LOITER, *, receiver: bool | None = True) -> World:
    world = World(mode=mode, receiver=receiver)
    world.stream(1.0, x=800)
    world.sent.clear()
    return world


def axes(world: World) -> list[Any]:
    return [message.x for message in world.messages("MANUAL_CONTROL")]


@pytest.mark.parametrize("mode", [LOITER, ALT_HOLD])
def test_an_assistant_who_only_commands_leaves_the_sticks_centred_and_nothing_goes_stale(mode: int) -> None:
    world = flown_by_hand(mode)
    turn(world, assistant=True, epoch=6)
    world.pass_time(3.0)
    sent = axes(world)
    assert set(sent) == {0}
    assert 50 <= len(sent) <= 60, "at 20 Hz, from a quarter of a second on"
    assert world.steps() == []
    # The turn is over: the holder flies on, with the usual time to resume.
    turn(world, assistant=False, epoch=7)
    world.pass_time(0.4)
    world.sent.clear()
    world.stream(0.5, x=800, epoch=7)
    assert set(axes(world)) == {800}
    assert world.steps() == []


def test_a_holder_who_does_not_come_back_after_the_turn_is_stale() -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.pass_time(1.0)
    turn(world, assistant=False, epoch=7)
    world.pass_time(0.4)
    assert world.steps() == []
    world.pass_time(0.2)
    assert world.causes() == {HoldCause.STICKS_STALE}


def test_the_assistants_own_sticks_win_at_once_and_need_not_be_let_go_into_a_hold() -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.pass_time(1.0)
    world.sent.clear()
    world.stream(1.0, x=-500, epoch=6)
    assert set(axes(world)) == {-500}
    world.pass_time(0.9)
    assert set(axes(world)) == {0}
    assert world.steps() == []


def test_in_a_mode_that_does_not_hold_by_itself_the_sticks_go_stale() -> None:
    world = flown_by_hand(STABILIZE)
    turn(world, assistant=True, epoch=6)
    world.pass_time(0.6)
    assert world.causes() == {HoldCause.STICKS_STALE}


def test_what_flies_by_itself_needs_no_sticks() -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.tower_sends(set_mode(RTL), epoch=6)
    world.mode = RTL
    world.sent.clear()
    world.pass_time(2.0)
    assert axes(world) == []
    assert world.steps() == []


def test_where_nobody_flew_by_hand_no_sticks_are_sent() -> None:
    world = World(mode=LOITER)
    turn(world, assistant=True, epoch=6)
    world.pass_time(2.0)
    assert axes(world) == []


def test_it_has_no_end_by_time() -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.pass_time(60.0)
    world.sent.clear()
    world.pass_time(1.0)
    assert len(axes(world)) >= 19
    assert world.steps() == []


def test_a_lost_tower_ends_it_in_a_hold() -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.pass_time(1.0)
    world.tower_there = False
    world.pass_time(1.8)
    assert world.steps() == []
    world.pass_time(0.4)
    assert world.causes() == {HoldCause.PILOT_LOST}


@pytest.mark.parametrize("broken", [True, False])
def test_a_link_that_broke_or_was_renewed_knows_of_no_turn(broken: bool) -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.pass_time(1.0)
    if broken:
        world.onboard.link_broken(world.now)
    else:
        world.link_up(epoch=6)
    world.pass_time(0.6)
    assert world.causes() | {HoldCause.STICKS_STALE} == {HoldCause.STICKS_STALE}
    world.link_up(epoch=6)
    world.pass_time(STEP_S)
    assert world.causes() == {HoldCause.STICKS_STALE}


def test_an_order_to_hold_takes_over_and_old_news_of_the_turn_changes_nothing() -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.pass_time(1.0)
    world.onboard.message(order(epoch=7), world.now)
    turn(world, assistant=True, epoch=6)
    world.tower_sends(set_mode(LOITER), epoch=7)
    world.pass_time(0.2)
    assert world.onboard.hold.sticks_on, "those that are sent are the hold's"
    assert world.causes() == {HoldCause.ORDER}


def test_disarmed_there_is_nothing_to_keep() -> None:
    world = flown_by_hand()
    turn(world, assistant=True, epoch=6)
    world.pass_time(0.5)
    world.armed = False
    world.pass_time(0.1)
    world.sent.clear()
    world.pass_time(1.0)
    assert axes(world) == []


def test_which_modes_hold_when_centred() -> None:
    copter, px4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4
    assert [mode for mode in range(30) if holds_when_centred(copter, mode)] == [2, 5, 7, 16]
    assert [main for main in range(9) if holds_when_centred(px4, px4_custom_mode(main, 0))] == [2, 3]
    assert not holds_when_centred(8, 5)
