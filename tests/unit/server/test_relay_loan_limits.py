"""The limits of a loan: when a borrower has flown too far by hand. For the requests see test_relay_loan_requests.py."""

from server.control.core.loan_limits import Home, Limits, LimitWatch, Place, home_in, whole_place_in
from wire.dialect import build, mavlink

HOME = Home(47.0, 8.0, 500.0)
LIMITS = Limits(max_height_m=50.0, radius_m=200.0)
M = mavlink


def sent(message: object) -> bytes:
    return build(message, system_id=255, component_id=190, sequence=1)  # type: ignore[arg-type]


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
    reported = [watch.must_hold(limits, Place(47, 8, 0, height), None) for height in (60, 62, 52, 54, 55.5)]
    assert [one is not None for one in reported] == [True, False, False, False, True]


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
