"""A squad of vehicles around a home: positions and settings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from simulator.airframe_model import AirframeModel
from simulator.failure_modes import Failure, PlannedFailure
from simulator.firmware.fault_table import TABLE, parse
from simulator.flight_constants import TICK_S, ticks_until
from simulator.geodesy import LocalFrame, Place
from simulator.links import Endpoint
from simulator.terrain import ground_around, hills_m
from simulator.vehicle import Vehicle, VehicleSettings

SPACING_M = 20.0


def standing_places() -> Iterator[tuple[float, float]]:
    """Yields north and east of home for each vehicle: home itself, then rings of 6, 12, 18, ... about 20 m apart."""
    yield 0.0, 0.0
    ring = 1
    while True:
        for i in range(6 * ring):
            angle = 2.0 * math.pi * i / (6 * ring)
            yield ring * SPACING_M * math.cos(angle), ring * SPACING_M * math.sin(angle)
        ring += 1


def make_squad(count: int, settings: VehicleSettings, *, hills: bool = False) -> list[Vehicle]:
    """Each vehicle has its own position and seed; everything else, including the sysid, is the same. Those with
    sensors are one group: only `step_together` advances them."""
    frame = LocalFrame(settings.flight.place)
    vehicles = []
    for index, (north_m, east_m) in zip(range(count), standing_places(), strict=False):
        down_m = -hills_m(north_m, east_m) if hills else 0.0
        flight = replace(
            settings.flight,
            place=frame.to_place(north_m, east_m, down_m),
            seed=settings.flight.seed + index,
            ground=ground_around(north_m, east_m) if hills else None,
        )
        vehicles.append(Vehicle(replace(settings, flight=flight)))
    if settings.flight.model is AirframeModel.SENSING:
        # NumPy takes time and memory, so it is imported only for this model.
        from simulator.firmware.sensing_airframe import fly_together

        fly_together([vehicle.flight.body for vehicle in vehicles])
    return vehicles


def step_together(vehicles: Sequence[Vehicle], now_s: float) -> None:
    """Advances all to `now_s`, in turn: those with sensors share the physics of each tick."""
    for tick in range(vehicles[0].ticks + 1, ticks_until(now_s) + 1):
        for vehicle in vehicles:
            vehicle.step(tick * TICK_S)


def spread_endpoints(outs: list[Endpoint], count: int) -> list[Endpoint]:
    """Returns one endpoint per vehicle; a single one is repeated on consecutive ports."""
    if len(outs) == 1:
        return [outs[0].moved(index) for index in range(count)]
    if len(outs) != count:
        raise ValueError(f"{len(outs)} times --out for {count} vehicles: give one, or one for each")
    return outs


def parse_home(text: str) -> tuple[Place, float]:
    """Parses `LAT,LON[,ALT[,HEADING]]`: the position, and the heading in degrees."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if not 2 <= len(numbers) <= 4 or abs(numbers[0]) > 90 or abs(numbers[1]) > 180:
        raise ValueError(f"{text!r} is not LAT,LON[,ALT[,HEADING]]")
    lat, lon, alt, heading = (*numbers, *(0.0, 0.0, 0.0, 0.0)[len(numbers) :])
    return Place(lat, lon, alt), heading


def parse_failure(text: str) -> PlannedFailure:
    """Parses `NAME`, `NAME@SECONDS` or `NAME@SECONDS-SECONDS`."""
    name, _, times = text.partition("@")
    at, _, until = times.partition("-")
    try:
        planned = PlannedFailure(float(at) if times else 0.0, Failure(name), float(until) if until else math.inf)
    except ValueError:
        planned = None
    if planned is None or not 0.0 <= planned.from_s < planned.until_s:
        raise ValueError(f"{text!r} is not NAME[@SECONDS[-SECONDS]] with NAME one of {', '.join(Failure)}")
    return planned


def parse_fault(text: str, model: AirframeModel) -> PlannedFailure:
    """Parses `NAME`, `NAME@SECONDS` or `NAME@SECONDS-SECONDS`, NAME one of the commander's faults. Raises ValueError,
    also for what an airframe that knows the truth cannot have."""
    name, from_s, until_s = parse(text)
    consequence = TABLE[name]
    if consequence.needs_sensors and model is AirframeModel.EXACT:
        raise ValueError(f"the fault {name} needs --model sensing")
    return PlannedFailure(from_s, consequence.failure, until_s)


def parse_parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip().upper(), float(value)
    except ValueError:
        raise ValueError(f"{text!r} is not NAME=NUMBER") from None


def parse_wind(text: str) -> tuple[float, float]:
    speed, _, from_deg = text.partition(",")
    try:
        return max(float(speed), 0.0), float(from_deg or 0.0)
    except ValueError:
        raise ValueError(f"{text!r} is not SPEED,FROM_DEG") from None
