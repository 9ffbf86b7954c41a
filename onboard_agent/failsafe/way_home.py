"""Whether the battery is at the level needed for the way home. No I/O; takes `now`.

This flight's consumption per second, times the way home, times a margin, plus a reserve. Rather too early than too
late: a drone that waits for nobody must not be brought down by its battery.
"""

from typing import Final

SPEED_M_S: Final = 5.0
DOWN_M_S: Final = 0.8
AROUND_S: Final = 30.0
"""To climb to the height of a return, to turn, to touch down."""
MARGIN: Final = 1.5
RESERVE_PERCENT: Final = 20.0

USUAL_PERCENT_S: Final = 0.1
"""17 minutes of flight, until this flight has shown its own figure."""
LEARNT_AFTER_PERCENT: Final = 5.0


class WayHome:
    """Call `seen` at each tick; ask `needed_percent` and `due`."""

    def __init__(self) -> None:
        self._began: tuple[float, float] | None = None
        self._rate = USUAL_PERCENT_S

    def seen(self, now: float, *, airborne: bool, percent: float | None) -> None:
        """The autopilot's present battery report."""
        if not airborne or percent is None:
            self._began = None
            return
        if self._began is None or percent > self._began[1]:
            self._began = (now, percent)
            self._rate = USUAL_PERCENT_S
        began_at, began_percent = self._began
        if began_percent - percent >= LEARNT_AFTER_PERCENT:
            self._rate = max((began_percent - percent) / (now - began_at), USUAL_PERCENT_S / 4)

    def needed_percent(self, *, home_m: float | None, alt_rel_m: float) -> float:
        """Percent of the battery below which it must not stay. No home known: the reserve and the way down."""
        way_s = AROUND_S + (home_m or 0.0) / SPEED_M_S + max(alt_rel_m, 0.0) / DOWN_M_S
        return RESERVE_PERCENT + MARGIN * self._rate * way_s

    def due(self, *, percent: float | None, home_m: float | None, alt_rel_m: float) -> bool:
        """Whether it must go home now. An autopilot that does not tell its battery has its own failsafe."""
        return percent is not None and percent <= self.needed_percent(home_m=home_m, alt_rel_m=alt_rel_m)
