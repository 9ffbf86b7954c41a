"""The figures of a hold from the tap: times, sticks that still arrived, and the vehicle's motion. No I/O."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bench.tap import AGENT, Motion, Tap

LEVEL_DEG = 5.0
SETTLED_AFTER_S = 3.0
WATCHED_S = 6.0
STOPPED_MPS = 0.5


@dataclass(frozen=True, slots=True)
class HoldFigures:
    began_at: float
    """The agent's first action at the autopilot's port: centred sticks, or a mode request."""
    mode_at: float
    """The heartbeat that first reported the hold's mode."""
    foreign_frames: int
    """Of the old holder's sticks, after it began."""
    level_s: float
    height_off_m: float
    """The farthest from where it began."""
    height_unsettled_m: float
    """The farthest from the mean, once settled."""
    stopped_s: float
    speed_end_mps: float


def began_at(tap: Tap, since: float) -> float | None:
    """Returns when the agent first acted for this hold at the autopilot's port: its mode request.

    Its centred sticks leave at the same moment, but those of an earlier hold may still be arriving; they count only
    without a mode request.
    """
    sticks = (stick.at for stick in tap.sticks if stick.at >= since and stick.who == AGENT)
    requests = (at for at in tap.mode_requests if at >= since)
    return next(requests, None) or next(sticks, None)


def mode_shown_at(tap: Tap, since: float, numbers: set[int]) -> float | None:
    return next((seen.at for seen in tap.modes if seen.at >= since and seen.custom_mode in numbers), None)


def figures(tap: Tap, since: float, old_holder: int, numbers: set[int]) -> HoldFigures:
    """`since`: the time of the trigger. `numbers`: the custom modes that a hold may end in."""
    start = began_at(tap, since)
    if start is None:
        nothing = math.nan
        return HoldFigures(nothing, nothing, -1, nothing, nothing, nothing, nothing, nothing)
    shown = mode_shown_at(tap, since, numbers)
    foreign = sum(1 for stick in tap.sticks if stick.at > start and stick.who == old_holder)
    tilts = [(at - start, tilt) for at, tilt in tap.tilts if 0 <= at - start <= WATCHED_S]
    motions = [motion for motion in tap.motions if 0 <= motion.at - start <= WATCHED_S]
    return HoldFigures(
        start,
        shown if shown is not None else math.nan,
        foreign,
        _last_above([(at, tilt) for at, tilt in tilts], LEVEL_DEG),
        *_heights(motions, start),
        _last_above([(motion.at - start, motion.speed_mps) for motion in motions], STOPPED_MPS),
        motions[-1].speed_mps if motions else math.nan,
    )


def _last_above(values: list[tuple[float, float]], limit: float) -> float:
    """Returns when it fell below the limit for good; NaN if it never did."""
    if not values or values[-1][1] > limit:
        return math.nan
    return max((at for at, value in values if value > limit), default=0.0)


def _heights(motions: list[Motion], start: float) -> tuple[float, float]:
    if not motions:
        return math.nan, math.nan
    first_m = motions[0].alt_m
    settled = [motion.alt_m for motion in motions if motion.at - start >= SETTLED_AFTER_S]
    mean_m = sum(settled) / len(settled) if settled else math.nan
    unsettled_m = max((abs(alt_m - mean_m) for alt_m in settled), default=math.nan)
    return max(abs(motion.alt_m - first_m) for motion in motions), unsettled_m
