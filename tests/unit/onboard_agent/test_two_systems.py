"""Several systems on one line, in any order: the agent does and says what it would do and say with its own alone."""

from typing import Any, Final

import msgspec
from hypothesis import given
from hypothesis import strategies as st
from onboard_world import ALT_HOLD, LOITER, World, frame, set_mode

from wire.control_messages import AutopilotState, HoldOrder
from wire.dialect import decode, mavlink

M: Final = mavlink


def beat(system: int, component: int, number: int) -> bytes:
    kind = (M.MAV_TYPE_QUADROTOR, M.MAV_AUTOPILOT_ARDUPILOTMEGA) if component == 1 else (18, 8)
    return frame(
        M.MAVLink_heartbeat_message(*kind, 0x81 if number % 2 else 1, number % 7, 4, 3),
        system_id=system,
        component_id=component,
    )


SAYS: Final = (
    lambda number: M.MAVLink_sys_status_message(0, 0, 0, 0, 11_000 + number, 0, number % 100, 0, 0, 0, 0, 0, 0),
    lambda number: M.MAVLink_global_position_int_message(number, number, number, 0, number * 1000, 0, 0, 0, 0),
    lambda number: M.MAVLink_extended_sys_state_message(0, number % 4),
    lambda number: M.MAVLink_command_ack_message(176, number % 6, 0, 0, 0, 0),
    lambda number: M.MAVLink_param_value_message(b"SYSID_MYGCS", 100.0 + number, 6, 900, 1),
    lambda number: M.MAVLink_rc_channels_message(0, 16, *[1000 + number] * 4, *[0] * 14, 255),
    lambda number: M.MAVLink_statustext_message(3, f"text {number}".encode()),
    lambda number: M.MAVLink_battery_status_message(0, 0, 0, 0, [number] * 10, 0, 0, 0, number % 100),
)
FOREIGN: Final = st.tuples(
    st.sampled_from((2, 3)), st.sampled_from((1, 1, 100, 191)), st.sampled_from((beat, *SAYS)), st.integers(0, 200)
)
STRANGERS: Final = st.lists(st.lists(FOREIGN, max_size=4), min_size=20, max_size=20)


def foreign(one: Any) -> bytes:
    system, component, makes, number = one
    if makes is beat:
        return beat(system, component, number)
    return frame(makes(number), system_id=system, component_id=component)


def flown(strangers: list[list[Any]]) -> tuple[list[Any], list[bytes], list[bytes]]:
    """Two seconds with a hold after the first. Returns what went to the tower, as messages and frames, and what went to
    the autopilot."""
    world = World(armed=True, mode=LOITER)
    up: list[bytes] = []
    for step, others in enumerate(strangers):
        up += world.onboard.from_autopilot([foreign(one) for one in others], world.now)
        if step == 10:
            world.onboard.message(HoldOrder(order_id=1, epoch=6, reason="TAKE"), world.now)
        if step == 12:
            world.mode = ALT_HOLD
        own = frame(SAYS[step % len(SAYS)](step))
        up += world.onboard.from_autopilot([own], world.now)
        world.pass_time(0.1)
        up += world.onboard.frames_to_tower(world.now)
    said = [
        msgspec.structs.replace(one, other_systems=()) if isinstance(one, AutopilotState) else one
        for one in world.reported
    ]
    states = [one for one in said if isinstance(one, AutopilotState)]
    others_said = [one for one in said if not isinstance(one, AutopilotState)]
    changes = [one for number, one in enumerate(states) if not number or one != states[number - 1]]
    return [*changes, *others_said], up, world.sent


@given(STRANGERS)
def test_nothing_that_other_systems_say_changes_what_the_agent_does(strangers: list[list[Any]]) -> None:
    assert flown(strangers) == flown([[] for _ in strangers])


def test_nothing_that_names_another_system_or_all_reaches_the_line() -> None:
    world = World(armed=True, mode=LOITER)
    world.onboard.from_autopilot([beat(2, 1, 1)], world.now)
    world.pass_time(1.0)
    world.sent.clear()

    def arms(system: int) -> bytes:
        return frame(M.MAVLink_command_long_message(system, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), system_id=255)

    def sticks(system: int) -> bytes:
        return frame(M.MAVLink_manual_control_message(system, 100, 0, 500, 0, 0), system_id=255)

    world.tower_sends(arms(2), arms(0), sticks(2), sticks(0), set_mode(ALT_HOLD))
    commands = [decode(one) for one in world.sent]
    named = [one.command for one in commands if one.get_type() == "COMMAND_LONG"]
    assert named == [176], "its own"
    assert not [one for one in commands if one.get_type() == "MANUAL_CONTROL" and one.x == 100]
    assert world.onboard.counts["other-vehicle"] >= 5
    told = [one for one in world.reported if isinstance(one, AutopilotState)]
    assert told[-1].other_systems == (2,)
    assert told[-1].system_id == 1
