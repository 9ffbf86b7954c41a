"""Draws the flight display onto a picture. Loads Pillow: import it in the process that makes videos only."""

from __future__ import annotations

import math
import unicodedata
from datetime import UTC, datetime
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from server.flights.core.videos.display_values import DisplayValues

Picture = NDArray[np.uint8]
"""Height x width x 3: red, green, blue."""
Align = Literal["left", "middle", "right"]
NAMES: Final = 24
"""Letters of a name that are shown."""
UNKNOWN: Final = "--"
_INK, _SHADE, _LINE = (255, 255, 255), (0, 0, 0), (80, 255, 120)
_ALARM: Final = (255, 60, 50)
_PITCH_RANGE_DEG: Final = 30.0
"""From the middle to the upper and lower end of the horizon's window."""
_LADDER_DEG: Final = (-20, -10, 10, 20)


class Field(NamedTuple):
    """`row`: lines of text from the upper edge, negative ones from the lower edge, -1 the last."""

    name: str
    row: int
    align: Align
    text: str
    is_alarm: bool = False


def fields(values: DisplayValues) -> list[Field]:
    """The texts of the display, each at its place."""
    time = datetime.fromtimestamp(values.at_us // 1000 / 1000, UTC)
    return [
        Field("time", 0, "left", f"{time:%Y-%m-%d %H:%M:%S}.{time.microsecond // 100_000} UTC"),
        Field("heading", -2, "middle", f"HDG {_number(values.heading_deg, '03.0f')}"),
        Field("mode", 0, "right", values.mode or UNKNOWN),
        Field("height", -2, "left", f"H {_number(values.height_m, '.1f')} m"),
        Field("speed", -1, "left", f"GS {_number(values.speed_m_s, '.1f')} m/s"),
        Field("holder", -3, "left", f"Controls: {plain(values.holder)[:NAMES] or 'nobody'}"),
        Field("battery", -2, "right", _battery(values)),
        Field("link", -1, "right", values.link or f"LINK {UNKNOWN}", is_alarm=values.link == "LINK LOST"),
        Field("hold", 2, "middle", values.hold, is_alarm=True),
    ]


def _battery(values: DisplayValues) -> str:
    percent = _number(values.battery_percent, "d")
    return f"BAT {percent} % {_number(values.battery_v, '.1f')} V"


def _number(value: float | None, how: str) -> str:
    return UNKNOWN if value is None else format(value, how)


def plain(text: str) -> str:
    """The letters that the built-in font has."""
    spread = unicodedata.normalize("NFKD", text)
    return "".join(one if one.isascii() else "?" for one in spread if not unicodedata.combining(one))


class Display:
    """For pictures of one size, in pixels."""

    def __init__(self, width: int, height: int) -> None:
        self._width, self._height = width, height
        self.line_px = max(7, min(height // 20, width // 26))
        """Height of a line of text."""
        self._font = ImageFont.load_default(self.line_px)
        self._edge = max(1, self.line_px // 10)
        self._margin = self.line_px // 3

    def draw(self, picture: Picture, values: DisplayValues) -> Picture:
        """Returns a new picture."""
        image = Image.fromarray(picture)
        canvas = ImageDraw.Draw(image)
        if values.roll_deg is not None and values.pitch_deg is not None:
            self._horizon(canvas, values.roll_deg, values.pitch_deg)
        for field in fields(values):
            if field.text:
                self._text(canvas, field)
        return np.asarray(image)

    def box(self, field: Field) -> tuple[int, int, int, int]:
        """Where the text of a field is: left, upper, right, lower."""
        width = math.ceil(self._font.getlength(field.text)) + 2 * self._edge
        step = round(self.line_px * 1.3)
        left = {
            "left": self._margin,
            "middle": (self._width - width) // 2,
            "right": self._width - self._margin - width,
        }[field.align]
        row = field.row
        upper = self._margin + row * step if row >= 0 else self._height - self._margin + row * step
        return left, upper, left + width, upper + step

    def _text(self, canvas: ImageDraw.ImageDraw, field: Field) -> None:
        left, upper, _, _ = self.box(field)
        ink = _ALARM if field.is_alarm else _INK
        place = (left + self._edge, upper)
        canvas.text(place, field.text, font=self._font, fill=ink, stroke_width=self._edge, stroke_fill=_SHADE)

    def _horizon(self, canvas: ImageDraw.ImageDraw, roll_deg: float, pitch_deg: float) -> None:
        """The horizon as one sees it from the cockpit: it tilts against the roll, and sinks as the nose rises."""
        half = self._height * 0.22
        per_deg = half / _PITCH_RANGE_DEG
        middle = self._width / 2, self._height / 2
        roll = math.radians(-roll_deg)
        along, down = (math.cos(roll), math.sin(roll)), (-math.sin(roll), math.cos(roll))
        for angle_deg in (0, *_LADDER_DEG):
            away = max(-1.5 * half, min(1.5 * half, (pitch_deg - angle_deg) * per_deg))
            reach = self._width * (0.22 if angle_deg == 0 else 0.06)
            x, y = middle[0] + down[0] * away, middle[1] + down[1] * away
            ends = [(x + sign * along[0] * reach, y + sign * along[1] * reach) for sign in (-1, 1)]
            self._stroke(canvas, ends, _LINE)
        wing = self._width * 0.05
        for sign in (-1, 1):
            inner, outer = middle[0] + sign * wing * 0.4, middle[0] + sign * wing * 1.4
            self._stroke(canvas, [(inner, middle[1]), (outer, middle[1])], _INK)

    def _stroke(self, canvas: ImageDraw.ImageDraw, ends: list[tuple[float, float]], ink: tuple[int, int, int]) -> None:
        canvas.line(ends, fill=_SHADE, width=3 * self._edge)
        canvas.line(ends, fill=ink, width=self._edge)
