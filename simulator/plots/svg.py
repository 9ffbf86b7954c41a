"""Line charts as SVG text: panels below each other, or side by side, with axes, ticks and a legend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

COLOURS = ("#1f6fb4", "#d1495b", "#2e8b57", "#b07d12", "#6a4c93", "#555555")
MAX_POINTS = 600
"""Of a line; a longer one is thinned."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 12, 26, 34


@dataclass(frozen=True, slots=True)
class Line:
    name: str
    x: Sequence[float]
    y: Sequence[float]
    dashed: bool = False


@dataclass(slots=True)
class Panel:
    title: str
    x_label: str
    y_label: str
    lines: list[Line] = field(default_factory=list)
    same_scale: bool = False
    """For maps: a metre is as long to the right as upward."""


def draw(panels: Sequence[Panel], *, columns: int = 1, width: int = 440, height: int = 240) -> str:
    rows = math.ceil(len(panels) / columns)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {columns * width} {rows * height}" '
        'font-family="sans-serif" font-size="11">',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
    ]
    for index, panel in enumerate(panels):
        x, y = index % columns * width, index // columns * height
        parts.append(f'<g transform="translate({x} {y})">{_panel(panel, width, height)}</g>')
    return "\n".join([*parts, "</svg>", ""])


def _panel(panel: Panel, width: int, height: int) -> str:
    inner_w, inner_h = width - _LEFT - _RIGHT, height - _TOP - _BOTTOM
    x_low, x_high = _range([value for line in panel.lines for value in line.x])
    y_low, y_high = _range([value for line in panel.lines for value in line.y])
    if panel.same_scale:
        metres = max((x_high - x_low) / inner_w, (y_high - y_low) / inner_h)
        x_middle, y_middle = (x_low + x_high) / 2.0, (y_low + y_high) / 2.0
        x_low, x_high = x_middle - metres * inner_w / 2.0, x_middle + metres * inner_w / 2.0
        y_low, y_high = y_middle - metres * inner_h / 2.0, y_middle + metres * inner_h / 2.0

    def across(value: float) -> float:
        return round(_LEFT + (value - x_low) / (x_high - x_low) * inner_w, 1)

    def down(value: float) -> float:
        return round(_TOP + (y_high - value) / (y_high - y_low) * inner_h, 1)

    parts = [f'<text x="{_LEFT}" y="16" font-weight="bold">{escape(panel.title)}</text>']
    for tick in _ticks(x_low, x_high):
        at = across(tick)
        parts.append(f'<path d="M{at} {_TOP}v{inner_h}" stroke="#e4e4e4"/>')
        parts.append(f'<text x="{at}" y="{height - 20}" text-anchor="middle" fill="#444">{tick:g}</text>')
    for tick in _ticks(y_low, y_high):
        at = down(tick)
        parts.append(f'<path d="M{_LEFT} {at}h{inner_w}" stroke="#e4e4e4"/>')
        parts.append(f'<text x="{_LEFT - 5}" y="{at + 4}" text-anchor="end" fill="#444">{tick:g}</text>')
    parts.append(
        f'<text x="{_LEFT + inner_w / 2}" y="{height - 6}" text-anchor="middle">{escape(panel.x_label)}</text>'
    )
    parts.append(
        f'<text transform="translate(12 {_TOP + inner_h / 2}) rotate(-90)" text-anchor="middle">'
        f"{escape(panel.y_label)}</text>"
    )
    legend_x = float(width - _RIGHT)
    for number, line in reversed(list(enumerate(panel.lines))):
        colour = COLOURS[number % len(COLOURS)]
        stride = max(1, math.ceil(len(line.x) / MAX_POINTS))
        points = [(x, y) for x, y in list(zip(line.x, line.y, strict=True))[::stride] if math.isfinite(y)]
        path = " ".join(f"{across(x)},{down(y)}" for x, y in points)
        dashes = ' stroke-dasharray="5 3"' if line.dashed else ""
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.4"{dashes}/>')
        parts.append(f'<text x="{legend_x}" y="16" text-anchor="end" fill="{colour}">{escape(line.name)}</text>')
        legend_x -= 6.2 * len(line.name) + 12
    return "".join(parts)


def _range(values: Sequence[float]) -> tuple[float, float]:
    finite = [value for value in values if math.isfinite(value)]
    if not finite:
        return 0.0, 1.0
    low, high = min(finite), max(finite)
    margin = 0.05 * (high - low) or 0.5
    return low - margin, high + margin


def _ticks(low: float, high: float) -> list[float]:
    """Four to eight round numbers."""
    rough = (high - low) / 6.0
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(size * factor for factor in (1, 2, 5, 10) if size * factor >= rough)
    first = math.ceil(low / step)
    return [round(number * step, 10) for number in range(first, math.floor(high / step) + 1)]
