"""The lost action: what the drone does when the tower stays away."""

from onboard_world import ALT_HOLD, LOITER, RTL, World, order, sticks

from wire.control_messages import (
    HoldCause,
)
from wire.open_holds import LostAction


def flown_in_the_air(mode: int = LOITER) -> World:
    world = World(mode=mode)
    world.climb_to(20.0)
    world.stream(1.0)
    return world


def lose_the_tower(world: World) -> None:
    world.onboard.link_broken(world.now)
    world.tower_there = False


def test_a_tower_that_stays_lost_brings_the_drone_home() -> None:
    world = flown_in_the_air()
    lose_the_tower(world)
    world.pass_time(1.0)
    world.ack(176)
    world.mode = ALT_HOLD
    world.pass_time(28.5)
    assert RTL not in world.modes_asked()
    world.pass_time(1.0)
    assert world.modes_asked()[0] == RTL
    world.ack(176)
    world.mode = RTL
    world.pass_time(5.0)
    world.sent.clear()
    world.pass_time(5.0)
    assert world.modes_asked() == []
    assert not world.messages("MANUAL_CONTROL"), "the centred sticks have ended"
    world.tower_there = True
    world.link_up()
    world.pass_time(5.0)
    assert world.modes_asked() == [], "the mode is not changed when the tower is back"
    world.mode = LOITER
    world.sent.clear()
    world.tower_sends(sticks(500))
    assert sticks(500) not in world.sent, "not before they were centred"


def test_a_guided_flight_is_brought_home_too() -> None:
    world = World(mode=4)
    world.climb_to(20.0)
    lose_the_tower(world)
    world.pass_time(30.5)
    assert world.modes_asked()[0] == RTL


def test_who_flies_by_radio_alone_is_left_alone() -> None:
    world = World()
    world.climb_to(20.0)
    lose_the_tower(world)
    world.pass_time(60.0)
    assert world.modes_asked() == []


def test_a_drone_on_the_ground_is_left_alone() -> None:
    world = World()
    world.stream(1.0)
    lose_the_tower(world)
    world.pass_time(40.0)
    assert RTL not in world.modes_asked()


def test_a_mission_that_a_trigger_stopped_goes_on_where_that_is_wanted() -> None:
    auto = 3
    for epoch, resumed in ((5, True), (6, False)):
        world = World(mode=auto)
        world.climb_to(20.0)
        world.configure(lost_action=LostAction.CONTINUE)
        world.onboard.message(order(epoch=epoch), world.now)
        world.pass_time(0.1)
        world.ack(176)
        world.mode = ALT_HOLD
        world.pass_time(0.1)
        lose_the_tower(world)
        world.sent.clear()
        world.pass_time(31.0)
        assert (auto in world.modes_asked()) is resumed


def test_an_ordered_hold_keeps_the_sticks_centred_when_the_tower_is_lost_in_it() -> None:
    world = flown_in_the_air()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.ack(176)
    world.mode = ALT_HOLD
    world.pass_time(0.1)
    lose_the_tower(world)
    world.pass_time(10.0)
    world.sent.clear()
    world.pass_time(1.0)
    assert len(world.messages("MANUAL_CONTROL")) >= 19
    world.link_up()
    world.collect()
    assert world.causes() == {HoldCause.ORDER}, "it is the same hold"
