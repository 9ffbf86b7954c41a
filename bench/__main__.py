"""`python -m bench NAME [--json FILE]`: run one benchmark, print a table, write the rows as JSON."""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, Final

import uvloop

from bench import (
    anonymous,
    audit,
    calls,
    capacity,
    challenge,
    control,
    encoder,
    failures,
    faults,
    fuzz,
    missions,
    modes,
    precision_landing,
    reconnect,
    recorder,
    relay,
    scale,
    sensor_faults,
    simulator,
    tenants,
    towers,
    vision,
    vision_foreign,
    watched,
)
from bench.rows import Report
from bench.video import bench_run as video
from bench.worst import bench_run as worst
from simulator.airframe_model import AirframeModel

BENCHES: dict[str, tuple[Callable[[Report, argparse.Namespace], Coroutine[Any, Any, None]], str]] = {
    "anonymous": (anonymous.run, anonymous.__doc__ or ""),
    "audit": (audit.run, audit.__doc__ or ""),
    "calls": (calls.run, calls.__doc__ or ""),
    "capacity": (capacity.run, capacity.__doc__ or ""),
    "challenge": (challenge.run, challenge.__doc__ or ""),
    "control": (control.run, control.__doc__ or ""),
    "encoder": (encoder.run, encoder.__doc__ or ""),
    "failures": (failures.run, failures.__doc__ or ""),
    "faults": (faults.run, faults.__doc__ or ""),
    "fuzz": (fuzz.run, fuzz.__doc__ or ""),
    "missions": (missions.run, missions.__doc__ or ""),
    "modes": (modes.run, modes.__doc__ or ""),
    "recorder": (recorder.run, recorder.__doc__ or ""),
    "precision_landing": (precision_landing.run, precision_landing.__doc__ or ""),
    "reconnect": (reconnect.run, reconnect.__doc__ or ""),
    "relay": (relay.run, relay.__doc__ or ""),
    "scale": (scale.run, scale.__doc__ or ""),
    "simulator": (simulator.run, simulator.__doc__ or ""),
    "tenants": (tenants.run, tenants.__doc__ or ""),
    "towers": (towers.run, towers.__doc__ or ""),
    "video": (video.run, video.__doc__ or ""),
    "sensor_faults": (sensor_faults.run, sensor_faults.__doc__ or ""),
    "vision_foreign": (vision_foreign.run, vision_foreign.__doc__ or ""),
    "vision": (vision.run, vision.__doc__ or ""),
    "watched": (watched.run, watched.__doc__ or ""),
    "worst": (worst.run, worst.__doc__ or ""),
}

UVLOOP: Final = frozenset({"relay", "towers"})
"""Their load shares a processor with other work, so it runs on the fastest loop available."""


def parse(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench", description="Benchmarks of Control Tower.")
    parser.add_argument("name", choices=sorted(BENCHES), help="which")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows there as well")
    parser.add_argument("--quick", action="store_true", help="few rounds: to see whether it works")
    parser.add_argument("--rounds", type=int, help="how often each latency is measured; vision: pictures (500)")
    parser.add_argument("--network", action="store_true", help="on the emulated network only")
    parser.add_argument("--loopback", action="store_true", help="on loopback only")
    parser.add_argument("--flavour", choices=("ardupilot", "px4"), action="append", help="only this one")
    parser.add_argument(
        "--radio", choices=("with", "without"), action="append", help="only with, or without a receiver"
    )
    parser.add_argument("--repeats", type=int, help="how often each trigger is pulled again (10)")
    parser.add_argument("--case", action="append", help="only cases with this in their name")
    parser.add_argument(
        "--system", action="append", metavar="NAME", help="relay, missions, video: only this one; may be repeated"
    )
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep databases and logs there")
    parser.add_argument(
        "--peers",
        type=Path,
        metavar="FOLDER",
        default=Path("var/peers"),
        help="relay, missions, video: MAVProxy, MAVSDK, JSMpeg are installed there",
    )
    parser.add_argument(
        "--drones",
        type=int,
        help="scale: so many (1,000); recorder, simulator: (100); reconnect: (200); control's flown table: at once (4)",
    )
    parser.add_argument("--spread", type=int, metavar="N", help="towers: three of them, with N light drones")
    parser.add_argument("--flown", action="store_true", help="control: the flown table, with tower-sim")
    parser.add_argument(
        "--autopilot",
        type=Path,
        metavar="PATH",
        help="control: the flown table, missions, modes, failures: all of it, with this ArduCopter simulator "
        "(control: or this build of PX4)",
    )
    parser.add_argument(
        "--vehicles", type=Path, metavar="FOLDER", help="watched: an ArduPilot tree with its simulators built"
    )
    parser.add_argument("--peer-rounds", type=int, help="missions: so many of MAVSDK's, which are long (all)")
    parser.add_argument("--n", type=int, default=1, help="control: each flight so often (1)")
    parser.add_argument(
        "--lost-action",
        default="return",
        choices=("return", "land", "continue", "stay"),
        help="control: flown (return)",
    )
    parser.add_argument(
        "--set-up", action="store_true", help="control: drones have the parameters that the console sets"
    )
    parser.add_argument("--browsers", type=int, help="scale: so many that watch all of them (20); reconnect: (1,000)")
    parser.add_argument(
        "--seconds",
        type=float,
        help="scale: how long they fly (600); simulator: (300); video: of each round (30); anonymous: (60); "
        "recorder: (10)",
    )
    cases = f"video: only {', '.join([*video.CASES, video.LONG])}"
    cases += "; control's flown table: flights with A, or with all of B+C, in their name"
    parser.add_argument("--cases", metavar="A,B+C", help=cases)
    parser.add_argument(
        "--minutes",
        type=float,
        default=video.MINUTES,
        help="video: of the case 'long'; tenants: of the case 'everything' (10)",
    )
    parser.add_argument(
        "--realtime", action="store_true", help="anonymous: tower, agent and pilot have the processor first (root)"
    )
    parser.add_argument("--datagrams", type=int, metavar="N", help="fuzz: so many (1,000,000)")
    parser.add_argument("--messages", type=int, metavar="N", help="fuzz: so many WebSocket messages (100,000)")
    parser.add_argument("--rows", type=int, metavar="N", help="audit: so many events (5,000,000)")
    parser.add_argument("--kills", type=int, metavar="N", help="recorder: ends the tower so often (50)")
    painted = "challenge: the published challenge's own target instead of black and white squares"
    parser.add_argument("--painted", action="store_true", help=painted)
    model = "challenge: whether the vehicle knows the truth, or has sensors with errors (exact)"
    parser.add_argument("--model", type=AirframeModel, choices=AirframeModel, default=AirframeModel.EXACT, help=model)
    parser.add_argument("--seed", type=int, default=1, help="fuzz, vision: another one makes other input (1)")
    return parser.parse_args(words)


def main() -> int:
    options = parse(sys.argv[1:])
    report = Report(options.name)
    problem: Exception | None = None
    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop if options.name in UVLOOP else None) as runner:
            runner.run(BENCHES[options.name][0](report, options))
    except Exception as error:  # the results so far are still useful
        problem = error
    report.console.print(report.as_table())
    if options.json is not None:
        report.write(options.json)
    if problem is not None:
        raise problem
    return 0


if __name__ == "__main__":
    sys.exit(main())
