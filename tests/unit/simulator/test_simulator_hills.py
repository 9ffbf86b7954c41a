"""The hills: the same in the map as under the vehicles, flat at home, and flown over along straight lines."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from simulator.airframe_model import AirframeModel
from simulator.dialect import mavlink
from simulator.flight_state import FlightSettings
from simulator.geodesy import LocalFrame, Place, e7
from simulator.land_map import elevation
from simulator.land_map.tile_grid import TileGrid
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode
from simulator.squad import make_squad
from simulator.terrain import ground_around, hills_m
from simulator.vehicle import VehicleSettings

HOME = Place(47.397742, 8.545594, 488.0)


def test_the_squad_stands_on_flat_land_among_hills() -> None:
    around = [(40 * math.cos(a), 40 * math.sin(a)) for a in range(6)]
    assert all(abs(hills_m(north, east)) < 0.03 for north, east in around)
    wide = [hills_m(float(north), float(east)) for north in range(-2000, 2000, 100) for east in range(-2000, 2000, 100)]
    assert max(wide) > 50 and min(wide) < -25


def test_the_map_has_the_heights_of_the_ground_that_vehicles_touch() -> None:
    grid = TileGrid(LocalFrame(HOME))
    tile = grid.around_home(14, 2)[1]
    picture = cv2.imdecode(np.frombuffer(elevation.encoded(elevation.heights(grid, tile)), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    for row, column in ((0, 0), (17, 200), (255, 255)):
        blue, green, red = (int(part) for part in picture[row, column])
        east_m, north_m = grid.corner_m(tile, (column + 0.5) / 256, (row + 0.5) / 256)
        read_m = red * 256 + green + blue / 256 - 32_768
        assert read_m == pytest.approx(488.0 + ground_around(0.0, 0.0)(north_m, east_m), abs=0.02)


def test_each_vehicle_of_a_squad_stands_on_the_same_land() -> None:
    vehicles = make_squad(40, VehicleSettings(FlightSettings(HOME)), hills=True)
    frame = LocalFrame(HOME)
    for vehicle in vehicles[::13]:
        place = vehicle.settings.flight.place
        north_m, east_m = frame.to_local(place.lat_deg, place.lon_deg)
        assert vehicle.flight.body.ground_m() == 0.0
        assert place.alt_amsl_m == pytest.approx(488.0 + hills_m(north_m, east_m))


def on_hills(station, north_m: float, east_m: float) -> None:
    """Puts home in the middle of the hills, where the ground is not flat."""
    station.body.ground = ground_around(north_m, east_m)


def fly(station, *legs: tuple[float, float, float]) -> None:
    items = []
    for north_m, east_m, alt_m in legs:
        place = station.flight.origin.to_place(north_m, east_m, 0)
        items.append(Item(16, 3, x=e7(place.lat_deg), y=e7(place.lon_deg), z=alt_m))
    take_off = Item(22, 3, z=legs[0][2])
    station.flight.plans.store(PlanKind.MISSION, [Item(16, 0), take_off, *items], station.flight.home)
    station.set_mode(Mode.GUIDED)
    station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    station.command(mavlink.MAV_CMD_MISSION_START)


def test_a_leg_is_a_straight_line_in_space(ground) -> None:
    station = ground().ready()
    fly(station, (0.0, 1.0, 20.0), (100.0, 0.0, 50.0), (200.0, 0.0, 35.0))
    station.until(lambda: station.body.north_m > 15.0, 60)
    while station.body.north_m < 195.0:
        north_m = station.body.north_m
        line_m = 20.0 + 0.3 * north_m if north_m < 100.0 else 50.0 - 0.15 * (north_m - 100.0)
        assert abs(station.body.alt_m - line_m) < 1.5
        station.run(0.5)


def test_a_drone_that_flies_into_a_hill_crashes_and_one_above_it_does_not(ground) -> None:
    for height_m, crashes in ((12.0, True), (45.0, False)):
        station = ground().ready()
        on_hills(station, -870.0, 420.0)
        slope = station.body.ground(260.0, 0.0)
        assert 13.0 < slope < 40.0
        fly(station, (0.0, 1.0, height_m), (260.0, 0.0, height_m))
        station.until(lambda one=station: one.body.north_m > 250.0 or not one.flight.armed, 120)
        assert ("Crash: Disarming" in station.texts()) is crashes


def test_a_drone_lands_on_a_hillside(ground) -> None:
    station = ground().ready()
    on_hills(station, -870.0, 420.0)
    fly(station, (0.0, 1.0, 45.0), (200.0, 0.0, 45.0))
    station.until(lambda: station.body.north_m > 198.0, 120)
    station.set_mode(Mode.LAND)
    station.until(lambda: not station.flight.armed, 120)
    assert station.body.alt_m == pytest.approx(station.body.ground(station.body.north_m, station.body.east_m))
    assert station.body.alt_m > 10.0


def ramp_m(north_m: float, _east_m: float) -> float:
    return 0.3 * max(north_m - 6.0, 0.0)


@pytest.mark.parametrize("model", AirframeModel)
def test_a_drone_that_restarts_on_a_slope_is_where_it_was(ground, model: AirframeModel) -> None:
    station = ground(model=model, boot_s=2.0).ready()
    station.body.ground = ramp_m
    fly(station, (0.0, 1.0, 5.0), (18.0, 0.0, 6.0))
    station.until(lambda: station.body.north_m > 17.0)
    station.set_mode(Mode.LAND)
    station.until(lambda: not station.flight.armed)
    north_m, east_m, height_m, _ = station.body.true_pose
    assert height_m == pytest.approx(ramp_m(north_m, east_m), abs=0.03)
    assert height_m == pytest.approx(station.body.ground_m(), abs=0.03)
    assert height_m > 2.0
    station.command(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    station.run(0.5)
    station.body.ground = ramp_m
    station.ready()
    assert station.body.true_pose[:3] == pytest.approx((north_m, east_m, height_m), abs=0.05)
    believed_m = (station.body.north_m, station.body.east_m, station.body.alt_m)
    assert believed_m == pytest.approx((north_m, east_m, height_m), abs=2.0)
    assert station.tilt_deg() < 2.0


@pytest.mark.parametrize("model", AirframeModel)
def test_a_drone_that_flies_level_into_a_slope_crashes(ground, model: AirframeModel) -> None:
    station = ground(model=model, boot_s=2.0).ready()
    station.body.ground = ramp_m
    fly(station, (0.0, 1.0, 4.0), (60.0, 0.0, 4.0))
    station.until(lambda: not station.flight.armed)
    assert "Crash: Disarming" in station.texts()
    assert station.body.true_pose[0] == pytest.approx(6.0 + 4.0 / 0.3, abs=3.0)
