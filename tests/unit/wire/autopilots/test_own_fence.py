"""The autopilot's own fence and motors, from its parameters, as ArduPilot's and PX4's own checks judge them."""

from math import cos, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.autopilots.ardupilot import ARDUPILOT
from wire.autopilots.own_fence import why_outside
from wire.autopilots.px4_multicopter import PX4
from wire.plans import PlanItem
from wire.zones.track import Spot

LAT, LON = 47.0, 8.0
HOME = Spot(LAT, LON, 0.0, 500.0)
ON = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ALT_MAX": 100.0, "FENCE_RADIUS": 300.0}
PX4_ON = {"GF_ACTION": 2.0, "GF_MAX_VER_DIST": 100.0, "GF_MAX_HOR_DIST": 300.0}
POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT = 5001, 5002, 5003, 5004


def at(north_m: float, east_m: float, height_m: float | None = 20.0) -> Spot:
    lat = LAT + north_m / 111_319.5
    return Spot(lat, LON + east_m / (111_319.5 * cos(radians(LAT))), height_m, None)


def corner(command: int, count: int, north_m: float, east_m: float) -> PlanItem:
    spot = at(north_m, east_m)
    return PlanItem(command, 3, (count, 0, 0, 0), round(spot.lat_deg * 1e7), round(spot.lon_deg * 1e7))


def square(command: int, side_m: float, north_m: float = 0.0) -> list[PlanItem]:
    half = side_m / 2
    ends = ((half, half), (half, -half), (-half, -half), (-half, half))
    return [corner(command, 4, north_m + north, east) for north, east in ends]


@pytest.mark.parametrize(("family", "values"), [(ARDUPILOT, ON), (PX4, PX4_ON)], ids=["ArduPilot", "PX4"])
def test_height_and_distance_are_judged_with_the_parameters_names(family: object, values: dict[str, float]) -> None:
    fence = family.own_fence(values, None)  # type: ignore[attr-defined]
    assert why_outside(fence, at(200, 0), HOME, ()) is None
    assert why_outside(fence, at(0, 301), HOME, ()) == f"301 m from home, and {fence.radius_name} is 300 m"
    assert why_outside(fence, at(0, 0, 100.6), HOME, ()) == f"101 m above home, and {fence.height_name} is 100 m"
    assert why_outside(fence, at(0, 290), HOME, (), circle_m=20) == f"310 m from home, and {fence.radius_name} is 300 m"
    # What is not known is left to the autopilot.
    assert why_outside(fence, at(0, 301, None), None, ()) is None


def test_a_fence_counts_only_while_it_is_on() -> None:
    off = {**ON, "FENCE_ENABLE": 0.0}
    assert (ARDUPILOT.own_fence({}, None), ARDUPILOT.own_fence(off, None)) == (None, None)
    # DO_FENCE_ENABLE and switches leave the parameter alone; SYS_STATUS shows what they did.
    assert ARDUPILOT.own_fence(off, True) is not None
    assert ARDUPILOT.own_fence(ON, False) is None
    # Of a fence that only reports, SYS_STATUS shows nothing, and the autopilot refuses places all the same.
    assert ARDUPILOT.own_fence({**ON, "FENCE_ACTION": 0.0}, False) is not None
    assert PX4.own_fence({**PX4_ON, "GF_ACTION": 1.0}, None) is None, "it only warns"


def test_only_the_kinds_of_its_type_count() -> None:
    fence = ARDUPILOT.own_fence({**ON, "FENCE_TYPE": 1.0}, None)
    assert fence is not None
    assert why_outside(fence, at(0, 900), HOME, square(POLYGON_IN, 100)) is None
    assert why_outside(fence, at(0, 0, 200), HOME, ()) is not None


def test_areas_and_circles_on_board() -> None:
    fence = ARDUPILOT.own_fence({**ON, "FENCE_TYPE": 4.0}, None)
    assert fence is not None
    kept, excluded = "outside the area that it keeps", "in an area that it excludes"
    items = [*square(POLYGON_IN, 200), *square(POLYGON_OUT, 40, 50)]
    judged = [why_outside(fence, at(north, 0), HOME, items) for north in (0, 50, 90, 120)]
    assert judged == [None, excluded, None, kept]
    assert why_outside(fence, at(-90, 0), HOME, items, circle_m=15) == kept
    assert why_outside(fence, at(20, 0), HOME, items, circle_m=15) == excluded
    circles = [corner(CIRCLE_IN, 100, 0, 0), corner(CIRCLE_OUT, 30, 60, 0)]
    assert [why_outside(fence, at(north, 0), HOME, circles) for north in (0, 60, 101)] == [None, excluded, kept]
    assert why_outside(fence, at(500, 0), HOME, ()) is None, "no area on board"


def test_all_areas_are_kept_unless_one_is_enough() -> None:
    two = [*square(POLYGON_IN, 200), *square(POLYGON_IN, 200, 150)]
    all_of, one_of = (ARDUPILOT.own_fence({**ON, "FENCE_TYPE": 4.0, "FENCE_OPTIONS": bits}, None) for bits in (1, 3))
    assert all_of is not None and one_of is not None
    assert why_outside(all_of, at(75, 0), HOME, two) is None
    assert why_outside(all_of, at(-50, 0), HOME, two) is not None
    assert why_outside(one_of, at(-50, 0), HOME, two) is None
    assert why_outside(one_of, at(400, 0), HOME, two) is not None


@given(
    items=st.lists(
        st.builds(
            PlanItem,
            st.sampled_from([POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT, 5000, 16]),
            params=st.tuples(*(st.none() | st.floats(-5, 70_000, width=32),) * 4),
            x=st.integers(469_000_000, 471_000_000),
            y=st.integers(79_000_000, 81_000_000),
        ),
        max_size=12,
    )
)
def test_no_fence_breaks_the_judgement(items: list[PlanItem]) -> None:
    fence = ARDUPILOT.own_fence(ON, None)
    assert fence is not None
    assert why_outside(fence, at(10, 10), HOME, items) in (
        *(None, "outside the area that it keeps", "in an area that it excludes"),
    )


@pytest.mark.parametrize(
    ("family", "values", "count"),
    [
        (ARDUPILOT, {"FRAME_CLASS": 1.0}, 4),
        (ARDUPILOT, {"FRAME_CLASS": 2.0}, 6),
        (ARDUPILOT, {"FRAME_CLASS": 5.0}, 6),
        (ARDUPILOT, {"FRAME_CLASS": 12.0}, 12),
        (ARDUPILOT, {"FRAME_CLASS": 15.0, "SERVO1_FUNCTION": 33.0, "SERVO2_FUNCTION": 82.0, "SERVO3_FUNCTION": 7.0}, 2),
        (ARDUPILOT, {"FRAME_CLASS": 6.0}, None),
        (ARDUPILOT, {}, None),
        (PX4, {"CA_ROTOR_COUNT": 6.0}, 6),
        (PX4, {"CA_ROTOR_COUNT": 0.0}, None),
        (PX4, {}, None),
    ],
)
def test_the_motors_of_a_frame(family: object, values: dict[str, float], count: int | None) -> None:
    assert family.motor_count(values) == count  # type: ignore[attr-defined]
