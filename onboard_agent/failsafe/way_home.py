"""Whether the battery is down to the level needed for the way home. No I/O; takes `now`.

The level is this flight's consumption per second, times the duration of the way home, times a margin, plus a reserve.
It errs on the early side: the battery must not bring down a drone that stays in the air without a pilot.
"""

from typing import Final

SPEED_M_S: Final = 5.0
DOWN_M_S: Final = 0.8
AROUND_S: Final = 30.0
"""Time to climb to the height of a return, to turn and to touch down."""
MARGIN: Final = 1.5
RESERVE_PERCENT: Final = 20.0

USUAL_PERCENT_S: Final = 0.1
"""17 minutes of flight. Used until this flight has yielded a better value."""
LEARNT_AFTER_PERCENT: Final = 5.0


class WayHome:
    """Call `seen` at each tick; query `needed_percent` and `due`."""

    def __init__(self) -> None:
        self._began: tuple[float, float] | None = None
        self._rate = USUAL_PERCENT_S

    def seen(self, now: float, *, airborne: bool, percent: float | None) -> None:
        """Records the battery level that the autopilot reports now."""
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
        """Battery percentage at which the drone must go home. Without a known home: the reserve and the way down."""
        way_s = AROUND_S + (home_m or 0.0) / SPEED_M_S + max(alt_rel_m, 0.0) / DOWN_M_S
        return RESERVE_PERCENT + MARGIN * self._rate * way_s

    def due(self, *, percent: float | None, home_m: float | None, alt_rel_m: float) -> bool:
        """Whether the drone must go home now. An autopilot that reports no battery level has its own failsafe."""
        return percent is not None and percent <= self.needed_percent(home_m=home_m, alt_rel_m=alt_rel_m)
