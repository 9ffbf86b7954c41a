"""The command line, and the positions of a squad."""

from __future__ import annotations

import itertools
import math

import pytest

from simulator.failure_modes import Failure, PlannedFailure
from simulator.flight_state import FlightSettings
from simulator.geodesy import LocalFrame, Place
from simulator.links import Endpoint, parse_endpoint
from simulator.squad import (
    make_squad,
    parse_failure,
    parse_home,
    parse_parameter,
    parse_wind,
    spread_endpoints,
    standing_places,
)
from simulator.vehicle import VehicleSettings


def test_vehicles_stand_about_twenty_metres_apart():
    places = list(itertools.islice(standing_places(), 40))
    assert places[0] == (0.0, 0.0)
    for i, first in enumerate(places):
        nearest = min(math.dist(first, other) for j, other in enumerate(places) if j != i)
        assert 17 < nearest < 22


def test_a_squad_shares_all_but_place_and_seed():
    settings = VehicleSettings(FlightSettings(Place(47.0, 8.0, 400.0), seed=5), system_id=1)
    squad = make_squad(3, settings)
    assert [v.settings.flight.seed for v in squad] == [5, 6, 7]
    assert {v.settings.system_id for v in squad} == {1}
    assert len({(v.settings.flight.place.lat_deg, v.settings.flight.place.lon_deg) for v in squad}) == 3
    assert make_squad(3, settings)[2].settings == squad[2].settings


def test_endpoints():
    assert parse_endpoint("udp:127.0.0.1:14550") == Endpoint("udp", "127.0.0.1", 14550)
    assert parse_endpoint("tcpin:[::1]:5760") == Endpoint("tcpin", "::1", 5760)
    first = parse_endpoint("udp:localhost:14550")
    assert [e.port for e in spread_endpoints([first], 3)] == [14550, 14551, 14552]
    assert spread_endpoints([first, first], 2) == [first, first]
    with pytest.raises(ValueError, match="2 times --out for 3 vehicles"):
        spread_endpoints([first, first], 3)


@pytest.mark.parametrize("text", ["", "udp", "udp:14550", "udp:host:", "udp:host:99999", "smoke:host:1", "udp:host:0"])
def test_bad_endpoints(text):
    with pytest.raises(ValueError, match="is none of"):
        parse_endpoint(text)


def test_home():
    assert parse_home("47.5,8.5") == (Place(47.5, 8.5, 0.0), 0.0)
    assert parse_home("47.5, 8.5, 400, 270") == (Place(47.5, 8.5, 400.0), 270.0)
    for text in ("", "1", "91,0", "0,181", "1,2,3,4,5", "north,east"):
        with pytest.raises(ValueError, match="is not LAT,LON"):
            parse_home(text)


def test_failures_parameters_and_wind():
    assert parse_failure("gps-lost@60") == PlannedFailure(60.0, Failure.GPS_LOST)
    assert parse_failure("camera-unplugged@20-23.5") == PlannedFailure(20.0, Failure.CAMERA_UNPLUGGED, 23.5)
    assert parse_failure("silent") == PlannedFailure(0.0, Failure.SILENT)
    assert parse_parameter("rtl_alt=700") == ("RTL_ALT", 700.0)
    assert parse_wind("5,270") == (5.0, 270.0)
    for parse, text in (
        (parse_failure, "rain"),
        (parse_failure, "silent@x"),
        (parse_failure, "silent@5-x"),
        (parse_failure, "silent@5-5"),
        (parse_failure, "silent@-5"),
        (parse_parameter, "A"),
        (parse_wind, "x"),
    ):
        with pytest.raises(ValueError, match="is not"):
            parse(text)


def test_local_frame_there_and_back():
    frame = LocalFrame(Place(-33.9, 151.2, 20.0))
    place = frame.to_place(120.0, -80.0, -10.0)
    assert frame.to_local(place.lat_deg, place.lon_deg) == pytest.approx((120.0, -80.0))
    assert place.alt_amsl_m == 30.0
    across = LocalFrame(Place(0.0, 179.9999, 0.0)).to_place(0.0, 50.0, 0.0)
    assert across.lon_deg < -179.99
