"""A hold wins over every earlier command, in whichever order the two are executed."""

from __future__ import annotations

import pytest
from drone_world import GUIDED, SET_MODE, DroneWorld, command_work, mavlink

from wire.control_messages import HoldOrder
from wire.transactions import CommandWork, Outcome

REPOSITION = 192
GOTO = CommandWork(command=REPOSITION, params=(-1.0, 1.0, 0.0, None, 0.0, 0.0, 15.0), x=473990000, y=85456000, frame=6)


def hold(world: DroneWorld, order_id: int = 1) -> None:
    world.onboard.message(HoldOrder(order_id=order_id, epoch=world.epoch, reason="a test"), world.now)


def order_of_sending(world: DroneWorld) -> list[str]:
    """Returns the flight commands in the order sent."""
    said = []
    for one in world.asked_of_autopilot("COMMAND_LONG", "COMMAND_INT"):
        if one.command == REPOSITION:
            said.append("goto")
        elif one.command == SET_MODE:
            said.append("hold" if one.get_srcComponent() == 191 else "mode")
    return said


def test_a_hold_that_comes_before_the_next_tick_is_after_the_command() -> None:
    world = DroneWorld().ready().flies()
    before = len(order_of_sending(world))
    world.begin(GOTO)
    hold(world)
    world.run(3.0)
    said = order_of_sending(world)[before:]
    assert said[-1] == "hold", said
    assert world.vehicle.flight.mode != GUIDED


def test_a_frame_that_comes_before_the_next_tick_is_after_the_command() -> None:
    world = DroneWorld().ready().flies()
    before = len(order_of_sending(world))
    world.begin(GOTO)
    world.tower_sends(mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, 5, 0, 0, 0, 0, 0))
    world.run(0.2)
    assert order_of_sending(world)[before:] == ["goto", "mode"]


@pytest.mark.parametrize(("late_s", "carried_out"), [(0.4, False), (0.0, True)])
def test_a_command_that_a_hold_has_overtaken_is_not_carried_out(late_s: float, carried_out: bool) -> None:
    """The hold takes two paths, and the command the slower one of them."""
    world = DroneWorld().ready().flies()
    world.command(178, 1, 5.0)  # from which the agent knows what "not late" is
    hold(world)
    world.run(0.2)
    number = world.begin(GOTO, late_s=late_s)
    result = world.result(number)
    assert (result.outcome is Outcome.DONE) is carried_out, result
    assert bool(world.commands_sent(REPOSITION)) is carried_out
    if not carried_out:
        assert (result.outcome, "hold" in result.words) == (Outcome.REFUSED, True)


def test_what_was_late_before_a_hold_says_nothing_of_what_comes_after_it() -> None:
    world = DroneWorld().ready().flies()
    world.do(command_work(178, 1, 5.0), late_s=0.0)
    hold(world)
    world.run(1.0)
    assert world.do(GOTO, late_s=0.4).outcome is Outcome.DONE
