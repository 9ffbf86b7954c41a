"""The picture of a flight from its log: attitude, position, estimate against truth, motors.

Draws the columns that the log has; a real vehicle's has no truth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from simulator.plots.svg import Line, Panel, draw

Columns = Mapping[str, Sequence[float]]
_KINDS = (("", "truth"), ("estimate_", "estimate"))


def flight_picture(columns: Columns) -> str:
    """`columns`: `time_s`, and any of those of `flight_log`."""
    times = columns["time_s"]
    path = Panel("Path", "east, m", "north, m", same_scale=True)
    height = Panel("Height", "s", "m")
    attitude = Panel("Roll and pitch", "s", "deg")
    for prefix, name in _KINDS:
        dashed = bool(prefix)
        if f"{prefix}north_m" in columns:
            path.lines.append(Line(name, columns[f"{prefix}east_m"], columns[f"{prefix}north_m"], dashed))
        if f"{prefix}alt_m" in columns:
            height.lines.append(Line(name, times, columns[f"{prefix}alt_m"], dashed))
    for angle in ("roll", "pitch"):
        for prefix, name in _KINDS:
            if f"{prefix}{angle}_deg" in columns:
                word = f"{angle}, {name}" if prefix else angle
                attitude.lines.append(Line(word, times, columns[f"{prefix}{angle}_deg"], bool(prefix)))
    off = Panel("Estimate less truth", "s", "m")
    for axis, column in (("north", "north_m"), ("east", "east_m"), ("height", "alt_m")):
        if column in columns:
            pairs = zip(columns[f"estimate_{column}"], columns[column], strict=True)
            off.lines.append(Line(axis, times, [guess - truth for guess, truth in pairs]))
    motors = Panel("Motors", "s", "share of full speed")
    numbers = [number for number in range(1, 5) if f"motor_{number}" in columns]
    motors.lines = [Line(f"{number}", times, columns[f"motor_{number}"]) for number in numbers]
    panels = [path, height, attitude, off, _heading(columns), motors]
    return draw([panel for panel in panels if panel.lines], columns=2, width=520, height=270)


def _heading(columns: Columns) -> Panel:
    times, guesses = columns["time_s"], columns.get("estimate_yaw_deg")
    if guesses is None:
        return Panel("Heading", "s", "deg")
    if "yaw_deg" not in columns:
        return Panel("Heading", "s", "deg", [Line("yaw", times, guesses)])
    pairs = zip(guesses, columns["yaw_deg"], strict=True)
    errors = [math.remainder(guess - truth, 360.0) for guess, truth in pairs]
    return Panel("Heading: estimate less truth", "s", "deg", [Line("yaw", times, errors)])
