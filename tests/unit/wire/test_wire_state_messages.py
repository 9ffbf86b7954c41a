"""Which messages are state, and what distinguishes two of a kind."""

import pytest

from wire.dialect import build, mavlink
from wire.state_messages import state_key

M = mavlink


def key(message: object) -> tuple[int, int, int, int] | None:
    return state_key(build(message, system_id=7, component_id=1, sequence=0))


@pytest.mark.parametrize(
    ("one", "same", "other"),
    [
        (
            M.MAVLink_named_value_float_message(1, b"wind", 1.0),
            M.MAVLink_named_value_float_message(2, b"wind", 2.0),
            M.MAVLink_named_value_float_message(1, b"windy", 1.0),
        ),
        (
            M.MAVLink_named_value_int_message(1, b"a", 1),
            M.MAVLink_named_value_int_message(2, b"a", -1),
            M.MAVLink_named_value_int_message(1, b"b", 1),
        ),
        (
            M.MAVLink_debug_vect_message(b"est", 1, 0.0, 0.0, 0.0),
            M.MAVLink_debug_vect_message(b"est", 2, 1.0, 2.0, 3.0),
            M.MAVLink_debug_vect_message(b"ctl", 1, 0.0, 0.0, 0.0),
        ),
        (
            M.MAVLink_debug_message(1, 3, 1.0),
            M.MAVLink_debug_message(2, 3, 0.0),
            M.MAVLink_debug_message(1, 4, 1.0),
        ),
        (
            M.MAVLink_actuator_control_target_message(1, 2, [0.0] * 8),
            M.MAVLink_actuator_control_target_message(2, 2, [1.0] * 8),
            M.MAVLink_actuator_control_target_message(1, 0, [0.0] * 8),
        ),
        (
            M.MAVLink_raw_rpm_message(1, 100.0),
            M.MAVLink_raw_rpm_message(1, 200.0),
            M.MAVLink_raw_rpm_message(2, 100.0),
        ),
        (
            M.MAVLink_obstacle_distance_message(1, 1, [9] * 72, 5, 10, 20),
            M.MAVLink_obstacle_distance_message(2, 1, [8] * 72, 5, 10, 20),
            M.MAVLink_obstacle_distance_message(1, 2, [9] * 72, 5, 10, 20),
        ),
    ],
    ids=["named float", "named int", "debug vector", "debug", "actuators", "rpm", "obstacles"],
)
def test_the_newest_replaces_its_like_and_nothing_else(one: object, same: object, other: object) -> None:
    assert key(one) is not None
    assert key(one) == key(same)
    assert key(one) != key(other)


@pytest.mark.parametrize(
    "message",
    [
        M.MAVLink_command_ack_message(400, 0),
        M.MAVLink_statustext_message(4, b"PreArm: no"),
        M.MAVLink_param_value_message(b"X", 1.0, 9, 1, 0),
        M.MAVLink_mission_item_reached_message(3),
        M.MAVLink_mission_request_int_message(255, 190, 1),
        M.MAVLink_collision_message(0, 1, 0, 0, 1.0, 1.0, 1.0),
        M.MAVLink_file_transfer_protocol_message(0, 255, 190, [0] * 251),
        M.MAVLink_log_data_message(1, 0, 90, [0] * 90),
    ],
    ids=lambda message: str(message.get_type()),
)
def test_what_happened_is_never_replaced(message: object) -> None:
    assert key(message) is None
