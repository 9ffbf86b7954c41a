"""The way of a flight as a picture in a report: SVG, north up, with a scale. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

WIDTH: Final = 480
HEIGHT: Final = 280
_MARGIN: Final = 20
_METRES_PER_DEGREE: Final = 111_319.49
_MIN_SPAN_M: Final = 30.0
_SCALES_M: Final = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000)


def track_picture(track: Sequence[tuple[float, float]]) -> str:
    """Empty without a way. `track`: latitudes and longitudes in degrees."""
    if len(track) < 2:
        return ""
    lat0, lon0 = track[0]
    wide = math.cos(math.radians(lat0))
    places = [
        (((lon - lon0 + 180) % 360 - 180) * wide * _METRES_PER_DEGREE, (lat0 - lat) * _METRES_PER_DEGREE)
        for lat, lon in track
    ]
    xs, ys = [x for x, _ in places], [y for _, y in places]
    scale = min(
        (WIDTH - 2 * _MARGIN) / max(_MIN_SPAN_M, max(xs) - min(xs)),
        (HEIGHT - 2 * _MARGIN) / max(_MIN_SPAN_M, max(ys) - min(ys)),
    )
    middle_x, middle_y = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2
    drawn = [(WIDTH / 2 + (x - middle_x) * scale, HEIGHT / 2 + (y - middle_y) * scale) for x, y in places]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in drawn)
    (begin_x, begin_y), (end_x, end_y) = drawn[0], drawn[-1]
    bar_m = max((one for one in _SCALES_M if one * scale <= WIDTH / 3), default=_SCALES_M[0])
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" role="img" aria-label="The way of the flight, north up">'
        f'<polyline points="{points}" fill="none" stroke="#0f5ea8" stroke-width="1.5"/>'
        f'<circle cx="{begin_x:.1f}" cy="{begin_y:.1f}" r="4" fill="#fff" stroke="#0f5ea8" stroke-width="1.5"/>'
        f'<circle cx="{end_x:.1f}" cy="{end_y:.1f}" r="3.5" fill="#0f5ea8"/>'
        f'<path d="M10 {HEIGHT - 10}h{bar_m * scale:.1f}" stroke="#14202b" stroke-width="2"/>'
        f'<text x="10" y="{HEIGHT - 15}" font-size="11" fill="#14202b">{bar_m} m</text></svg>'
    )
