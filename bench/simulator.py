"""The flight controller of `simulator/`: a hundred in real time on one core, and the errors of filter and control.

One process with one thread flies 100 vehicles: physics, sensors, filter, trajectory, cascade, commander. Then it flies
five minutes with noise, 30 s without GPS, an eight, and a hover in 8 m/s with gusts, and reports errors over all
vehicles.

Before that it flies as many vehicles of `tower-sim` in a hover, without links: airframe, modes, commander, telemetry.
"""

from __future__ import annotations

import argparse
import itertools
import time

import numpy as np

from bench.rows import Report
from simulator.airframe_model import AirframeModel
from simulator.control.figure_of_eight import FigureOfEight
from simulator.control.trajectory import Trajectory, WayPoint, plan
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.recorder import Recorder, level, rms
from simulator.flight_constants import TICK_S
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.modes import Mode
from simulator.physics.rotation import Floats
from simulator.sensors.satellites import MULTIPATH_TIME_S, SLOW_TIME_S, Wander
from simulator.squad import make_squad, step_together
from simulator.vehicle import VehicleSettings

DRONES = 100
FLIGHT_S = 300.0
SPEED_S = 20.0
TOWER_SIM_S = 10.0
HOME = Place(47.3977, 8.5456, 488.0)
OUTAGE_S = 30.0
HOVER_WIND_MPS, HOVER_S = 8.0, 60.0
HASTY_M = (0.6, 0.6, 1.2)
"""Of a receiver whose whole error changes within a minute; the filter is not told."""
UP_M = 6.0
NEAR_M = 0.3
Way = Trajectory | FigureOfEight


async def run(report: Report, options: argparse.Namespace) -> None:
    count, flight_s = options.drones or DRONES, options.seconds or FLIGHT_S
    if options.quick:
        count, flight_s = options.drones or 10, options.seconds or 40.0
    _tower_sim(report, count)
    _speed(report, sorted({1, 10, count}))
    _five_minutes(report, count, flight_s)
    _arrivals(report, count)
    _eight(report, count)
    _hover(report, count)


def _tower_sim(report: Report, count: int) -> None:
    for model, commander in itertools.product(AirframeModel, (False, True)):
        flight = FlightSettings(HOME, boot_s=1.0, wind_mps=5.0, commander=commander, model=model)
        vehicles = make_squad(count, VehicleSettings(flight))
        step_together(vehicles, 2.0)
        for vehicle in vehicles:
            vehicle.flight.set_mode(Mode.GUIDED)
            if not vehicle.flight.arm() or not vehicle.flight.flying.take_off(10.0):
                raise RuntimeError("a vehicle does not take off")
        began, now_s = time.process_time(), 2.0
        while now_s < 2.0 + TOWER_SIM_S:
            now_s += TICK_S
            step_together(vehicles, now_s)
            for vehicle in vehicles:
                vehicle.datagrams_to_send()
        share = (time.process_time() - began) / TOWER_SIM_S
        if min(vehicle.flight.body.alt_m for vehicle in vehicles) < 5.0:
            raise RuntimeError("a vehicle does not fly")
        case = f"{count} vehicles of tower-sim, {model}{', commander' if commander else ''}"
        report.add(case, "share_of_a_core_in_real_time", share * 100.0, "%")


def _ready(count: int, **settings: float) -> Fleet:
    fleet = Fleet(FleetSettings(count=count, **settings))  # type: ignore[arg-type]
    fleet.boot()
    fleet.arm()
    return fleet


def _fly(fleet: Fleet, way: Way, duration_s: float, recorder: Recorder | None = None) -> float:
    """Returns the seconds of processor time that it took."""
    began, began_s = time.process_time(), fleet.now_s
    while fleet.now_s < began_s + duration_s - 1e-9:
        fleet.step(way.at(fleet.now_s - began_s))
        if recorder is not None:
            recorder.note()
    return time.process_time() - began


def _rounds(duration_s: float) -> Trajectory:
    square = [WayPoint(10, 0, 10), WayPoint(10, 10, 12), WayPoint(0, 10, 10), WayPoint(0, 0, 8)]
    return plan(square * (int(duration_s / 20.0) + 1), take_off_m=10.0, pause_s=0.5, land=False)


def _speed(report: Report, counts: list[int]) -> None:
    way = _rounds(SPEED_S)
    for count in counts:
        fleet = _ready(count, wind_mps=5.0)
        steps = SPEED_S / fleet.dt_s
        busy_s = _fly(fleet, way, SPEED_S)
        case = f"{count} drones at {1.0 / fleet.dt_s:.0f} Hz"
        report.add(case, "simulated_per_processor_second", SPEED_S / busy_s, "s")
        report.add(case, "step", busy_s / steps * 1e6, "us")
        report.add(case, "step_of_one_drone", busy_s / steps / count * 1e6, "us")
        report.add(case, "share_of_a_core_in_real_time", busy_s / SPEED_S * 100.0, "%")


