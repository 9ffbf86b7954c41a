"""Arming checks. Each returns a reason in ArduPilot's words, or None if the motors may start."""

from __future__ import annotations

from simulator.flight import Flight
from simulator.modes import RULES, Mode

FORCE_MAGIC = 21196.0

CHECK_THROTTLE = 32
SKIP_ROLL_PITCH_YAW = 64
"""RC_OPTIONS."""
SPRUNG_THROTTLE = 1
"""PILOT_THR_BHV: the throttle rests in its middle."""
STICKS_FRESH_S = 1.0
"""Older stick positions are ignored."""


def why_not_ready(flight: Flight) -> str | None:
    """Returns the first failure of the checks that run continuously while disarmed."""
    reason = _before_arming(flight) if flight.parameters.whole("ARMING_CHECK") else None
    return f"PreArm: {reason}" if reason else None


def why_not_arm(flight: Flight) -> str | None:
    """Returns the first check that fails on an attempt to arm."""
    mode, rules = flight.mode, RULES[flight.mode]
    checks = flight.parameters.whole("ARMING_CHECK")
    reason = _before_arming(flight) if checks else None
    if reason is None and not rules.armable:
        reason = f"{mode.name.title()} mode not armable"
    if reason is None and checks:
        reason = _sticks_in_the_way(flight)
    return f"Arm: {reason}" if reason else None


def _before_arming(flight: Flight) -> str | None:
    rules, parameters = RULES[flight.mode], flight.parameters
    if parameters.whole("FS_THR_ENABLE") and not flight.sticks.ever_heard:
        return "RC not found"
    unfinished = flight.setup.why_not_ready()
    if unfinished is not None:
        return unfinished
    if not flight.estimator.attitude_ok:
        return "AHRS: EKF3 not started"
    if flight.now_s < flight.estimator.ready_s and not flight.estimator.gps_fix:
        return "GPS 1: Bad fix"
    if not flight.estimator.position_ok and (rules.needs_position or not flight.estimator_was_ready):
        return "Need Position Estimate"
    fence = flight.fence.why_not_arm(flight)
    if fence is not None:
        return fence
    if flight.failsafes.radio:
        return "Radio failsafe on"
    if flight.failsafes.battery_low or flight.failsafes.battery_critical:
        return "Battery 1 low voltage failsafe"
    return None


def _sticks_in_the_way(flight: Flight) -> str | None:
    sticks, rules, parameters = flight.sticks, RULES[flight.mode], flight.parameters
    if flight.mode not in (Mode.GUIDED, Mode.AUTO) and (
        sticks.climb_mps > 0.0 or (rules.manual_throttle and sticks.throttle > 0.0)
    ):
        return "Throttle too high"
    if sticks.silent_for_s(flight.now_s) > STICKS_FRESH_S:
        return None
    options = parameters.whole("RC_OPTIONS")
    if not options & SKIP_ROLL_PITCH_YAW:
        for axis, value in (("Roll", sticks.roll), ("Pitch", sticks.pitch), ("Yaw", sticks.yaw)):
            if value != 0.0:
                return _not_neutral(flight, axis)
    checks_throttle = options & CHECK_THROTTLE and not parameters.whole("PILOT_THR_BHV") & SPRUNG_THROTTLE
    if checks_throttle and sticks.throttle > 0.0:
        return _not_neutral(flight, "Throttle")
    return None


def _not_neutral(flight: Flight, axis: str) -> str:
    return f"{axis} (RC{flight.parameters.whole(f'RCMAP_{axis.upper()}')}) is not neutral"
