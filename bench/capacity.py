"""What a fleet needs: a model of one tower's cost, fitted to some measured points, held against others, and carried on.

It measures nothing. The points come from the commands that each names (docs/capacity.md); `--drones N` carries the
model to another fleet.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bench.rows import Report


@dataclass(frozen=True)
class Point:
    """One run of `bench scale --seconds 12`. `pairs`: browsers times the drones that each watches 5 times a second."""

    drones: int
    browsers: int
    frames_per_s: float
    processor_ms_per_s: float
    memory_mb: float

    @property
    def pairs(self) -> int:
        return self.drones * self.browsers


FITTED: Final = (
    Point(100, 1, 721, 78.2, 161),
    Point(300, 20, 2019, 150.1, 187),
    Point(500, 10, 2856, 171.9, 205),
)
HELD_OUT: Final = (Point(1000, 20, 10_000, 540.0, 268),)
"""Ten minutes of `bench scale` on an idle machine (docs/bench.md)."""
ANOTHER_LOAD: Final = Point(30, 2, 1500, 36.7, math.nan)
"""`bench towers` with one tower (docs/bench.md): few drones, five frames in a datagram."""

# What bench relay, recorder, video and audit measured (docs/bench.md, docs/flights.md), for the rest of the model.
RECORDER_MS_PER_FRAME: Final = 0.011 * 1000 / 5000
"""`bench recorder --case cost`: 1.1 % of a core for 100 drones with 50 frames a second."""
RECORDED_BYTES_PER_FRAME: Final = 53
"""A frame of 45 bytes with its time (docs/flights.md)."""
VIDEO_MS_PER_MESSAGE: Final = 0.0155
"""`bench video`: to each of 50 viewers, beyond idle."""
FRAME_UP_BYTES: Final = 58
"""A frame of 45 bytes, its part of a datagram of five: tag, seal, UDP, IP."""
FRAME_OUT_BYTES: Final = 52
"""With tag, in a WebSocket message of many."""
BUS_FACTOR: Final = 18_700 / 9_700
"""`bench towers`: frames per processor second of one tower, and of two on a bus."""
USABLE: Final = 0.5
"""Of a core: sticks wait behind what is worked on, so half of it stays free (`bench anonymous`, `bench reconnect`)."""
DRONE_AUDIT_ROWS_PER_DAY: Final = 60
"""Assumed, not measured: four flights, each with arming, modes, a mission and a hand-over."""


@dataclass(frozen=True)
class Fleet:
    """`watchers`: browsers that see a drone; `video`: streams with so many viewers each."""

    name: str
    drones: int
    frames_per_s: float
    squad: int
    viewers: int
    video_streams: int
    video_viewers: float = 2.0
    video_bits_per_s: float = 790_000
    pictures_per_s: float = 30.0


FLEETS: Final[tuple[Fleet, ...]] = (
    Fleet("club", 20, 50, squad=20, viewers=10, video_streams=5),
    Fleet("issue: 200 drones, 40 operators", 200, 50, squad=5, viewers=40, video_streams=40),
    Fleet("5,000 drones", 5_000, 10, squad=10, viewers=1_000, video_streams=100),
    Fleet("100,000 drones", 100_000, 10, squad=20, viewers=10_000, video_streams=2_000),
)


@dataclass(frozen=True)
class Model:
    """Processor in milliseconds a second, memory in MB: a constant, for each frame up, for each drone in a browser."""

    base_ms: float
    frame_ms: float
    pair_ms: float
    base_mb: float
    drone_mb: float

    def processor_ms(self, point: Point) -> float:
        return self.base_ms + self.frame_ms * point.frames_per_s + self.pair_ms * point.pairs

    def memory_mb(self, point: Point) -> float:
        return self.base_mb + self.drone_mb * point.drones


def fitted(points: tuple[Point, ...] = FITTED) -> Model:
    """Least squares over the points; no constant below zero, which noise alone can make."""
    rows = [(1.0, point.frames_per_s, float(point.pairs)) for point in points]
    base, frame, pair = least_squares(rows, [point.processor_ms_per_s for point in points])
    lines = [(1.0, float(point.drones)) for point in points]
    base_mb, drone_mb = least_squares(lines, [point.memory_mb for point in points])
    return Model(base, frame, max(pair, 0.0), base_mb, drone_mb)


def least_squares(rows: Sequence[tuple[float, ...]], wanted: list[float]) -> list[float]:
    """Solves the normal equations by elimination. Scales each column, which differ by four orders of magnitude."""
    size = len(rows[0])
    scale = [max(abs(row[column]) for row in rows) or 1.0 for column in range(size)]
    scaled = [[row[column] / scale[column] for column in range(size)] for row in rows]
    table = [
        [sum(row[i] * row[j] for row in scaled) for j in range(size)]
        + [sum(row[i] * value for row, value in zip(scaled, wanted, strict=True))]
        for i in range(size)
    ]
    for i in range(size):
        pivot = max(range(i, size), key=lambda row: abs(table[row][i]))
        table[i], table[pivot] = table[pivot], table[i]
        for j in range(size):
            if j != i:
                share = table[j][i] / table[i][i]
                table[j] = [one - share * other for one, other in zip(table[j], table[i], strict=True)]
    return [table[i][size] / table[i][i] / scale[i] for i in range(size)]


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--drones N`: one more fleet of so many."""
    model = fitted()
    report.add("model", "tower without drones", model.base_ms, "ms/s")
    report.add("model", "frame up", model.frame_ms * 1000, "us")
    report.add("model", "drone in a browser, watched", model.pair_ms * 1000, "us/s")
    report.add("model", "memory: tower, and for each drone", model.base_mb, "MB")
    report.add("model", "memory for each drone", model.drone_mb * 1000, "kB")
    for point in (*FITTED, *HELD_OUT, ANOTHER_LOAD):
        case = f"{'fitted' if point in FITTED else 'held out'}: {point.drones} drones, {point.browsers} browsers"
        said, measured = model.processor_ms(point), point.processor_ms_per_s
        report.add(case, "processor, model", said, "ms/s")
        report.add(case, "processor, measured", measured, "ms/s")
        report.add(case, "processor, off by", (said / measured - 1) * 100, "%")
        if not math.isnan(point.memory_mb):
            report.add(case, "memory, off by", (model.memory_mb(point) / point.memory_mb - 1) * 100, "%")
    wanted = FLEETS
    if options.drones:
        wanted += (Fleet(f"{options.drones:,} drones", options.drones, 10, 10, options.drones // 10, 0),)
    for fleet in wanted:
        _carry(report, model, fleet)


def _carry(report: Report, model: Model, fleet: Fleet) -> None:
    case = fleet.name
    frames = fleet.drones * fleet.frames_per_s
    pairs = fleet.viewers * fleet.squad
    work_ms = (model.frame_ms + RECORDER_MS_PER_FRAME) * frames + model.pair_ms * pairs
    messages = fleet.video_streams * fleet.video_viewers * fleet.pictures_per_s
    video_ms = VIDEO_MS_PER_MESSAGE * messages
    alone_ms = model.base_ms + work_ms + video_ms
    towers = 1
    if alone_ms > USABLE * 1000:
        towers = math.ceil((work_ms * BUS_FACTOR + video_ms) / (USABLE * 1000 - model.base_ms))
    report.add(
        case,
        "processor of all towers",
        towers * model.base_ms + video_ms + work_ms * (1, BUS_FACTOR)[towers > 1],
        "ms/s",
    )
    report.add(case, "towers, each with a core half free", towers, "count")
    report.add(case, "drones of a tower", fleet.drones / towers, "count")
    report.add(case, "memory of a tower", model.base_mb + model.drone_mb * fleet.drones / towers, "MB")
    video_bits = fleet.video_streams * fleet.video_bits_per_s
    report.add(case, "network in", (frames * FRAME_UP_BYTES * 8 + video_bits) / 1e6, "Mbit/s")
    watched = pairs * min(fleet.frames_per_s, 5 * 3)
    out = watched * FRAME_OUT_BYTES * 8 + video_bits * fleet.video_viewers
    report.add(case, "network out", out / 1e6, "Mbit/s")
    bus = watched * FRAME_OUT_BYTES * 8 * (1 - 1 / towers)
    report.add(case, "bus", bus / 1e6, "Mbit/s")
    report.add(case, "audit rows a day", fleet.drones * DRONE_AUDIT_ROWS_PER_DAY, "count")
    recorded = frames * RECORDED_BYTES_PER_FRAME * 4 * 3600 / 1e9
    report.add(case, "recorded flights a day, four hours each", recorded, "GB")
