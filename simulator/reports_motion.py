"""Telemetry about the vehicle's position and motion, in MAVLink's units."""

from __future__ import annotations

import math
from collections.abc import Callable

from simulator.dialect import Message, mavlink
from simulator.flight import Flight
from simulator.geodesy import e7, heading_deg
from simulator.guided import FlyWith, GoTo, Guided
from simulator.homing import ReturnToLaunch
from simulator.reports_common import centi, int16, milli, ms, us


def attitude(flight: Flight) -> Message:
    body = flight.body
    roll, pitch, yaw = body.attitude()
    return mavlink.MAVLink_attitude_message(ms(flight), roll, pitch, yaw, body.p_rps, body.q_rps, body.r_rps)


def attitude_quaternion(flight: Flight) -> Message:
    body = flight.body
    return mavlink.MAVLink_attitude_quaternion_message(
        ms(flight), body.qw, body.qx, body.qy, body.qz, body.p_rps, body.q_rps, body.r_rps
    )


def local_position(flight: Flight) -> Message:
    body = flight.body
    return mavlink.MAVLink_local_position_ned_message(
        ms(flight), body.north_m, body.east_m, body.down_m, body.vn_mps, body.ve_mps, body.vd_mps
    )


def global_position(flight: Flight) -> Message:
    """The coordinates are zero before the first position, as on the real autopilot."""
    body, place = flight.body, flight.known_place
    if place is None:
        return mavlink.MAVLink_global_position_int_message(
            ms(flight), 0, 0, 0, milli(flight.alt_over_home_m()), 0, 0, 0, _heading_cdeg(flight)
        )
    return mavlink.MAVLink_global_position_int_message(
        ms(flight),
        e7(place.lat_deg),
        e7(place.lon_deg),
        milli(place.alt_amsl_m),
        milli(flight.alt_over_home_m()),
        int16(body.vn_mps * 100),
        int16(body.ve_mps * 100),
        int16(body.vd_mps * 100),
        _heading_cdeg(flight),
    )


def gps_raw(flight: Flight) -> Message:
    if not flight.estimator.gps_fix:
        return mavlink.MAVLink_gps_raw_int_message(us(flight), 1, 0, 0, 0, 65535, 65535, 65535, 65535, 0)
    body, place, quality = flight.body, flight.place(), flight.body.gps_quality()
    course = heading_deg(math.atan2(body.ve_mps, body.vn_mps))
    return mavlink.MAVLink_gps_raw_int_message(
        us(flight),
        quality.fix,
        e7(place.lat_deg),
        e7(place.lon_deg),
        milli(place.alt_amsl_m),
        121,
        200,
        centi(body.ground_speed_mps()),
        centi(course) % 36000,
        quality.satellites,
        milli(place.alt_amsl_m),
        milli(quality.horizontal_m),
        milli(quality.vertical_m),
        milli(quality.speed_mps),
        0,
    )


def vfr_hud(flight: Flight) -> Message:
    body = flight.body
    wind = flight.wind.at(flight.now_s)
    airspeed = math.sqrt((body.vn_mps - wind[0]) ** 2 + (body.ve_mps - wind[1]) ** 2 + (body.vd_mps - wind[2]) ** 2)
    throttle = round(100 * sum(flight.commands) / 4)
    heading = round(heading_deg(body.attitude()[2])) % 360
    return mavlink.MAVLink_vfr_hud_message(
        airspeed, body.ground_speed_mps(), heading, throttle, flight.place().alt_amsl_m, -body.vd_mps
    )


def raw_imu(flight: Flight) -> Message:
    body = flight.body
    x, y, z = (int16(a / 9.80665 * 1000) for a in body.force_body_mss)
    yaw = body.attitude()[2]
    gyro = (int16(rate * 1000) for rate in (body.p_rps, body.q_rps, body.r_rps))
    return mavlink.MAVLink_raw_imu_message(
        us(flight), x, y, z, *gyro, int16(250 * math.cos(yaw)), int16(-250 * math.sin(yaw)), 400, 0, 4500
    )


def scaled_pressure(flight: Flight) -> Message:
    pressure_hpa = 1013.25 * (1.0 - 2.25577e-5 * flight.place().alt_amsl_m) ** 5.25588
    return mavlink.MAVLink_scaled_pressure_message(ms(flight), pressure_hpa, 0.0, 3500)


def nav_controller_output(flight: Flight) -> Message:
    body, target = flight.body, flight.target
    roll, pitch, yaw = (math.degrees(angle) for angle in body.attitude())
    goal_n, goal_e = target.north_m, target.east_m
    if isinstance(flight.flying, ReturnToLaunch):
        goal_n, goal_e = flight.flying.goal.north_m, flight.flying.goal.east_m
    guided = flight.flying
    if isinstance(guided, Guided) and isinstance(guided.goal, GoTo):
        goal_n, goal_e = guided.goal.north_m, guided.goal.east_m
    gap_n, gap_e = goal_n - body.north_m, goal_e - body.east_m
    bearing = round(math.degrees(math.atan2(gap_e, gap_n)))
    return mavlink.MAVLink_nav_controller_output_message(
        roll,
        pitch,
        round(yaw),
        bearing,
        min(round(math.hypot(gap_n, gap_e)), 65535),
        target.alt_m - body.alt_m,
        0.0,
        0.0,
    )


def position_target(flight: Flight) -> Message:
    guided, target = flight.flying, flight.target
    north_m, east_m, alt_m = target.north_m, target.east_m, target.alt_m
    mask = 0b110111111000
    if isinstance(guided, Guided):
        if isinstance(guided.goal, GoTo):
            north_m, east_m, alt_m = guided.goal.north_m, guided.goal.east_m, guided.goal.alt_m
        elif isinstance(guided.goal, FlyWith):
            mask = 0b110111000111
    place = flight.origin.to_place(north_m, east_m, -alt_m)
    return mavlink.MAVLink_position_target_global_int_message(
        ms(flight),
        5,
        mask,
        e7(place.lat_deg),
        e7(place.lon_deg),
        place.alt_amsl_m,
        target.vn_mps,
        target.ve_mps,
        -target.climb_mps,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )


def wind(flight: Flight) -> Message:
    north, east, down = flight.wind.at(flight.now_s)
    from_deg = heading_deg(math.atan2(-east, -north))
    return mavlink.MAVLink_wind_message(from_deg, math.hypot(north, east), down)


def _heading_cdeg(flight: Flight) -> int:
    return centi(heading_deg(flight.body.attitude()[2])) % 36000


MOTION_REPORTS: dict[int, Callable[[Flight], Message]] = {
    27: raw_imu,
    29: scaled_pressure,
    30: attitude,
    31: attitude_quaternion,
    32: local_position,
    33: global_position,
    24: gps_raw,
    62: nav_controller_output,
    74: vfr_hud,
    87: position_target,
    168: wind,
}
