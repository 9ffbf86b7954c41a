"""A command to fly without sticks counts when the autopilot shows it, not when it is sent: rules of
`CommandRequest`."""

import pytest
from onboard_world import (
    ALT_HOLD,
    BRAKE,
    RTL,
    STABILIZE,
    World,
    frame,
    order,
    set_mode,
    sticks,
)

from wire.control_messages import HoldCause
from wire.dialect import mavlink


def reposition() -> bytes:
    message = mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, 0, 0, 1, 2, 3.0)
    return frame(message, system_id=255, component_id=190)


@pytest.mark.parametrize(
    ("command_id", "command"), [(176, set_mode(BRAKE)), (192, reposition())], ids=["mode", "go-to"]
)
@pytest.mark.parametrize("is_answered", [True, False])
def test_a_refused_command_does_not_end_the_hand_on_the_sticks(
    command_id: int, command: bytes, is_answered: bool
) -> None:
    """The gamepad is unplugged: the console requests BRAKE, which an autopilot without a position refuses."""
    world = World(mode=ALT_HOLD)
    world.stream(1.0, x=900)
    world.tower_sends(command)
    if is_answered:
        world.ack(command_id, target=(255, 190), result=mavlink.MAV_RESULT_FAILED)
    world.sent.clear()
    world.pass_time(0.75 if is_answered else 1.75)
    assert world.causes() == {HoldCause.STICKS_STALE}
    assert all((m.x, m.y, m.z, m.r) == (0, 0, 500, 0) for m in world.messages("MANUAL_CONTROL"))
    world.pass_time(1.0)
    assert len(world.messages("MANUAL_CONTROL")) >= 15


@pytest.mark.parametrize("is_answered", [True, False])
def test_a_refused_command_does_not_end_a_hold(is_answered: bool) -> None:
    world = World(mode=STABILIZE)
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.tower_sends(set_mode(RTL), epoch=6)
    if is_answered:
        world.ack(176, target=(255, 190), result=mavlink.MAV_RESULT_FAILED)
    world.sent.clear()
    world.pass_time(1.75)
    assert len(decoded := world.messages("MANUAL_CONTROL", "COMMAND_LONG")) > 30
    assert {int(m.param2) for m in decoded if m.get_type() == "COMMAND_LONG" and m.command == 176} == {ALT_HOLD}
    world.tower_sends(sticks(700), epoch=6)
    assert sticks(700) not in world.sent


def test_targets_in_a_mode_of_sticks_end_neither_the_hand_nor_the_hold() -> None:
    """A program that sends set-points continuously: in ALT_HOLD the autopilot ignores them."""
    target = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0, 0, 0, -5, 0, 0, 0, 0, 0, 0, 0, 0)
    world = World(mode=ALT_HOLD)
    world.stream(1.0, x=900)
    for _ in range(10):
        world.tower_sends(frame(target, system_id=255, component_id=190))
        world.pass_time(0.1)
    assert world.causes() == {HoldCause.STICKS_STALE}
    assert world.messages("MANUAL_CONTROL")


def test_a_command_counts_when_the_autopilot_shows_it_which_it_is_asked_to_do() -> None:
    """PX4 sends heartbeats once a second: longer than sticks may be stale."""
    world = World()
    world.stream(1.0)
    world.tower_sends(set_mode(RTL))
    world.sent.clear()
    world.beats = False
    world.pass_time(1.0)
    asked = [m for m in world.messages("COMMAND_LONG") if m.command == mavlink.MAV_CMD_REQUEST_MESSAGE]
    assert asked
    assert asked[0].param1 == mavlink.MAVLINK_MSG_ID_HEARTBEAT
    world.mode, world.beats = RTL, True
    world.pass_time(3.0)
    assert world.steps() == []
