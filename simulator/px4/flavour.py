"""The PX4 flavour, assembled."""

from __future__ import annotations

from simulator.flavour import Flavour, Storage
from simulator.flight import Flight
from simulator.mission_plan import PlanKind
from simulator.px4.commands import HANDLERS, set_mode_number
from simulator.px4.failsafe import Px4Failsafes
from simulator.px4.fence import fence_limits, on_fence_breach
from simulator.px4.mission_storage import accept_item, why_not_jump, why_not_whole
from simulator.px4.modes import RULES, Px4Mode, make_behaviours
from simulator.px4.parameters import make_parameters
from simulator.px4.reports import INTERVALS_S, REPORTS
from simulator.px4.sticks import Px4Sticks
from simulator.reports_camera import camera_trigger


def why_not_arm(flight: Flight) -> str | None:
    rules = RULES[flight.mode]
    if not flight.estimator.attitude_ok:
        return "Preflight Fail: Attitude estimate missing"
    if not rules.armable:
        return f"Arming denied: {flight.mode.name} mode"
    if rules.needs_position and not flight.estimator.position_ok:
        return "Preflight Fail: Position estimate missing"
    if rules.pilot_controlled and flight.sticks.silent_for_s(flight.now_s) > 0.0:
        return "Preflight Fail: No manual control input"
    if rules.pilot_controlled and flight.sticks.climb_mps > 0.0:
        return "Arming denied: throttle above center"
    if rules.manual_throttle and flight.sticks.throttle > 100.0:
        return "Arming denied: high throttle"
    fence = flight.fence.why_not_arm(flight) if flight.estimator.position_ok else None
    if fence is not None:
        return f"Preflight Fail: {fence}"
    if flight.failsafes.battery_low or flight.failsafes.battery_critical:
        return "Preflight Fail: Battery low"
    return None


def disarm_delay_s(flight: Flight) -> float:
    return flight.parameters["COM_DISARM_LAND" if flight.has_flown else "COM_DISARM_PRFLT"]


PX4 = Flavour(
    name="px4",
    banner=("PX4 v1.15.4 (simulated)",),
    first_mode=Px4Mode.LOITER,
    land_mode=Px4Mode.LAND,
    rules=RULES,
    make_behaviours=make_behaviours,
    make_parameters=make_parameters,
    make_sticks=Px4Sticks,
    make_failsafes=Px4Failsafes,
    why_not_ready=why_not_arm,
    why_not_arm=why_not_arm,
    home_slot=False,
    keeps_dataflash_logs=False,
    keeps_parameter_file=False,
    offers_metadata=True,
    storage=Storage(accept_item, why_not_jump, why_not_whole),
    items_max={PlanKind.MISSION: 2000, PlanKind.FENCE: 64, PlanKind.RALLY: 32},
    fence_limits=fence_limits,
    on_fence_breach=on_fence_breach,
    handlers=HANDLERS,
    reports=REPORTS,
    setup_reports={},
    photo_message=camera_trigger,
    intervals_s=INTERVALS_S,
    fixed_rates=frozenset({0}),
    obeys_stream_requests=False,
    answers_modes_twice=True,
    reports_mode_at_once=False,
    system_id_parameter="MAV_SYS_ID",
    battery_parameter="BAT1_CAPACITY",
    accepts_any_ground_station=True,
    signs=False,
    disarm_delay_s=disarm_delay_s,
    lands_with_throttle_up=True,
    set_mode_number=set_mode_number,
)
