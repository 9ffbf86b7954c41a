"""`tower-sim`: a squad of simulated vehicles, each on its own link."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Coroutine, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simulator.airframe_model import AirframeModel
from simulator.ardupilot import ARDUPILOT, RELEASES, USUAL, arducopter
from simulator.failure_modes import Failure
from simulator.firmware.fault_table import FaultName
from simulator.flight_log import PERIOD_S
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.links import Endpoint, parse_endpoint
from simulator.px4.flavour import PX4
from simulator.receiver import Receiver
from simulator.shell import fly
from simulator.shell_socket import ShellSocket
from simulator.squad import (
    make_squad,
    parse_failure,
    parse_fault,
    parse_home,
    parse_parameter,
    parse_wind,
    spread_endpoints,
)
from simulator.vehicle import Vehicle, VehicleSettings
from simulator.vehicle_csv import FlightLogs
from simulator.vehicle_ports import MspPort, SbusPort

if TYPE_CHECKING:
    from simulator.camera.on_board import SquadCameras

uvloop: Any
try:
    import uvloop
except ImportError:  # not available on every system
    uvloop = None

FLIGHT_COMMANDS = ("shell", "fly", "plot")
FLAVOURS = {flavour.name: flavour for flavour in (ARDUPILOT, PX4)}


class FlavourName(StrEnum):
    ARDUPILOT = "ardupilot"
    PX4 = "px4"


Release = StrEnum("Release", {f"V{number}": number for number in RELEASES})  # type: ignore[misc]
USUAL_RELEASE = Release(USUAL)


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

FAIL_HELP = (
    "Something that goes wrong: NAME, NAME@FROM or NAME@FROM-UNTIL in simulated seconds; "
    f"NAME one of {', '.join(Failure)}."
)
FAULT_HELP = (
    "A fault of the flight controller: NAME, NAME@FROM or NAME@FROM-UNTIL in simulated seconds, with --commander; "
    f"NAME one of {', '.join(FaultName)}."
)
MSP_HELP = (
    "A port that speaks MSP and takes its sticks and switches: a URL as of --out, mostly tcpin:HOST:PORT; once for "
    "each vehicle that is to have one, in their order."
)
SBUS_HELP = "The line of an SBUS receiver, in place of the built-in one: as --msp, and not together with it."
PAD_HELP = "LAT,LON[,HEADING] of a landing pad with markers, in the pictures of the cameras; repeatable."
SHELL_HELP = (
    "A Unix socket to be made for terminals of this user: tower-sim shell --attach PATH. Turns the commander on."
)
LOG_HELP = "A folder in which each vehicle's flight is written as CSV, for tower-sim plot."
TARGET_HELP = "LETTER or TEXT:COLOUR, then @LAT,LON[,HEADING[,SIDE]]: a landing target, in the pictures of --camera."
CAMERA_HELP = "[HOST:]PORT of a camera over HTTP; once for each vehicle that is to have one, in their order."


@app.command()
def simulate(
    home: Annotated[str, typer.Option(help="LAT,LON[,ALT[,HEADING]] in degrees and metres.")],
    out: Annotated[
        list[str],
        typer.Option(help="udp:, udpin:, tcp: or tcpin:HOST:PORT; once, or once for each vehicle."),
    ],
    count: Annotated[int, typer.Option(min=1, max=500, help="How many vehicles.")] = 1,
    flavour: Annotated[FlavourName, typer.Option(help="Which autopilot they are.")] = FlavourName.ARDUPILOT,
    firmware: Annotated[
        Release, typer.Option(help="The release of ArduCopter: what it takes of a mission, and its version.")
    ] = USUAL_RELEASE,
    sysid: Annotated[int, typer.Option(min=1, max=255, help="The same for all, as in the field.")] = 1,
    seed: Annotated[int, typer.Option(help="Of all that is random: the gusts.")] = 1,
    speed: Annotated[float, typer.Option(min=0.1, max=100, help="1 is real time.")] = 1.0,
    real_rates: Annotated[
        bool, typer.Option("--real-rates", help="With --speed: messages come as often as in real time.")
    ] = False,
    boot_s: Annotated[float, typer.Option(min=0, help="From switch-on to ready to arm; real ones take 42.")] = 8.0,
    wind: Annotated[str, typer.Option(help="SPEED,FROM_DEG in metres a second and degrees.")] = "0,0",
    radio: Annotated[
        Receiver,
        typer.Option(help="The receiver: its throttle rests low, all its sticks are centred, or there is none."),
    ] = Receiver.LOW,
    model: Annotated[
        AirframeModel,
        typer.Option(help="exact: the vehicle knows the truth; sensing: it has sensors with errors, and a filter."),
    ] = AirframeModel.EXACT,
    hills: Annotated[
        bool, typer.Option("--hills", help="The ground rises and falls, as in the map of simulator.land_map --hills.")
    ] = False,
    battery_mah: Annotated[float, typer.Option(min=100)] = 5200.0,
    param: Annotated[list[str] | None, typer.Option(help="NAME=VALUE, set before the start.")] = None,
    param_count: Annotated[int, typer.Option(min=0, max=5000, help="Fill the table up to so many.")] = 0,
    metadata: Annotated[
        bool | None,
        typer.Option(help="Answer COMPONENT_METADATA, or do not; PX4 does by itself, ArduCopter does not."),
    ] = None,
    camera: Annotated[list[str] | None, typer.Option(help=CAMERA_HELP)] = None,
    landing_pad: Annotated[list[str] | None, typer.Option(help=PAD_HELP)] = None,
    target: Annotated[list[str] | None, typer.Option(help=TARGET_HELP)] = None,
    light: Annotated[float, typer.Option(min=0.1, max=2.0, help="Of the pictures of --camera; 1: a clear day.")] = 1.0,
    camera_component: Annotated[
        bool, typer.Option("--camera-component", help="Each has a camera as a MAVLink component.")
    ] = False,
    gimbal: Annotated[bool, typer.Option("--gimbal", help="Each has a gimbal as a MAVLink component.")] = False,
    traffic: Annotated[bool, typer.Option("--traffic", help="Each hears a few aircraft by ADS-B.")] = False,
    fail: Annotated[list[str] | None, typer.Option(help=FAIL_HELP)] = None,
    msp: Annotated[list[str] | None, typer.Option(help=MSP_HELP)] = None,
    sbus: Annotated[list[str] | None, typer.Option(help=SBUS_HELP)] = None,
    commander: Annotated[
        bool, typer.Option("--commander", help="The flight controller's commander stands above the autopilot.")
    ] = False,
    fault: Annotated[list[str] | None, typer.Option(help=FAULT_HELP)] = None,
    shell: Annotated[Path | None, typer.Option(help=SHELL_HELP)] = None,
    log: Annotated[Path | None, typer.Option(help=LOG_HELP)] = None,
    log_period_s: Annotated[float, typer.Option(min=0.0, help="Between two lines of --log; 0: each step.")] = PERIOD_S,
) -> None:
    """Fly simulated quadrotors that speak MAVLink 2; or one of shell, fly and plot, as the first word."""
    try:
        place, heading_deg = parse_home(home)
        wind_mps, wind_from_deg = parse_wind(wind)
        endpoints = spread_endpoints([parse_endpoint(text) for text in out], count)
        settings = VehicleSettings(
            FlightSettings(
                place=place,
                heading_deg=heading_deg,
                boot_s=boot_s,
                wind_mps=wind_mps,
                wind_from_deg=wind_from_deg,
                receiver=radio,
                battery_mah=battery_mah,
                seed=seed,
                model=model,
                commander=commander or bool(fault) or shell is not None,
            ),
            system_id=sysid,
            parameters=tuple(parse_parameter(text) for text in param or ()),
            parameter_count=param_count,
            failures=(
                *(parse_failure(text) for text in fail or ()),
                *(parse_fault(text, model) for text in fault or ()),
            ),
            flavour=arducopter(firmware) if flavour is FlavourName.ARDUPILOT else FLAVOURS[flavour],
            metadata=metadata,
            camera=camera_component,
            gimbal=gimbal,
            traffic=traffic,
            telemetry_pace=speed if real_rates else 1.0,
        )
        ports = _port_endpoints(msp, sbus, count, radio)
        vehicles = make_squad(count, settings, hills=hills)
        shown = (landing_pad or (), target or (), light)
        cameras = _cameras(camera, vehicles, place, seed, *shown) if camera else None
    except (ValueError, KeyError) as error:
        raise typer.BadParameter(str(error.args[0])) from error
    logging.basicConfig(level=logging.INFO, format="tower-sim: %(message)s")
    for number, endpoint in enumerate(endpoints, start=1):
        typer.echo(f"vehicle {number} of {count}: sysid {sysid} on {endpoint}")
    for line in cameras.lines() if cameras else ():
        typer.echo(line)
    try:
        kind = MspPort if msp else SbusPort
        lines = [(kind(vehicle), endpoint) for vehicle, endpoint in zip(vehicles, ports, strict=False)]
        terminals = ShellSocket(shell, vehicles) if shell is not None else None
        logs = FlightLogs(log, vehicles, log_period_s) if log is not None else None
        _run(fly(vehicles, endpoints, speed, cameras, lines, terminals, logs))
    except OSError as error:
        typer.echo(f"tower-sim: {error}", err=True)
        raise typer.Exit(1) from error


def _port_endpoints(msp: list[str] | None, sbus: list[str] | None, count: int, radio: Receiver) -> list[Endpoint]:
    """Raises ValueError."""
    texts = [*(msp or ()), *(sbus or ())]
    if msp and sbus:
        raise ValueError("--msp or --sbus: a vehicle has one receiver")
    if texts and not radio.is_fitted:
        raise ValueError("--msp and --sbus are receivers: not with --radio none")
    if len(texts) > count:
        raise ValueError(f"{len(texts)} ports for {count} vehicles")
    return [parse_endpoint(text) for text in texts]


def _cameras(
    texts: list[str],
    vehicles: list[Vehicle],
    home: Place,
    seed: int,
    pads: Sequence[str],
    targets: Sequence[str],
    light: float,
) -> SquadCameras:
    # OpenCV takes time and memory, so it is imported only for a camera.
    from simulator.camera.on_board import Pictured, SquadCameras
    from simulator.camera.server import parse_camera

    endpoints = [parse_camera(text) for text in texts]
    cameras = SquadCameras(endpoints, vehicles, home, seed, Pictured(pads, targets, light))
    for vehicle, endpoint in zip(vehicles, endpoints, strict=False):
        vehicle.films_at(str(endpoint))
    return cameras


def _run(flight: Coroutine[Any, Any, None]) -> None:
    """Runs on uvloop if installed: its datagrams cost a fifth."""
    with asyncio.Runner(loop_factory=uvloop.new_event_loop if uvloop is not None else None) as runner:
        runner.run(flight)


def main() -> None:
    try:
        if sys.argv[1:2] and sys.argv[1] in FLIGHT_COMMANDS:
            # NumPy takes time and memory, so it is imported only for these and for --model sensing.
            from simulator.firmware.command_line import app as flight_controller

            flight_controller()
        app()
    except ModuleNotFoundError as error:
        if error.name != "numpy":
            raise
        raise SystemExit("tower-sim: this needs NumPy, which the extra [sim] of control-tower installs") from error
