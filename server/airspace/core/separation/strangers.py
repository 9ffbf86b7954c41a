"""Alerts about a drone that the recipient may not see: enough to avoid it, and no more. Pure; takes `now`.

Rules:

- The other drone is a direction, a distance, a height difference and a time, all rounded. It has no name and no number.
- An alert begins only if both drones are armed, have live autopilots, and move as machines can.
- Disarming or implausible motion ends it, without a reason.
- An alert is raised at once; its figures change every FIGURES_EVERY_S at most. A pair of drones may begin ALERT_BURST
  alerts at once, then one every ALERT_EVERY_S. A person who connects later gets the last message, not new figures.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from server.airspace.core.separation.approach import Approach
from server.airspace.core.separation.bounds import Level
from server.airspace.core.separation.motion import Relative
from server.airspace.core.separation.near_pairs import Pair
from server.link.core.token_bucket import TokenBucket
from wire.ids import DroneId

BEARING_STEP_DEG: Final = 30
"""Like the hours of a clock."""
DISTANCE_STEP_M: Final = 10
HEIGHT_STEP_M: Final = 5
TIME_STEP_S: Final = 5
FIGURES_EVERY_S: Final = 5.0
ALERT_BURST: Final = 5
ALERT_EVERY_S: Final = 30.0
_MAX_BUCKETS: Final = 4096
"""Pairs with a recent alert. Beyond it, full buckets are dropped: a new one is the same."""


class Rounded(NamedTuple):
    """Figures of an approach; None: unknown. `in_s` is rounded down, so that the time is never overestimated."""

    level: Level
    in_s: int | None = None
    bearing_deg: int | None = None
    distance_m: int | None = None
    above_m: int | None = None


def rounded(level: Level, approach: Approach | None, seen: Relative | None) -> Rounded:
    """Rounds what is known. `seen`: the other drone, relative to the recipient's own."""
    in_s = int(approach.in_s // TIME_STEP_S) * TIME_STEP_S if approach is not None else None
    if seen is None:
        return Rounded(level, in_s)
    return Rounded(
        level,
        in_s,
        round(seen.bearing_deg / BEARING_STEP_DEG) * BEARING_STEP_DEG % 360,
        max(1, round(seen.distance_m / DISTANCE_STEP_M)) * DISTANCE_STEP_M,
        round(seen.up_m / HEIGHT_STEP_M) * HEIGHT_STEP_M,
    )


class StrangerAlert(NamedTuple):
    """For all who see one drone and not the other. `number` identifies the alert from its first message to its last."""

    number: int
    about: Rounded


@dataclass
class _Alert:
    pair: Pair
    sent: StrangerAlert
    sent_at: float


class StrangerAlerts:
    """`new_number` returns random numbers: counted ones would tell how many alerts others have."""

    def __init__(self, new_number: Callable[[], int]) -> None:
        self._new_number = new_number
        self._alerts: dict[tuple[int, int], _Alert] = {}
        """By the encounter's number and the recipient's own drone."""
        self._buckets: dict[tuple[int, int], TokenBucket] = {}
        """Limits how often a pair begins an alert. By recipient's drone and the other."""

    def check(
        self,
        encounter: int,
        pair: Pair,
        level: Level,
        figures: Callable[[], Rounded],
        *,
        qualifies: bool | None,
        now: float,
    ) -> StrangerAlert | None:
        """Returns the message due now, if any. `pair`: the recipient's own drone, then the other. `qualifies`: whether
        both drones qualify for an alert; None: one is silent, which begins nothing and ends nothing."""
        key = encounter, pair[0]
        alert = self._alerts.get(key)
        if level is Level.CLEAR or qualifies is False:
            return self._end(key)
        if alert is None:
            if qualifies is None or not self._may_begin(pair, now):
                return None
            alert = self._alerts[key] = _Alert(pair, StrangerAlert(self._new_number(), figures()), now)
            return alert.sent
        if level <= alert.sent.about.level and now - alert.sent_at < FIGURES_EVERY_S:
            return None
        alert.sent, alert.sent_at = StrangerAlert(alert.sent.number, figures()), now
        return alert.sent

    def last(self, encounter: int, own: int) -> StrangerAlert | None:
        """The last message, while it is valid."""
        alert = self._alerts.get((encounter, own))
        return alert.sent if alert is not None else None

    def present(self) -> Iterator[tuple[DroneId, DroneId, Rounded]]:
        """The recipient's own drone, the other one, and the last message of each alert."""
        return ((*one.pair, one.sent.about) for one in self._alerts.values())

    def forget_all_but(self, encounters: Iterable[int]) -> None:
        """Drops the alerts of encounters that are over, without a message."""
        open_encounters = set(encounters)
        for key in [key for key in self._alerts if key[0] not in open_encounters]:
            del self._alerts[key]

    def _end(self, key: tuple[int, int]) -> StrangerAlert | None:
        alert = self._alerts.pop(key, None)
        return None if alert is None else StrangerAlert(alert.sent.number, Rounded(Level.CLEAR))

    def _may_begin(self, pair: Pair, now: float) -> bool:
        if len(self._buckets) >= _MAX_BUCKETS:
            self._buckets = {one: bucket for one, bucket in self._buckets.items() if not bucket.is_full(now)}
        bucket = self._buckets.get(pair)
        if bucket is None:
            bucket = self._buckets[pair] = TokenBucket(1 / ALERT_EVERY_S, ALERT_BURST, now)
        return bucket.take(1.0, now)
