"""The lines of the preflight checklist that the tower fills in by itself. Pure: facts in, lines out.

Each line names one thing that a pilot checks before take-off, says whether it is good, and why in words. A line never
bars a flight: the autopilot's own arming checks and the loss check do that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

ENOUGH_BATTERY_PERCENT: Final = 80
LITTLE_BATTERY_PERCENT: Final = 30
ENOUGH_SATELLITES: Final = 8
FIX_3D: Final = 3
_OK_CHARGE: Final = 1
"""MAV_BATTERY_CHARGE_STATE_OK."""
SLOW_MS: Final = 500.0
LOSSY: Final = 0.05
LOW_RETURN_M: Final = 10.0


class LineState(StrEnum):
    """How a line stands."""

    GOOD = "good"
    CAUTION = "caution"
    BAD = "bad"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class CheckLine:
    """One line. `key`: stable, for programs. `words`: a sentence for people."""

    key: str
    title: str
    state: LineState
    words: str


@dataclass(frozen=True, kw_only=True)
class PreflightFacts:
    """What the tower knows of one drone at one moment. None: not known, never "no"."""

    online: bool = False
    heard: bool = False
    hears_agent: bool | None = None
    rtt_ms: float | None = None
    loss: float | None = None
    arming_ok: bool | None = None
    arming_words: tuple[str, ...] = ()
    """What the autopilot gave as reasons against arming in the last minute."""
    remote_id: str | None = None
    """Why the Remote ID transmitter is not ready; empty: it is; None: there is none, or it is silent."""
    battery_percent: int | None = None
    battery_charge: int | None = None
    gps_fix: int | None = None
    satellites: int | None = None
    gps_number: int | None = None
    """Which of several GPS is the worst, from 1."""
    has_home: bool = False
    return_height_m: float | None = None
    loss_complete: bool = False
    loss_dangers: int = 0
    loss_warnings: int = 0
    loss_acknowledged: bool = False
    plan_known: bool = False
    plan_items: int = 0
    plan_fits: bool = True
    fence_known: bool = False
    fence_items: int = 0


def preflight_lines(facts: PreflightFacts) -> list[CheckLine]:
    """Returns every line, in the order in which a pilot reads them."""
    lines = [CheckLine(key, title, *judge(facts)) for key, title, judge in _LINES]
    if facts.remote_id is not None:  # most drones have no transmitter
        lines.insert(_BEHIND_ARMING, CheckLine("remote-id", "Remote ID", *_remote_id(facts.remote_id)))
    return lines


Judged = tuple[LineState, str]
_GOOD, _CAUTION, _BAD, _UNKNOWN = LineState.GOOD, LineState.CAUTION, LineState.BAD, LineState.UNKNOWN


def _link(facts: PreflightFacts) -> Judged:
    if not facts.online:
        return _BAD, "The drone is offline."
    if not facts.heard:
        return _BAD, "The agent is online, but its autopilot is silent."
    if facts.rtt_ms is None or facts.loss is None:
        return _UNKNOWN, "The link is not measured yet."
    measured = f"Round trip {facts.rtt_ms:.0f} ms, {facts.loss * 100:.0f} % lost."
    return (_CAUTION if facts.rtt_ms > SLOW_MS or facts.loss > LOSSY else _GOOD), measured


def _answers(facts: PreflightFacts) -> Judged:
    if not facts.heard or facts.hears_agent is None:
        return _UNKNOWN, "It is not known yet whether the autopilot hears its agent."
    if facts.hears_agent:
        return _GOOD, "The autopilot answers its agent."
    return _BAD, "The autopilot does not answer its agent: no command reaches it, and it cannot be held."


def _remote_id(problem: str) -> Judged:
    if problem:
        return _BAD, f"The Remote ID transmitter is not ready: {problem.rstrip('. ')}."
    return _GOOD, "The Remote ID transmitter is ready."


def _arming(facts: PreflightFacts) -> Judged:
    if facts.arming_words:
        return _BAD, "The autopilot does not arm: " + "; ".join(facts.arming_words) + "."
    if facts.arming_ok is None:
        return _UNKNOWN, "The autopilot has not reported its arming checks."
    if facts.arming_ok is False and facts.remote_id:
        return _BAD, f"The autopilot does not arm: Remote ID: {facts.remote_id.rstrip('. ')}."
    if facts.arming_ok:
        return _GOOD, "The autopilot is ready to arm."
    return _BAD, "The autopilot does not arm, and has not said why yet. It repeats its reasons about every 30 seconds."


def _battery(facts: PreflightFacts) -> Judged:
    if facts.battery_charge is not None and facts.battery_charge > _OK_CHARGE:
        return _BAD, "The autopilot reports a low or faulty battery."
    percent = facts.battery_percent
    if percent is None:
        return _UNKNOWN, "The autopilot does not report the charge."
    words = f"{percent} % charged."
    if percent < LITTLE_BATTERY_PERCENT:
        return _BAD, words
    return (_GOOD if percent >= ENOUGH_BATTERY_PERCENT else _CAUTION), words


def _position(facts: PreflightFacts) -> Judged:
    if facts.gps_fix is None:
        return _UNKNOWN, "No GPS has reported."
    which = "" if facts.gps_number is None else f" of GPS {facts.gps_number}"
    count = which if facts.satellites is None else f"{which}, {facts.satellites} satellites"
    if facts.gps_fix < FIX_3D:
        return _BAD, f"No position fix{count}."
    few = facts.satellites is not None and facts.satellites < ENOUGH_SATELLITES
    return (_CAUTION if few else _GOOD), f"Position fix{count}."


def _home(facts: PreflightFacts) -> Judged:
    return (_GOOD, "Home is set.") if facts.has_home else (_UNKNOWN, "The autopilot has not reported a home yet.")


def _return_height(facts: PreflightFacts) -> Judged:
    height = facts.return_height_m
    if height is None:
        return _UNKNOWN, "The height of the return is not known."
    if height <= 0:
        return _CAUTION, "A return flies at the height that the drone has then: check the obstacles on the way home."
    words = f"A return flies home at {height:g} m or more above home. Check that nothing on the way is higher."
    return (_CAUTION if height < LOW_RETURN_M else _GOOD), words


def _failsafes(facts: PreflightFacts) -> Judged:
    if facts.loss_dangers:
        told = "acknowledged" if facts.loss_acknowledged else "not acknowledged"
        return _BAD, f"{_count(facts.loss_dangers, 'danger')} on a loss, {told}: read the check before flight."
    if not facts.loss_complete:
        return _UNKNOWN, "Not all failsafe parameters were read."
    if facts.loss_warnings:
        return _CAUTION, f"{_count(facts.loss_warnings, 'warning')} in the check before flight."
    return _GOOD, "No danger found in the check before flight."


def _plan(facts: PreflightFacts) -> Judged:
    if not facts.plan_known:
        return _UNKNOWN, "The plan on board was not read yet."
    if not facts.plan_fits:
        return _BAD, "The plan on board may be incomplete: upload it again."
    if not facts.plan_items:
        return _GOOD, "No mission is on board."
    return _GOOD, f"A mission of {_count(facts.plan_items, 'item')} is on board. Check that it is the one you mean."


def _fence(facts: PreflightFacts) -> Judged:
    if not facts.fence_known:
        return _UNKNOWN, "The fence on board was not read yet."
    if facts.fence_items:
        return _GOOD, f"A fence of {_count(facts.fence_items, 'point')} is on board."
    return _CAUTION, "No fence is on board."


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


_LINES: Final[Sequence[tuple[str, str, Callable[[PreflightFacts], Judged]]]] = (
    ("link", "Link", _link),
    ("answers", "Commands", _answers),
    ("arming", "Arming checks", _arming),
    ("battery", "Battery", _battery),
    ("position", "GPS", _position),
    ("home", "Home", _home),
    ("return-height", "Return height", _return_height),
    ("failsafes", "Failsafes", _failsafes),
    ("plan", "Plan on board", _plan),
    ("fence", "Fence", _fence),
)
_BEHIND_ARMING: Final = 3
