"""Whether the battery is at the level that the way home needs. No I/O; takes `now`.

What this flight has used so far a second, times the way home, times a margin, over a reserve. Too early rather than too
late: whoever stays in the air for nobody must not be brought down by the battery.
"""

from typing import Final

SPEED_M_S: Final = 5.0
DOWN_M_S: Final = 0.8
AROUND_S: Final = 30.0
"""To climb to the height of a return, to turn, to touch down."""
MARGIN: Final = 1.5
RESERVE_PERCENT: Final = 20.0

USUAL_PERCENT_S: Final = 0.1
"""17 minutes of flight, until this flight has told better."""
LEARNT_AFTER_PERCENT: Final = 5.0


class WayHome:
    """Call `seen` at each tick; ask `needed_percent` and `due`."""

    def __init__(self) -> None:
        self._began: tuple[float, float] | None = None
        self._rate = USUAL_PERCENT_S

    def seen(self, now: float, *, airborne: bool, percent: float | None) -> None:
        """What the autopilot says of the battery now."""
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
