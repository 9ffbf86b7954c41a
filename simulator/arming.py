"""May the motors start, and may they stop? Each answer is a reason in ArduPilot's words, or None for yes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simulator.modes import RULES, Mode

if TYPE_CHECKING:
    from simulator.flight import Flight

FORCE_MAGIC = 21196.0


def why_not_arm(flight: Flight) -> str | None:
    """The first check that fails, with the prefix under which it is shown."""
    mode, rules, parameters = flight.mode, RULES[flight.mode], flight.parameters
    if not rules.armable:
        return f"Arm: {mode.name.title()} mode not armable"
    if not parameters.whole("ARMING_CHECK"):
        return None
    if not flight.estimator.attitude_ok:
        return "PreArm: AHRS: EKF3 not started"
    if flight.now_s < flight.estimator.ready_s and not flight.estimator.gps_fix:
        return "PreArm: GPS 1: Bad fix"
    if not flight.estimator.position_ok and (rules.needs_position or not flight.estimator_was_ready):
        return "PreArm: Need Position Estimate"
    fence = flight.fence.why_not_arm(flight)
    if fence is not None:
        return f"PreArm: {fence}"
    if parameters.whole("FS_THR_ENABLE"):
        if not flight.sticks.ever_heard:
            return "PreArm: RC not found"
        if flight.failsafes.radio:
            return "PreArm: Radio failsafe on"
    if flight.failsafes.battery_low or flight.failsafes.battery_critical:
        return "PreArm: Battery 1 low voltage failsafe"
    if mode in (Mode.GUIDED, Mode.AUTO):
        return None  # armed from the ground station, a raised throttle does no harm there
    if flight.sticks.climb_mps > 0.0 or (rules.manual_throttle and flight.sticks.throttle > 0.0):
        return "Arm: Throttle too high"
    return None
