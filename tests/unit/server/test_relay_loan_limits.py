"""The limits of a loan: what a frame asks for, and when a hand has flown too far."""

import pytest

from server.relay.loan_limits import Home, Limits, LimitWatch, Place, asks_beyond, home_in, whole_place_in
from server.relay.policy import command_in
from wire.dialect import build, mavlink

HOME = Home(47.0, 8.0, 500.0)
LIMITS = Limits(max_height_m=50.0, radius_m=200.0)
NEAR, FAR = (470_010_000, 80_000_000), (470_030_000, 80_000_000)  # 111 m and 334 m to the north
NAN = float("nan")
M = mavlink


def sent(message: object) -> bytes:
    return build(message, system_id=255, component_id=190, sequence=1)  # type: ignore[arg-type]


def target(place: tuple[int, int], alt_m: float, frame: int = 6) -> bytes:
    return sent(
        M.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, 0xDF8, *place, alt_m, 0, 0, 0, 0, 0, 0, 0, 0)
    )


def item(place: tuple[int, int], alt_m: float, command: int = 16, frame: int = 6) -> bytes:
    return sent(M.MAVLink_mission_item_int_message(1, 1, 0, frame, command, 0, 1, 0, 0, 0, 0, *place, alt_m))


def command_int(command: int, place: tuple[int, int], alt_m: float, frame: int = 6) -> bytes:
    return sent(M.MAVLink_command_int_message(1, 1, frame, command, 0, 0, -1, 0, 0, NAN, *place, alt_m))


def command_long(command: int, *params: float) -> bytes:
    padded = [*params, *[0.0] * (7 - len(params))]
    return sent(M.MAVLink_command_long_message(1, 1, command, 0, *padded))


@pytest.mark.parametrize(
    ("frame", "beyond"),
    [
        (target(NEAR, 49.0), False),
        (target(NEAR, 51.0), True),
        (target(FAR, 10.0), True),
        (target(NEAR, 549.0, frame=5), False),
        (target(NEAR, 551.0, frame=5), True),
        (target(NEAR, 10.0, frame=11), True),  # above the terrain: cannot be judged
        (item(NEAR, 49.0), False),
        (item(FAR, 49.0), True),
        (item(NEAR, 60.0), True),
        (item((0, 0), 0.0, command=20), False),
        (item(FAR, 900.0, command=178), False),  # changes the speed, whatever its place says
        (command_int(192, NEAR, 40.0), False),
        (command_int(192, FAR, 40.0), True),
        (command_int(192, NEAR, 60.0), True),
        (command_long(192, -1, 0, 0, NAN, 47.003, 8.0, 520.0), True),
        (command_long(192, -1, 0, 0, NAN, 47.001, 8.0, 520.0), False),
        (command_long(192, -1, 0, 0, NAN, 47.001, 8.0, 560.0), True),
        (command_long(22, 0, 0, 0, 0, 0, 0, 20.0), False),
        (command_long(22, 0, 0, 0, 0, 0, 0, 60.0), True),
        (command_long(186, 60.0, 3), True),
        (command_long(179, 1), True),
        (command_long(400, 1), False),
        (command_long(176, 1, 4), False),
        (sent(M.MAVLink_manual_control_message(1, 1000, 0, 500, 0, 0)), False),
        (sent(M.MAVLink_set_home_position_message(1, 1, 1, 1, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)), True),
    ],
)
def test_what_a_frame_asks_for(frame: bytes, beyond: bool) -> None:
    assert asks_beyond(frame, command_in(frame), LIMITS, HOME, takeoff_above_sea=False) is beyond
    assert asks_beyond(frame, command_in(frame), Limits(may_arm=False), HOME, takeoff_above_sea=False) is False


def test_without_a_home_a_place_cannot_be_judged() -> None:
    frame = target(NEAR, 10.0)
    assert asks_beyond(frame, None, LIMITS, None, takeoff_above_sea=False)
    assert not asks_beyond(frame, None, Limits(max_height_m=50), None, takeoff_above_sea=False)


def test_a_px4_takes_off_above_the_sea() -> None:
    frame = command_long(22, 0, 0, 0, 0, 0, 0, 520.0)
    assert asks_beyond(frame, command_in(frame), LIMITS, HOME, takeoff_above_sea=False)
    assert not asks_beyond(frame, command_in(frame), LIMITS, HOME, takeoff_above_sea=True)


def test_it_holds_at_the_limit_and_at_each_step_beyond_and_the_way_back_is_free() -> None:
    watch = LimitWatch()

    def at(height_m: float) -> bool:
        return watch.must_hold(LIMITS, Place(47.0, 8.0, 500 + height_m, height_m), HOME) is not None

    heights = [49, 50.5, 51, 53, 54, 56, 58, 55, 52, 51, 49, 51]
    assert [at(height) for height in heights] == [
        *(False, True, False, False, True, False, True),
        *(False, False, False, False, True),
    ]


def test_turning_outward_again_after_coming_nearer_holds_at_once() -> None:
    watch = LimitWatch()
    limits = Limits(max_height_m=50.0)
    told = [watch.must_hold(limits, Place(47, 8, 0, height), None) for height in (60, 62, 52, 54, 55.5)]
    assert [one is not None for one in told] == [True, False, False, False, True]


def test_a_radius_is_measured_over_ground() -> None:
    watch = LimitWatch()
    assert watch.must_hold(LIMITS, Place(47.0017, 8.0, 500, 10), HOME) is None
    why = watch.must_hold(LIMITS, Place(47.0019, 8.0, 500, 10), HOME)
    assert why == "further from home than the 200 m of the loan"
    east_m = HOME.distance_m(47.0, 8.001)
    assert 75 < east_m < 77


def test_places_are_read_from_frames() -> None:
    home = sent(M.MAVLink_home_position_message(470000000, 80000000, 500000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    assert home_in(home) == HOME
    there = sent(M.MAVLink_global_position_int_message(0, 470000000, 80000000, 510000, 10000, 0, 0, 0, 0))
    assert whole_place_in(there) == Place(47.0, 8.0, 510.0, 10.0)
    assert whole_place_in(sent(M.MAVLink_global_position_int_message(0, 0, 0, 0, 0, 0, 0, 0, 0))) is None
