"""Follows one target over pictures: confirms, smooths, loses. Pure, and given the time.

    SEARCHING --seen--> TENTATIVE --`confirm_of` in the last `window`--> CONFIRMED
    TENTATIVE, CONFIRMED --unseen for `lose_after_s`--> SEARCHING

What jumps further than the gate is another thing, and does not move the track.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from onboard_agent.vision.square_target import Point, SquareTarget


class TrackState(Enum):
    SEARCHING = "searching"
    TENTATIVE = "tentative"
    CONFIRMED = "confirmed"


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """`confirm_of` sightings among the last `window` pictures confirm. `gate`: permitted jump between two sightings, in
    sides of the target; it grows by itself with every picture in between. `max_growth`: permitted ratio of sides.
    `time_constant_s`: of the smoothing."""

    confirm_of: int = 3
    window: int = 5
    lose_after_s: float = 1.0
    gate: float = 0.75
    max_growth: float = 1.5
    time_constant_s: float = 0.15

    def __post_init__(self) -> None:
        if not 1 <= self.confirm_of <= self.window:
            raise ValueError("confirm_of is to be from 1 to window")
        if self.lose_after_s <= 0.0 or self.time_constant_s < 0.0:
            raise ValueError("lose_after_s is to be above 0, and time_constant_s not below")


@dataclass(frozen=True, slots=True)
class Track:
    """Smoothed place, size and heading (in [-45, 45), see `SquareTarget`). `seen_s`: when last seen. `number` tells
    tracks apart: a new one begins after each loss."""

    number: int
    state: TrackState
    centre_px: Point
    side_px: float
    heading_deg: float
    seen_s: float
    latest: SquareTarget


_QUARTER_DEG: Final = 90.0


class TargetTracker:
    """Call `update` once for each picture, also for those without a target."""

    def __init__(self, settings: TrackerSettings | None = None) -> None:
        self.settings = settings or TrackerSettings()
        self._track: Track | None = None
        self._sightings: deque[bool] = deque(maxlen=self.settings.window)
        self._missed = 0
        self._number = 0

    @property
    def state(self) -> TrackState:
        return self._track.state if self._track is not None else TrackState.SEARCHING

    @property
    def track(self) -> Track | None:
        return self._track

    def update(self, targets: Sequence[SquareTarget], now_s: float) -> Track | None:
        """Takes the targets of one picture; `now_s` never goes back. Returns the track, also while it is unseen but not
        yet lost; None if there is none."""
        track = self._track
        if track is not None and now_s - track.seen_s > self.settings.lose_after_s:
            self._forget()
            track = None
        if track is None:
            if targets:
                self._begin(max(targets, key=lambda target: target.confidence), now_s)
            return self._track
        near = [target for target in targets if self._belongs(target, track)]
        self._sightings.append(bool(near))
        if near:
            self._see(min(near, key=lambda target: math.dist(target.centre_px, track.centre_px)), track, now_s)
        else:
            self._missed += 1
            if track.state is TrackState.TENTATIVE and not any(self._sightings):
                self._forget()
        return self._track

    def _begin(self, target: SquareTarget, now_s: float) -> None:
        self._number += 1
        self._sightings.append(True)
        state = TrackState.CONFIRMED if self.settings.confirm_of == 1 else TrackState.TENTATIVE
        self._track = Track(self._number, state, target.centre_px, target.side_px, target.heading_deg, now_s, target)

    def _forget(self) -> None:
        self._track = None
        self._sightings.clear()
        self._missed = 0

    def _belongs(self, target: SquareTarget, track: Track) -> bool:
        side_px = max(target.side_px, track.side_px)
        if side_px > self.settings.max_growth * min(target.side_px, track.side_px):
            return False
        # From the last sighting: the smoothed place lags behind.
        return math.dist(target.centre_px, track.latest.centre_px) <= self.settings.gate * side_px * (1 + self._missed)

    def _see(self, target: SquareTarget, track: Track, now_s: float) -> None:
        dt_s = max(now_s - track.seen_s, 0.0)
        tau_s = self.settings.time_constant_s
        share = 1.0 if tau_s == 0.0 else 1.0 - math.exp(-dt_s / tau_s)
        state = track.state
        if sum(self._sightings) >= self.settings.confirm_of:
            state = TrackState.CONFIRMED
        turn_deg = (target.heading_deg - track.heading_deg + 45.0) % _QUARTER_DEG - 45.0
        (x, y), (new_x, new_y) = track.centre_px, target.centre_px
        self._missed = 0
        self._track = Track(
            track.number,
            state,
            (x + share * (new_x - x), y + share * (new_y - y)),
            track.side_px + share * (target.side_px - track.side_px),
            (track.heading_deg + share * turn_deg + 45.0) % _QUARTER_DEG - 45.0,
            now_s,
            target,
        )
