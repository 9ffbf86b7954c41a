"""SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT.

Only GUIDED (on PX4 OFFBOARD) accepts them. They are never acknowledged.
"""

from __future__ import annotations

import math

from simulator.dialect import Message
from simulator.flight import Flight
from simulator.guided import FlyWith, GoTo, Guided
from simulator.mission_plan import Frame

MAX_COORDINATE = 50_000.0
"""Metres, or metres per second: a set-point beyond it is invalid and dropped."""

NO_POSITION = 0b000000000111
NO_VELOCITY = 0b000000111000
NO_YAW = 1 << 10
NO_YAW_RATE = 1 << 11

LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED = 1, 7, 8, 9
BODY_FRAMES = (BODY_NED, BODY_OFFSET_NED)
OFFSET_FRAMES = (LOCAL_OFFSET_NED, BODY_OFFSET_NED, BODY_NED)
GLOBAL_FRAMES = frozenset({0, 3, 5, 6, 10, 11})


def receive_setpoint(flight: Flight, message: Message) -> None:
    guided = flight.flying
    if not flight.rules(flight.mode).takes_setpoints or not isinstance(guided, Guided):
        return
    numbers = [message.vx, message.vy, message.vz, message.yaw, message.yaw_rate]
    mask = message.type_mask
    is_global = message.get_type().endswith("GLOBAL_INT")
    numbers += [message.alt] if is_global else [message.x, message.y, message.z]
    if not all(math.isfinite(number) and abs(number) < MAX_COORDINATE for number in numbers):
        return
    yaw = None if mask & NO_YAW else message.yaw
    if mask & NO_POSITION != NO_POSITION:
        goal = _global_place(flight, message, yaw) if is_global else _local_place(flight, message, yaw)
        if goal is not None:
            guided.go(goal)
    elif mask & NO_VELOCITY != NO_VELOCITY:
        vn, ve = message.vx, message.vy
        if message.coordinate_frame in BODY_FRAMES:
            vn, ve = _turned(flight, vn, ve)
        rate = None if mask & NO_YAW_RATE else message.yaw_rate
        guided.go(FlyWith(vn, ve, -message.vz, flight.now_s, yaw, rate))


def _global_place(flight: Flight, message: Message, yaw: float | None) -> GoTo | None:
    if message.coordinate_frame not in GLOBAL_FRAMES:
        return None
    if abs(message.lat_int) > 900_000_000 or abs(message.lon_int) > 1_800_000_000:
        return None
    north, east = flight.origin.to_local(message.lat_int * 1e-7, message.lon_int * 1e-7)
    return GoTo(north, east, height_over_origin(flight, message.coordinate_frame, message.alt), yaw)


def _local_place(flight: Flight, message: Message, yaw: float | None) -> GoTo | None:
    x, y, alt = message.x, message.y, -message.z
    frame, body = message.coordinate_frame, flight.body
    if frame not in (LOCAL_NED, *OFFSET_FRAMES):
        return None
    if frame in BODY_FRAMES:
        x, y = _turned(flight, x, y)
    if frame in OFFSET_FRAMES:
        x, y, alt = x + body.north_m, y + body.east_m, alt + body.alt_m
    return GoTo(x, y, alt, yaw)


def height_over_origin(flight: Flight, frame: int, alt_m: float) -> float:
    if frame in (Frame.GLOBAL, Frame.GLOBAL_INT):
        return alt_m - flight.origin.origin.alt_amsl_m
    return alt_m + flight.home_local()[2]


def _turned(flight: Flight, forward: float, right: float) -> tuple[float, float]:
    yaw = flight.body.attitude()[2]
    cos, sin = math.cos(yaw), math.sin(yaw)
    return forward * cos - right * sin, forward * sin + right * cos
