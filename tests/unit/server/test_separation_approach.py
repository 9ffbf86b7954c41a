"""The closest approach of two drones: compared with a simulation that flies them on in small steps."""

from math import cos, hypot, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.airspace.core.separation.approach import conflict_ahead
from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion, Relative, motion_in
from wire.dialect import build, mavlink

STEP_S = 0.02
metres = st.floats(-300, 300)
speeds = st.floats(-20, 20).map(lambda metres_s: metres_s if abs(metres_s) > 0.002 else 0.0)
climbs = st.floats(-4, 4).map(lambda metres_s: metres_s if abs(metres_s) > 0.002 else 0.0)
"""Less than 1 mm/s counts as still: within 30 s that moves a drone by 3 cm at most."""


def flown_on(seen: Relative, at_s: float) -> tuple[float, float]:
    """Returns the distance (over ground, in height) at that time in seconds."""
    east, north = seen.east_m + seen.east_m_s * at_s, seen.north_m + seen.north_m_s * at_s
    return hypot(east, north), abs(seen.up_m + seen.up_m_s * at_s)


@given(
    seen=st.builds(Relative, metres, metres, st.floats(-40, 40), speeds, speeds, climbs),
    horizontal_m=st.floats(5, 60),
    vertical_m=st.floats(3, 30),
)
def test_it_finds_what_a_simulation_finds(seen: Relative, horizontal_m: float, vertical_m: float) -> None:
    flight = [(step * STEP_S, *flown_on(seen, step * STEP_S)) for step in range(int(30 / STEP_S) + 1)]
    near = [(at_s, over, up) for at_s, over, up in flight if over < horizontal_m and up < vertical_m]
    found = conflict_ahead(seen, horizontal_m=horizontal_m, vertical_m=vertical_m, ahead_s=30.0)
    if found is None:
        assert not near
        return
    # The simulation may miss what lasts less than a step, but nothing else.
    over, up = flown_on(seen, found.in_s)
    assert over == pytest.approx(found.horizontal_m) and over <= horizontal_m + 1e-6
    assert up == pytest.approx(found.vertical_m) and up <= vertical_m + 1e-6
    assert 0 <= found.begins_s <= found.in_s <= 30
    if near:
        assert near[0][0] - STEP_S - 1e-6 <= found.begins_s <= near[0][0] + 1e-6
        assert found.horizontal_m <= min(over for _, over, _ in near) + 1e-6


def test_head_on() -> None:
    seen = Relative(0, 400, 2, 0, -20, 0)
    found = conflict_ahead(seen, horizontal_m=20, vertical_m=10, ahead_s=30)
    assert found is not None
    assert (found.begins_s, found.in_s, found.horizontal_m, found.vertical_m) == pytest.approx((19, 20, 0, 2))


@pytest.mark.parametrize(
    ("seen", "why"),
    [
        (Relative(0, 400, 30, 0, -20, 0), "passes 30 m above"),
        (Relative(30, 400, 0, 0, -20, 0), "passes 30 m beside"),
        (Relative(0, 400, 0, 0, 20, 0), "flies away"),
        (Relative(0, 700, 0, 0, -20, 0), "is too far away for now"),
        (Relative(0, 100, 40, 0, -20, -2), "has not come down when it is over it, and is gone when it has"),
        (Relative(0, 0, 30, 0, 0, 2), "climbs away above"),
    ],
)
def test_no_conflict(seen: Relative, why: str) -> None:
    assert conflict_ahead(seen, horizontal_m=20, vertical_m=10, ahead_s=30) is None, why


def test_one_that_comes_down_on_the_other_conflicts_though_neither_moves_over_ground() -> None:
    found = conflict_ahead(Relative(3, 4, 30, 0, 0, -2), horizontal_m=20, vertical_m=10, ahead_s=30)
    assert found is not None
    assert (found.begins_s, found.horizontal_m) == pytest.approx((10, 5))


def test_where_a_drone_is_and_how_it_moves_is_read_from_its_frame() -> None:
    def frame(*fields: int) -> bytes:
        message = mavlink.MAVLink_global_position_int_message(1234, *fields)
        return build(message, system_id=1, component_id=1, sequence=0)

    moving = motion_in(frame(470000000, -85000000, 512_300, 12_300, 150, -250, -120, 9000), 7.0)
    assert moving == Motion(47.0, -8.5, 512.3, 1.5, -2.5, 1.2, 7.0)
    assert motion_in(frame(470000000, 0, 0, 0, 0, 0, 0, 0), 7.0) == Motion(47.0, 0, 0, 0, 0, 0, 7.0)
    assert motion_in(frame(0, 0, 5, 5, 1, 1, 1, 1), 7.0) is None


def motion(north_m: float, east_m: float, *, lon_deg: float = 8.0, at: float = 0.0, **speed: float) -> Motion:
    lon = lon_deg + east_m / METRES_PER_DEGREE / cos(radians(47.0))
    lon = (lon + 180.0) % 360.0 - 180.0
    named = {name: speed.get(name, 0.0) for name in ("north_m_s", "east_m_s", "up_m_s")}
    return Motion(47.0 + north_m / METRES_PER_DEGREE, lon, 500.0, **named, at=at)


@pytest.mark.parametrize("lon_deg", [8.0, 179.9999])
def test_each_is_moved_on_from_the_time_of_its_own_position(lon_deg: float) -> None:
    own = motion(0, 0, lon_deg=lon_deg, at=8.0, north_m_s=10.0)
    other = motion(50, 40, lon_deg=lon_deg, at=9.5, east_m_s=-4.0, up_m_s=1.0)
    seen = Relative.of(own, other, 10.0)
    assert seen == pytest.approx((38, 30, 0.5, -4, -10, 1), abs=0.01)
    assert seen.seen_back() == pytest.approx((-38, -30, -0.5, 4, 10, -1), abs=0.01)


@pytest.mark.parametrize(("north_m", "east_m", "bearing"), [(10, 0, 0), (0, 10, 90), (-10, 0, 180), (0, -10, 270)])
def test_the_bearing_is_clockwise_from_north(north_m: float, east_m: float, bearing: float) -> None:
    seen = Relative.of(motion(0, 0), motion(north_m, east_m), 0.0)
    assert seen.bearing_deg % 360 == pytest.approx(bearing, abs=0.01)
    assert seen.distance_m == pytest.approx(10, rel=0.001)
