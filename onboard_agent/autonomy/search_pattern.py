"""Where to search when nobody drew a way: a square spiral. Pure."""

from __future__ import annotations


def square_spiral(around_m: float, apart_m: float) -> list[tuple[float, float]]:
    """Returns the corners, in metres north and east of its middle, of a spiral whose lanes are `apart_m` apart and that
    stays within `around_m` to each side. Without room for a lane: the middle alone."""
    corners = [(0.0, 0.0)]
    ring = 1
    while ring * apart_m <= around_m:
        side_m = ring * apart_m
        corners += [(side_m, apart_m - side_m), (side_m, side_m), (-side_m, side_m), (-side_m, -side_m)]
        corners.append((side_m, -side_m))
        ring += 1
    return corners
