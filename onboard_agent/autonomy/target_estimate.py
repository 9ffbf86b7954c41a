"""Where the target lies, from what many pictures say. Pure."""

from __future__ import annotations

from collections import deque
from math import hypot
from statistics import median
from typing import Final

from onboard_agent.autonomy.core.local_plane import LocalPlane
from onboard_agent.autonomy.target_watch import TargetSeen

KEPT: Final = 15
FRESH_S: Final = 2.0
"""An older sighting says nothing on where the target is in the picture now."""
ANOTHER_M: Final = 3.0
"""Further from the estimate: it is another target."""


class TargetEstimate:
    """The place of one target, in metres north and east; another one replaces it."""

    def __init__(self) -> None:
        self.letter: str | None = None
        self.latest: TargetSeen | None = None
        self._places: deque[tuple[float, float]] = deque(maxlen=KEPT)

    def clear(self) -> None:
        """Forgets it."""
        self.letter = self.latest = None
        self._places.clear()

    def add(self, seen: TargetSeen, plane: LocalPlane) -> None:
        """Takes one sighting."""
        place = plane.local(seen.lat_deg, seen.lon_deg)
        middle = self._middle()
        if middle is not None and hypot(place[0] - middle[0], place[1] - middle[1]) > ANOTHER_M:
            self.clear()
        self._places.append(place)
        self.latest = seen
        self.letter = seen.target.letter or self.letter

    def place(self, now_s: float) -> tuple[float, float] | None:
        """Returns the median of the newest sightings; None without a fresh one."""
        if self.latest is None or now_s - self.latest.taken_s > FRESH_S:
            return None
        return self._middle()

    def _middle(self) -> tuple[float, float] | None:
        if not self._places:
            return None
        return median(north for north, _ in self._places), median(east for _, east in self._places)
