"""What falls and what has crashed, by height and descent."""

import math

from hypothesis import given
from hypothesis import strategies as st

from server.alerts.core.fall_watch import TIPPED_FOR_S, FallWatch
from wire.dialect import build, mavlink

LOOK_S = 0.5
G = 9.81


class Seen:
    """Looks twice a second at a drone that the test moves."""

    def __init__(self) -> None:
        self.watch, self.now = FallWatch(), 100.0

    def look(
        self,
        height_m: float,
        down_m_s: float = 0.0,
        *,
        tilt_deg: float = 0.0,
        armed: bool = True,
        airborne: bool | None = None,
        may_dive: bool = False,
        forward_m_s: float = 0.0,
    ) -> None:
        self.now += LOOK_S
        place = mavlink.MAVLink_global_position_int_message(
            0, 1, 1, 0, int(height_m * 1000), int(forward_m_s * 100), 0, int(down_m_s * 100), 0
        )
        attitude = mavlink.MAVLink_attitude_message(0, math.radians(tilt_deg), 0, 0, 0, 0, 0)
        position, tilted = (build(one, system_id=1, component_id=1, sequence=0) for one in (place, attitude))
        self.watch.look(
            position=position,
            position_at=self.now,
            attitude=tilted,
            armed=armed,
            airborne=armed if airborne is None else airborne,
            may_dive=may_dive,
            now=self.now,
        )


def fall(seen: Seen, from_m: float, *, armed: bool) -> float:
    """Lets it fall freely. Returns after how many seconds that was said."""
    said_after_s, time_s = math.inf, 0.0
    while (height_m := from_m - G * time_s**2 / 2) > 0:
        seen.look(height_m, G * time_s, armed=armed)
        if seen.watch.falls:
            said_after_s = min(said_after_s, time_s)
        time_s += LOOK_S
    for _ in range(3):
        seen.look(0.0, 0.0, armed=armed, tilt_deg=120)
    return said_after_s


def test_a_fall_is_seen_within_two_seconds_armed_or_not() -> None:
    for armed in (True, False):
        seen = Seen()
        assert fall(seen, 28.0, armed=armed) <= 2.0
        assert not seen.watch.falls
        assert seen.watch.crashed.startswith("it fell about")


def test_what_sinks_is_told_apart_from_what_falls() -> None:
    seen = Seen()
    seen.look(20.0, 1.0)
    assert not seen.watch.sinks
    seen.look(19.5, 1.2)
    assert seen.watch.sinks == "1.2 m/s, 20 m above home"
    seen.look(19.4, 0.1)
    assert not seen.watch.sinks


def test_one_wrong_report_is_no_fall() -> None:
    seen = Seen()
    seen.look(30.0)
    seen.look(30.0, 9.0)
    seen.look(30.0, 0.2)
    assert not (seen.watch.falls or seen.watch.crashed)


def test_a_fall_that_is_caught_is_no_crash() -> None:
    seen = Seen()
    for height_m, down_m_s in ((60, 7), (56, 8), (52, 7), (50, 2), (50, 0)):
        seen.look(height_m, down_m_s)
    assert not (seen.watch.falls or seen.watch.crashed)


def test_a_fall_onto_a_hill_is_a_crash() -> None:
    seen = Seen()
    for height_m, down_m_s in ((80, 0), (77, 7), (72, 9), (67, 11), (65, 0)):
        seen.look(height_m, down_m_s)
    assert seen.watch.crashed == "it fell about 15 m to the ground"


def test_a_wreck_that_bounces_does_not_fly_again() -> None:
    seen = Seen()
    for height_m, down_m_s in ((30, 0), (24, 9), (14, 12), (3, 14), (0, -3.4), (1.2, -1), (0.1, 0)):
        seen.look(height_m, down_m_s)
    assert seen.watch.crashed == "it fell about 30 m to the ground"
    seen.look(4.0, -1.0)
    assert not seen.watch.crashed


def test_a_hand_may_dive() -> None:
    seen = Seen()
    for height_m in (90, 84, 78):
        seen.look(height_m, 12.0, may_dive=True)
    assert not seen.watch.falls
    for height_m in (70, 62, 54):
        seen.look(height_m, 16.0, may_dive=True)
    assert seen.watch.falls


def test_what_lies_on_its_side_has_crashed_until_it_flies_again() -> None:
    seen = Seen()
    for _ in range(int(TIPPED_FOR_S / LOOK_S) + 2):
        seen.look(0.0, tilt_deg=90.0)
    assert seen.watch.crashed == "it lies on its side with its motors armed"
    seen.look(0.0, tilt_deg=90.0, armed=False)
    seen.look(0.0, armed=False)
    assert seen.watch.crashed, "nobody has flown it since"
    seen.look(0.0)
    assert not seen.watch.crashed


def test_a_flip_in_the_air_is_no_crash() -> None:
    seen = Seen()
    for _ in range(4):
        seen.look(40.0, tilt_deg=170.0, forward_m_s=3.0)
    assert not seen.watch.crashed


@given(st.lists(st.tuples(st.floats(-5, 120), st.floats(-8, 5.9), st.floats(0, 60)), max_size=50))
def test_ordinary_flight_is_never_a_fall(story: list[tuple[float, float, float]]) -> None:
    seen = Seen()
    for height_m, down_m_s, tilt_deg in story:
        seen.look(height_m, down_m_s, tilt_deg=tilt_deg)
        assert not (seen.watch.falls or seen.watch.crashed)


def test_motors_that_stop_in_the_air_are_told_within_a_second() -> None:
    seen = Seen()
    seen.look(61.0)
    seen.look(61.0 - 0.3, 2.4, armed=False)
    assert not seen.watch.stopped
    seen.look(61.0 - 2.6, 7.1, armed=False)
    assert seen.watch.stopped == "61 m above home"
    for _ in range(10):
        seen.look(0.0, 0.0, armed=False)
    assert seen.watch.stopped, "until it is armed again"
    seen.look(0.0, 0.0, armed=True, airborne=False)
    assert not seen.watch.stopped


def test_a_landing_whose_ground_is_told_late_stops_nothing_in_the_air() -> None:
    seen = Seen()
    seen.look(12.4, 0.4)
    for _ in range(12):
        seen.look(12.2, 0.0, armed=False)  # on a roof
    seen.look(5.0, 7.0, armed=False)  # carried down the stairs
    assert not seen.watch.stopped


def test_what_was_disarmed_on_the_ground_is_not_in_the_air() -> None:
    seen = Seen()
    seen.look(0.0, 0.0, armed=True, airborne=False)
    seen.look(0.0, 4.0, armed=False)
    assert not seen.watch.stopped
