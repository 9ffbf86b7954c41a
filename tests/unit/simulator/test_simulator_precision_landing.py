"""Landing on a LANDING_TARGET as ArduCopter does: what it takes, when it settles, how it descends, what a loss does."""

from __future__ import annotations

import math

import pytest

from simulator.dialect import mavlink as M
from simulator.modes import Mode
from simulator.precision_landing import rotated

PAD = (1.5, -1.0)
ON = {"PLND_TYPE": 1}


def show(station, pad=PAD, *, frame=12, position_valid=1, distance=True, angles_only=False):
    """Sends LANDING_TARGET for a pad at metres north and east of home, seen from where the vehicle is."""
    body = station.body
    roll, pitch, yaw = body.attitude()
    north, east, down = pad[0] - body.north_m, pad[1] - body.east_m, body.alt_m
    # Into body axes: the transpose, column by column.
    axes = [rotated(axis, roll, pitch, yaw) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    x, y, z = (a * north + b * east + c * down for a, b, c in axes)
    length = math.sqrt(x * x + y * y + z * z)
    place = (0.0, 0.0, 0.0) if angles_only else (x, y, z)
    station.send(
        M.MAVLink_landing_target_message(
            0,
            0,
            frame,
            math.atan2(y, z),
            math.atan2(-x, z),
            length if distance else 0.0,
            0.0,
            0.0,
            *place,
            (1.0, 0.0, 0.0, 0.0),
            2,
            position_valid,
        )
    )


def land(station, seconds=60.0, **shown):
    station.set_mode(Mode.LAND)
    end_s = station.now_s + seconds
    while station.flight.armed and station.now_s < end_s:
        show(station, **shown)
        station.run(0.1)
    return math.hypot(station.body.north_m - PAD[0], station.body.east_m - PAD[1])


def test_it_lands_on_the_target(ground):
    station = ground(parameters=ON, wind_mps=5.0, wind_from_deg=70).take_off(8)
    assert land(station) < 0.3
    texts = station.texts()
    assert "PrecLand: Target Found" in texts and "PrecLand: Init Complete" in texts


def test_angles_with_a_distance_lead_it_there_too(ground):
    station = ground(parameters=ON).take_off(8)
    assert land(station, position_valid=0, angles_only=True) < 0.2


@pytest.mark.parametrize(
    ("parameters", "shown"),
    [
        ({"PLND_TYPE": 0}, {}),
        ({"PLND_ENABLED": 0, "PLND_TYPE": 1}, {}),
        (ON, {"distance": False}),
        (ON, {"frame": 1}),
    ],
    ids=["no sensor", "off", "no distance and no range finder", "another frame"],
)
def test_else_it_lands_where_it_is(ground, parameters, shown):
    station = ground(parameters=parameters).take_off(8)
    assert land(station, **shown) == pytest.approx(math.hypot(*PAD), abs=0.15)
    assert "PrecLand: Target Found" not in station.texts()
    told = [text for text in station.texts() if text == "Plnd: Frame not supported"]
    assert len(told) == (1 if shown.get("frame") == 1 else 0)


def test_a_target_is_flown_only_after_two_seconds(ground):
    station = ground(parameters=ON).take_off(8)
    station.set_mode(Mode.LAND)
    for _ in range(19):
        show(station)
        station.run(0.1)
    assert station.flight.precision.target_from_here() is None
    assert station.from_home_m() < 0.2
    for _ in range(4):
        show(station)
        station.run(0.1)
    assert station.flight.precision.target_from_here() == pytest.approx((PAD[0], PAD[1]), abs=0.1)


def test_too_few_sightings_begin_nothing(ground):
    station = ground(parameters=ON).take_off(8)
    show(station)
    station.run(0.7)
    assert "PrecLand: Init Failed" in station.texts()


def test_it_does_not_descend_while_the_target_is_far_to_the_side(ground):
    station = ground(parameters=ON).take_off(10)
    far = (6.0, 0.0)
    for _ in range(25):
        show(station, far)
        station.run(0.1)
    station.set_mode(Mode.LAND)
    before_m = station.body.alt_m
    while station.flight.precision.target_from_here() is None or station.body.north_m < 3.2:
        show(station, far)
        station.run(0.1)
    assert station.body.alt_m > before_m - 0.6


def test_close_to_the_ground_it_goes_slowly(ground):
    station = ground(parameters=ON).take_off(4)
    station.set_mode(Mode.LAND)
    rates = []
    while station.flight.armed:
        show(station)
        station.run(0.1)
        if 0.6 < station.body.alt_m < 1.4:
            rates.append(station.body.vd_mps)
    assert min(rates) > 0.05 and max(rates) < 0.3  # LAND_SPEED is 0.5


def test_a_lost_target_is_told_and_the_landing_goes_on_where_it_is(ground):
    station = ground(parameters=ON).take_off(10)
    for _ in range(25):
        show(station)
        station.run(0.1)
    station.set_mode(Mode.LAND)
    for _ in range(20):
        show(station)
        station.run(0.1)
    station.until(lambda: "PrecLand: Target Lost" in station.texts(), 2.2)
    station.until(lambda: not station.flight.armed)
    assert math.hypot(station.body.north_m - PAD[0], station.body.east_m - PAD[1]) < 1.0


def test_one_wild_sighting_does_not_move_it(ground):
    station = ground(parameters=ON).take_off(8)
    for _ in range(40):
        show(station)
        station.run(0.1)
    show(station, (5.0, 5.0))
    station.run(0.1)
    assert station.flight.precision.target_from_here() == pytest.approx(PAD, abs=0.1)


def test_an_older_estimator_takes_each_sighting_as_it_is(ground):
    station = ground(parameters={**ON, "PLND_EST_TYPE": 0}).take_off(8)
    show(station)
    station.run(0.1)
    assert station.flight.precision.target_from_here() == pytest.approx(PAD, abs=0.1)
