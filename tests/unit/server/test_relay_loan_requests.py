"""Permitted requests in a borrower's frames: the tables, row by row, and every known way around a limit."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.control.core.loan_limits import Home, Limits
from server.control.core.loan_requests import LoanBlock, bar_of, words_of
from server.control.core.loan_tables import COMMANDS, ITEMS, MESSAGES
from server.control.core.policy import command_in
from wire.autopilots.ardupilot import ARDUPILOT
from wire.autopilots.profile import AutopilotFamily
from wire.autopilots.px4_multicopter import PX4
from wire.dialect import build, mavlink

M = mavlink
HOME = Home(47.0, 8.0, 500.0)
IN_SPACE = Limits(max_height_m=50.0, radius_m=200.0)
NO_ARMING = Limits(may_arm=False)
NEAR, FAR = (470_010_000, 80_000_000), (470_030_000, 80_000_000)  # 111 m and 334 m north
NOWHERE = (0, 0)
NAN = float("nan")
HEIGHT, RADIUS, UNJUDGED, OWNERS, ARMING = (
    LoanBlock.HEIGHT,
    LoanBlock.RADIUS,
    LoanBlock.UNJUDGED,
    LoanBlock.OWNERS,
    LoanBlock.ARMING,
)
NEW_MESSAGE = b"\xfd\x03\x00\x00\x07\x01\x01\xf0\xff\x7f" + b"abc" + b"\x12\x34"


def sent(message: object) -> bytes:
    return build(message, system_id=255, component_id=190, sequence=1)


def target(place: tuple[int, int], alt_m: float, frame: int = 6, mask: int = 0xDF8) -> bytes:
    fields = (0, 1, 1, frame, mask, *place, alt_m, *[0] * 8)
    return sent(M.MAVLink_set_position_target_global_int_message(*fields))


def item(
    place: tuple[int, int], alt_m: float, command: int = 16, frame: int = 6, *, kind: int = 0, circle_m: float = 0.0
) -> bytes:
    fields = (1, 1, 0, frame, command, 0, 1, 0, circle_m if command == 31 else 0, circle_m, 0, *place, alt_m)
    return sent(M.MAVLink_mission_item_int_message(*fields, mission_type=kind))


def command_int(command: int, place: tuple[int, int], alt_m: float, frame: int = 6, *, circle_m: float = 0.0) -> bytes:
    return sent(M.MAVLink_command_int_message(1, 1, frame, command, 0, 0, -1, 0, circle_m, NAN, *place, alt_m))


def command_long(command: int, *params: float) -> bytes:
    return sent(M.MAVLink_command_long_message(1, 1, command, 0, *params, *[0.0] * (7 - len(params))))


def overrides(*values: int) -> bytes:
    return sent(M.MAVLink_rc_channels_override_message(1, 1, *values, *[0] * (18 - len(values))))


def family_of(px4: bool | None) -> AutopilotFamily | None:
    return None if px4 is None else PX4 if px4 else ARDUPILOT


def bar(frame: bytes, limits: Limits, *, home: Home | None = HOME, armed: bool = False, px4: bool | None = False):
    return bar_of(frame, command_in(frame), limits, home, armed=armed, family=family_of(px4))


@pytest.mark.parametrize(
    ("frame", "expected"),
    [
        # go-to by a set-point
        (target(NEAR, 49.0), None),
        (target(NEAR, 51.0), HEIGHT),
        (target(FAR, 10.0), RADIUS),
        (target(NEAR, 549.0, frame=5), None),
        (target(NEAR, 551.0, frame=5), HEIGHT),
        (target(NEAR, 10.0, frame=11), UNJUDGED),  # above the terrain
        (target(NOWHERE, 10.0), RADIUS),  # for a set-point, a position like any other
        (target(NEAR, 10.0, mask=0xDC7), UNJUDGED),  # a velocity, with a position that is ignored
        (target(NEAR, 10.0, mask=0xDC0), UNJUDGED),  # a velocity and a position
        (sent(M.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0xDF8, *[0] * 11)), UNJUDGED),
        (sent(M.MAVLink_set_attitude_target_message(0, 1, 1, 0, [1, 0, 0, 0], 0, 0, 0, 0.9)), UNJUDGED),
        # go-to by a command
        (command_int(192, NEAR, 40.0), None),
        (command_int(192, FAR, 40.0), RADIUS),
        (command_int(192, NEAR, 60.0), HEIGHT),
        (command_int(192, NEAR, 40.0, circle_m=60.0), None),
        (command_int(192, NEAR, 40.0, circle_m=-100.0), RADIUS),
        (command_int(192, (2**31 - 1, 2**31 - 1), 40.0), None),  # its current position
        (command_int(192, (100, 100), 40.0, frame=1), UNJUDGED),  # local coordinates
        (command_long(192, -1, 0, 0, NAN, 47.003, 8.0, 520.0), RADIUS),
        (command_long(192, -1, 0, 0, NAN, 47.001, 8.0, 520.0), None),
        (command_long(192, -1, 0, 0, NAN, 47.001, 8.0, 560.0), HEIGHT),
        (command_long(34, 500), OWNERS),  # an orbit
        # take-off and a new altitude
        (command_long(22, 0, 0, 0, 0, 0, 0, 20.0), None),
        (command_long(22, 0, 0, 0, 0, 0, 0, 60.0), HEIGHT),
        (command_int(22, NOWHERE, 60.0, frame=3), HEIGHT),
        (command_long(84, 0, 0, 0, 0, 0, 0, 60.0), HEIGHT),
        (command_long(186, 60.0, 3), HEIGHT),
        (command_long(186, 40.0, 3), None),
        (command_long(43001, 0, 0, 0, 0, 0, 0, 900.0), OWNERS),
        (command_long(191, 900.0), OWNERS),  # a go-around climbs
        # missions
        (item(NEAR, 49.0), None),
        (item(FAR, 49.0), RADIUS),
        (item(NEAR, 60.0), HEIGHT),
        (item(NEAR, 60.0, command=82), HEIGHT),
        (item(NEAR, 49.0, command=18, circle_m=500.0), RADIUS),
        (item(NEAR, 49.0, command=31, circle_m=500.0), RADIUS),
        (item(NOWHERE, 49.0, command=17, circle_m=500.0), UNJUDGED),
        (item((1000, 1000), 10.0, frame=1), UNJUDGED),  # local coordinates
        (item(NOWHERE, 0.0, command=20), None),
        (item(FAR, 900.0, command=178), None),  # changes the speed, whatever its position says
        (item(FAR, 900.0, command=179), OWNERS),  # moves home, and with it the limits
        (item(NOWHERE, 0.0, command=180), OWNERS),  # sets a parameter
        (item(NOWHERE, 0.0, command=92), OWNERS),  # gives the drone to another guidance source
        (item(NEAR, 49.0, command=5001, kind=1), OWNERS),  # a corner of the fence
        (item(FAR, 49.0, command=5100, kind=2), OWNERS),  # a rally point
        (sent(M.MAVLink_mission_count_message(1, 1, 3)), None),
        (sent(M.MAVLink_mission_count_message(1, 1, 3, mission_type=1)), OWNERS),
        (sent(M.MAVLink_mission_clear_all_message(1, 1)), None),
        (sent(M.MAVLink_mission_clear_all_message(1, 1, mission_type=255)), OWNERS),
        (sent(M.MAVLink_mission_write_partial_list_message(1, 1, 0, 1, mission_type=1)), OWNERS),
        (sent(M.MAVLink_mission_item_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 47.001, 8.0, 10)), OWNERS),
        (command_long(300), None),
        # modes: a climbing return requires the owner
        (command_long(176, 1, 4), None),
        (command_long(176, 1, 6), None),
        (command_long(20), None),
        (sent(M.MAVLink_set_mode_message(1, 1, 6)), None),
        (sent(M.MAVLink_manual_control_message(1, 1000, 0, 1000, 0, 0)), None),
    ],
)
def test_limits_in_space(frame: bytes, expected: LoanBlock | None) -> None:
    assert bar(frame, IN_SPACE, armed=True) is expected
    assert bar(frame, Limits(), armed=True) is None, "a loan without limits"


@pytest.mark.parametrize(
    ("frame", "while_disarmed", "while_armed"),
    [
        (command_long(400, 1), ARMING, ARMING),
        (command_long(400, NAN), ARMING, ARMING),
        (command_long(400, 0), None, None),
        (command_int(400, NOWHERE, 0.0), None, None),
        (sent(M.MAVLink_command_int_message(1, 1, 0, 400, 0, 0, 1, 21196, 0, 0, 0, 0, 0)), ARMING, ARMING),
        (command_long(300), ARMING, None),  # which PX4 arms for
        (command_long(189), ARMING, None),  # which PX4 arms for
        (command_long(42001), ARMING, OWNERS),
        (command_long(42002), ARMING, OWNERS),
        (command_long(218, 153, 2), ARMING, OWNERS),
        (command_long(218, 9, 2), OWNERS, OWNERS),
        (command_long(209, 1, 0, 10, 5), ARMING, ARMING),
        (command_long(310, 0.5, 1), ARMING, ARMING),
        (command_long(176, 1, 28), ARMING, None),  # turtle
        (command_long(176, 129, 0), ARMING, None),
        (command_long(176, 1, 4), None, None),
        (sent(M.MAVLink_set_mode_message(1, 128, 0)), ARMING, None),
        (sent(M.MAVLink_set_mode_message(1, 1, 28)), ARMING, None),
        (sent(M.MAVLink_set_mode_message(1, 1, 4)), None, None),
        (sent(M.MAVLink_manual_control_message(1, 0, 0, 0, 1000, 0)), ARMING, None),
        (sent(M.MAVLink_manual_control_message(1, 0, 0, 0, -1000, 0)), ARMING, None),
        (sent(M.MAVLink_manual_control_message(1, 0, 0, 500, 0, 1)), ARMING, None),
        (sent(M.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0, 256)), ARMING, None),
        (sent(M.MAVLink_manual_control_message(1, 1000, -1000, 0, 100, 0)), None, None),
        (overrides(1500, 1500, 1000, 2000), ARMING, None),
        (overrides(1500, 1500, 1000, 1000), ARMING, None),
        (overrides(1500, 1500, 1000, 1500), None, None),
        (overrides(1500, 1500, 1500, 1500, 2000), ARMING, None),
        (overrides(*[0] * 15, 1900), ARMING, None),
        (overrides(*[65535] * 8), None, None),
        (target(FAR, 900.0), None, None),
    ],
)
def test_a_loan_without_arming(frame: bytes, while_disarmed: LoanBlock | None, while_armed: LoanBlock | None) -> None:
    assert bar(frame, NO_ARMING, armed=False) is while_disarmed
    assert bar(frame, NO_ARMING, armed=True) is while_armed


@pytest.mark.parametrize("limits", [IN_SPACE, NO_ARMING])
@pytest.mark.parametrize(
    "frame",
    [
        *(
            sent(M.MAVLink_param_set_message(1, 1, name, 0.0, 9))
            for name in (b"FENCE_ENABLE", b"RTL_ALT", b"FS_THR_ENABLE", b"ARMING_REQUIRE", b"GF_ACTION", b"X")
        ),
        sent(M.MAVLink_param_ext_set_message(1, 1, b"X", b"1", 9)),
        sent(M.MAVLink_file_transfer_protocol_message(0, 1, 1, [0] * 251)),
        sent(M.MAVLink_serial_control_message(10, 0, 0, 0, 17, [0] * 70)),
        sent(M.MAVLink_fence_point_message(1, 1, 0, 3, 47.0, 8.0)),
        sent(M.MAVLink_rally_point_message(1, 1, 0, 1, 470030000, 80000000, 10, 0, 0, 0)),
        sent(M.MAVLink_set_home_position_message(1, 1, 1, 1, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)),
        sent(M.MAVLink_set_gps_global_origin_message(1, 0, 0, 0)),
        sent(M.MAVLink_vision_position_estimate_message(0, 0, 0, 0, 0, 0, 0)),
        sent(M.MAVLink_log_erase_message(1, 1)),
        command_long(179, 1),
        command_long(180, 1, 0),
        command_long(207, 0),
        command_long(245, 2),
        command_long(246, 1),
        command_long(183, 1, 2000),
        command_long(420, 1),
        command_long(43003),
        command_long(65000),
        NEW_MESSAGE,
    ],
)
def test_what_stays_the_owners_with_any_limit(frame: bytes, limits: Limits) -> None:
    assert bar(frame, limits) is OWNERS
    assert bar(frame, limits, armed=True) is OWNERS
    assert bar(frame, Limits()) is None


def test_without_a_home_a_place_cannot_be_judged() -> None:
    assert bar(target(NEAR, 10.0), IN_SPACE, home=None) is UNJUDGED
    assert bar(target(NEAR, 10.0), Limits(max_height_m=50), home=None) is None
    assert bar(target(NEAR, 510.0, frame=5), Limits(max_height_m=50), home=None) is UNJUDGED


def test_a_px4_reads_the_altitude_of_a_command_above_the_sea() -> None:
    takeoff = command_long(22, 0, 0, 0, 0, NAN, NAN, 520.0)
    assert bar(takeoff, IN_SPACE, px4=False) is HEIGHT
    assert bar(takeoff, IN_SPACE, px4=True) is None
    # If both readings are possible, both must be within the limit.
    by_the_dead_sea = Home(47.0, 8.0, -400.0)
    go_to = command_int(192, NEAR, 40.0)
    assert bar(go_to, IN_SPACE, home=by_the_dead_sea, px4=False) is None
    assert bar(go_to, IN_SPACE, home=by_the_dead_sea, px4=True) is HEIGHT
    assert bar(go_to, IN_SPACE, home=by_the_dead_sea, px4=None) is HEIGHT
    assert bar(item(NEAR, 40.0), IN_SPACE, home=by_the_dead_sea, px4=True) is None, "missions are read as they are"


@pytest.mark.parametrize("px4", [True, None])
def test_to_a_px4_zero_is_a_place(px4: bool | None) -> None:
    assert bar(item(NOWHERE, 10.0), IN_SPACE, px4=px4) is RADIUS
    assert bar(item(NOWHERE, 10.0), IN_SPACE, px4=False) is None


def test_every_bar_says_which_limit() -> None:
    limits = Limits(False, 50.0, 200.0)
    reported = {one: words_of(one, limits) for one in LoanBlock}
    assert reported[HEIGHT] == "up to 50 m above home, and this goes higher."
    assert reported[RADIUS] == "within 200 m of home, and this goes further."
    assert len(set(reported.values())) == len(LoanBlock)


def test_the_tables_hold_nothing_that_moves_a_limit() -> None:
    known_ways_round = {
        *(M.MAV_CMD_DO_SET_HOME, M.MAV_CMD_DO_SET_PARAMETER, M.MAV_CMD_DO_FENCE_ENABLE, M.MAV_CMD_DO_FOLLOW),
        *(M.MAV_CMD_DO_AUX_FUNCTION, M.MAV_CMD_DO_MOTOR_TEST, M.MAV_CMD_NAV_GUIDED_ENABLE, M.MAV_CMD_DO_ORBIT),
        *(M.MAV_CMD_PREFLIGHT_STORAGE, M.MAV_CMD_EXTERNAL_POSITION_ESTIMATE, M.MAV_CMD_DO_GUIDED_LIMITS),
    }
    assert not known_ways_round & (COMMANDS | ITEMS)
    assert M.MAVLINK_MSG_ID_PARAM_SET not in MESSAGES
    assert M.MAVLINK_MSG_ID_FOLLOW_TARGET not in MESSAGES


@given(
    st.sampled_from([M.MAVLINK_MSG_ID_COMMAND_INT, M.MAVLINK_MSG_ID_MISSION_ITEM_INT, 11, 44, 45, 69, 70, 76, 84, 86]),
    st.binary(max_size=60),
    st.booleans(),
    st.sampled_from([True, False, None]),
)
def test_any_bytes_get_a_decision(msgid: int, body: bytes, armed: bool, px4: bool | None) -> None:
    frame = bytes([0xFD, len(body), 0, 0, 0, 255, 190, *msgid.to_bytes(3, "little")]) + body + b"\0\0"
    bar_of(frame, command_in(frame), Limits(False, 50.0, 200.0), HOME, armed=armed, family=family_of(px4))
