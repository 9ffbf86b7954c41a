"""The hills of the simulated land: the height of the ground, in metres above home.

The land is flat where the squad stands and rises and falls farther out. The same formula makes the ground that vehicles
touch and the map that `simulator.land_map` writes, so that both are the same land. Needs no NumPy by itself: the map
passes it as `maths`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

FLAT_M: Final = 300.0
"""Within a third of this the ground departs from home's height by less than a metre."""
WAVES: Final = (
    (34.0, 1 / 1900.0, 1 / 1300.0, 0.4),
    (17.0, 1 / 700.0, -1 / 1100.0, 1.9),
    (8.0, -1 / 430.0, 1 / 520.0, 3.1),
)
"""Height in metres, waves a metre to the east and to the north, and phase."""
RISE_M: Final = 14.0
"""Home lies in a valley: the land around is higher by this, on average."""

Ground = Callable[[float, float], float]
"""The height of the ground over a vehicle's origin, at metres north and east of it."""


def hills_m(north_m: Any, east_m: Any, maths: Any = math) -> Any:
    """Returns the height of the ground above home's, at metres north and east of home. `maths`: math, or NumPy for
    arrays."""
    waves = RISE_M
    for high_m, per_east, per_north, phase in WAVES:
        waves = waves + high_m * maths.sin(math.tau * (per_east * east_m + per_north * north_m) + phase)
    away = (east_m * east_m + north_m * north_m) / FLAT_M**2
    return waves * (1.0 - maths.exp(-away * away))


def ground_around(north_m: float, east_m: float) -> Ground:
    """Returns the ground as seen by a vehicle that stands at metres north and east of home."""
    own_m = hills_m(north_m, east_m)
    return lambda north, east: float(hills_m(north_m + north, east_m + east) - own_m)
