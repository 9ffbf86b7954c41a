"""Chooses the size in which a picture is encoded (no I/O)."""

from typing import NamedTuple

from wire.video import QualityLimits

MIN_SIDE = 48


class Shape(NamedTuple):
    """Width and height in pixels."""

    width: int
    height: int


def coded_shape(source: Shape, limits: QualityLimits, scale: float) -> Shape:
    """The largest shape with the source's proportions within the limits, times `scale`; never larger than the source.

    Both sides are even, because colour is subsampled by two, and at least 48 pixels. The codecs work in blocks of 16
    and pad the last ones by themselves; the headers state the visible size.
    """
    fit = min(1.0, limits.width / source.width, limits.height / source.height) * scale
    return Shape(_even(source.width * fit), _even(source.height * fit))


def _even(side: float) -> int:
    return max(MIN_SIDE, round(side / 2) * 2)
