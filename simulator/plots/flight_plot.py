"""The picture of a flight from its log: attitude, position, estimate against truth, motors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from simulator.plots.svg import Line, Panel, draw


def flight_picture(columns: Mapping[str, Sequence[float]]) -> str:
    times = columns["time_s"]
    path = Panel("Path", "east, m", "north, m", same_scale=True)
    height = Panel("Height", "s", "m")
    for panel, x, y in ((path, "east_m", "north_m"), (height, "", "alt_m")):
        panel.lines = [
            Line("truth", columns[x] if x else times, columns[y]),
            Line("estimate", columns[f"estimate_{x}"] if x else times, columns[f"estimate_{y}"], dashed=True),
        ]
    attitude = Panel("Roll and pitch", "s", "deg")
    attitude.lines = [
        Line(f"{name}{word}", times, columns[f"{prefix}{name}_deg"], dashed=bool(prefix))
        for name in ("roll", "pitch")
        for prefix, word in (("", ""), ("estimate_", ", estimate"))
    ]
    off = Panel("Estimate less truth", "s", "m")
    off.lines = [
        Line(
            axis,
            times,
            [guess - truth for guess, truth in zip(columns[f"estimate_{name}"], columns[name], strict=True)],
        )
        for axis, name in (("north", "north_m"), ("east", "east_m"), ("height", "alt_m"))
    ]
    heading = Panel("Heading: estimate less truth", "s", "deg")
    pairs = zip(columns["estimate_yaw_deg"], columns["yaw_deg"], strict=True)
    heading.lines = [Line("yaw", times, [math.remainder(guess - truth, 360.0) for guess, truth in pairs])]
    motors = Panel("Motors", "s", "share of full speed")
    motors.lines = [Line(f"{number}", times, columns[f"motor_{number}"]) for number in range(1, 5)]
    return draw([path, height, attitude, off, heading, motors], columns=2, width=520, height=270)