def _errors(report: Report, case: str, recorder: Recorder) -> None:
    error_m = recorder.position_error_m()
    report.add(case, "attitude_rms", rms(np.linalg.norm(recorder.column("attitude_error_deg"), axis=1)), "deg")
    report.add(case, "position_rms", rms(level(error_m)), "m")
    report.add(case, "height_rms", rms(error_m[:, 2]), "m")
    for kind, fit in recorder.fits.items():
        if kind != "standing":
            report.add(case, f"{kind}_innovations_within_95", fit.share_inside * 100.0, "%")
            report.add(case, f"{kind}_normalised_innovation_mean", fit.mean, "1")


def _five_minutes(report: Report, count: int, flight_s: float) -> None:
    fleet, way = _ready(count, wind_mps=5.0), _rounds(flight_s)
    recorder = Recorder(fleet)
    _fly(fleet, way, flight_s, recorder)
    _errors(report, f"{flight_s:.0f} s with noise, wind 5 m/s", recorder)
    case = f"{OUTAGE_S:.0f} s without GPS"
    fleet.board.gps.lost[:] = True
    still, recorder = Trajectory(way.at(flight_s).position_m), Recorder(fleet, period_s=1.0)
    _fly(fleet, still, OUTAGE_S, recorder)
    off_m = level(recorder.position_error_m())
    for second in (5, 10, 20, int(OUTAGE_S) - 1):
        report.spread(case, f"position_error_after_{second}_s", off_m[second].tolist(), "m")
    report.add(case, "attitude_rms", rms(np.linalg.norm(recorder.column("attitude_error_deg"), axis=1)), "deg")


def _worst(case: str, report: Report, off_m: Floats) -> None:
    report.spread(case, "worst_of_each_off_reference", level(off_m).max(axis=0).tolist(), "m")
    report.add(case, "worst_height", float(np.abs(off_m[:, 2]).max()), "m")


def _arrivals(report: Report, count: int) -> None:
    """Arrived: within `NEAR_M` of the way-point, for the vehicle as for its reference."""
    points = [WayPoint(10, 0, UP_M, 10.0), WayPoint(10, 8, UP_M, 16.0), WayPoint(0, 0, UP_M, 23.0)]
    fleet, way = _ready(count, wind_mps=3.0), plan(points, take_off_m=UP_M, land=False)
    recorder = Recorder(fleet, period_s=0.02)
    _fly(fleet, way, way.duration_s + 2.0, recorder)
    times_s = np.array(recorder.times_s) - recorder.times_s[0]
    place, wanted = recorder.column("estimate_m"), recorder.column("reference_m")
    off_s: list[float] = []
    for point in points:
        arrive_s = point.arrive_s or 0.0
        goal = np.array([point.north_m, point.east_m, -point.alt_m])[:, np.newaxis]
        near = (times_s > arrive_s - 3.0) & (times_s < arrive_s + 2.0)
        due_s = times_s[near][np.argmax(np.linalg.norm(wanted[near] - goal, axis=1) < NEAR_M, axis=0)]
        come = np.linalg.norm(place[near] - goal, axis=1) < NEAR_M
        off_s += np.where(come.any(axis=0), np.abs(times_s[near][np.argmax(come, axis=0)] - due_s), np.inf).tolist()
    report.spread(f"times of arrival, within {NEAR_M} m", "off", off_s, "s")


def _eight(report: Report, count: int) -> None:
    fleet, up = _ready(count), plan([], take_off_m=UP_M, land=False)
    _fly(fleet, up, up.duration_s + 1.0)
    eight, recorder = FigureOfEight(8.0, 14.0, UP_M), Recorder(fleet, period_s=0.05)
    _fly(fleet, eight, eight.duration_s, recorder)
    _worst(f"figure of eight, {eight.peak_mps:.1f} m/s", report, recorder.tracking_error_m())


def _hover(report: Report, count: int) -> None:
    """Truth is counted in the frame of the start; each vehicle has its own noise, as with a seed of its own."""
    for hasty in (False, True):
        fleet, up = Fleet(FleetSettings(count=count, wind_mps=HOVER_WIND_MPS)), plan([], take_off_m=UP_M, land=False)
        case = f"hover in {HOVER_WIND_MPS:.0f} m/s with gusts, {HOVER_S:.0f} s"
        if hasty:
            case += ", GPS error of 0.6 m in a minute"
            gps, first = fleet.board.gps, np.random.default_rng(1).standard_normal((3, count))
            gps.slow = Wander((0.0, 0.0, 0.0), SLOW_TIME_S, first)
            gps.multipath = Wander(HASTY_M, MULTIPATH_TIME_S, first)
        fleet.boot()
        fleet.arm()
        _fly(fleet, up, up.duration_s + 5.0)
        recorder = Recorder(fleet, period_s=0.05)
        _fly(fleet, Trajectory(up.end_m), HOVER_S, recorder)
        _worst(case, report, recorder.tracking_error_m())
        off_m = level(recorder.column("reference_m") - recorder.column("position_m"))
        report.spread(case, "worst_of_each_truth_off_reference", off_m.max(axis=0).tolist(), "m")
