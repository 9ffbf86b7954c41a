"""What people learn of a drone that they may not see: enough to avoid it, and no more. Pure; takes `now`.

Rules:

- The other drone is a direction, a distance, a height difference and a time, all rounded. It has no name and no number.
- An alert begins only if both drones are armed, have live autopilots, and move as machines can.
- Disarming or implausible motion ends it, without a reason.
- An alert is raised at once; its figures change every FIGURES_EVERY_S. Two drones begin BEGUN_AT_ONCE alerts, then one
  in BEGUN_EVERY_S. A person who connects later gets the last message, not the present figures.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

from server.live.relay.token_bucket import TokenBucket
from server.live.separation.approach import Approach
from server.live.separation.bounds import Level
from server.live.separation.motion import Relative
from server.live.separation.near_pairs import Pair

BEARING_STEP_DEG: Final = 30
"""The hours of a clock."""
DISTANCE_STEP_M: Final = 10
HEIGHT_STEP_M: Final = 5
TIME_STEP_S: Final = 5
FIGURES_EVERY_S: Final = 5.0
BEGUN_AT_ONCE: Final = 5
BEGUN_EVERY_S: Final = 30.0
_MAX_BUCKETS: Final = 4096
"""Pairs that had an alert of late. Beyond it those that are as good as new are forgotten."""


class Rounded(NamedTuple):
    """`in_s`: rounded down, so that the time is never overestimated. None: not known."""

    level: Level
    in_s: int | None = None
    bearing_deg: int | None = None
    distance_m: int | None = None
    above_m: int | None = None


def rounded(level: Level, approach: Approach | None, seen: Relative | None) -> Rounded:
    """`seen`: the other drone as one's own sees it."""
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
    at: float


class StrangerAlerts:
    """`new_number`: at random. Counted ones would tell how many alerts others have."""

    def __init__(self, new_number: Callable[[], int]) -> None:
        self._new_number = new_number
        self._alerts: dict[tuple[int, int], _Alert] = {}
        """By the encounter's number and the drone that is seen."""
        self._begun: dict[tuple[int, int], TokenBucket] = {}
        """By recipient and subject."""

    def check(
        self, encounter: int, pair: Pair, level: Level, about: Callable[[], Rounded], *, fit: bool | None, now: float
    ) -> StrangerAlert | None:
        """The message due now; None: nothing. `pair`: one's own drone, then the other. `fit`: whether both qualify for
        an alert; None: one is silent, which begins nothing and ends nothing."""
        key = encounter, pair[0]
        alert = self._alerts.get(key)
        if level is Level.CLEAR or fit is False:
            return self._end(key)
        if alert is None:
            if fit is None or not self._may_begin(pair, now):
                return None
            alert = self._alerts[key] = _Alert(pair, StrangerAlert(self._new_number(), about()), now)
            return alert.sent
        if level <= alert.sent.about.level and now - alert.at < FIGURES_EVERY_S:
            return None
        alert.sent, alert.at = StrangerAlert(alert.sent.number, about()), now
        return alert.sent

    def last(self, encounter: int, own: int) -> StrangerAlert | None:
        """The last message, while it is valid."""
        alert = self._alerts.get((encounter, own))
        return alert.sent if alert is not None else None

    def forget_all_but(self, encounters: Iterable[int]) -> None:
        """Those that ended without a word."""
        going_on = set(encounters)
        for key in [key for key in self._alerts if key[0] not in going_on]:
            del self._alerts[key]

    def _end(self, key: tuple[int, int]) -> StrangerAlert | None:
        alert = self._alerts.pop(key, None)
        return None if alert is None else StrangerAlert(alert.sent.number, Rounded(Level.CLEAR))

    def _may_begin(self, pair: Pair, now: float) -> bool:
        if len(self._begun) >= _MAX_BUCKETS:
            self._begun = {one: bucket for one, bucket in self._begun.items() if not bucket.is_full(now)}
        bucket = self._begun.get(pair)
        if bucket is None:
            bucket = self._begun[pair] = TokenBucket(1 / BEGUN_EVERY_S, BEGUN_AT_ONCE, now)
        return bucket.take(1.0, now)
