"""Reads the facts about one drone from the live state. No I/O."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from server.alerts.core.facts import Facts
from server.alerts.core.kept_telemetry import ATTITUDE
from server.control.core.loan_limits import whole_place_in
from wire.autopilots import registry
from wire.autopilots.failsafe_words import NOT_TOLD
from wire.autopilots.vehicle_types import MULTICOPTERS
from wire.dialect import mavlink
from wire.frames import payload
from wire.signing_key import Signing

if TYPE_CHECKING:
    from server.live.live_drone import LiveDrone

_HEARTBEAT: Final = 9
_TYPE, _AUTOPILOT, _STATUS = 4, 5, 7
"""Offsets in a HEARTBEAT."""
NO_LIMIT: Final = 0.0
BY_HAND_FOR_S: Final = 1.0


def facts_of(drone: LiveDrone, height_limit_m: float, now: float) -> Facts:
    """The present facts, or the last known ones of a drone that is silent. `height_limit_m`: of the tower; 0: none."""
    last = drone.last_heard.view
    holder = drone.lease.holder
    facts = Facts(
        name=drone.record.name,
        known=drone.last_heard.ever,
        held_by=holder.name if holder is not None else None,
        lost_action=None if drone.watched_only else drone.safety.lost_action,
        lost_action_s=drone.safety.lost_action_s,
        hold=drone.hold_view(),
        hold_unconfirmed=drone.hold_unconfirmed,
        hold_reason=drone.hold_reason,
        black_box_problem=drone.black_box_problem,
        signing=drone.signing if drone.online else Signing.OFF,
        noise=drone.noise.words,
    )
    if drone.online and drone.autopilot_heard:
        facts.armed, facts.airborne = drone.armed, drone.airborne
        facts.other_systems, facts.hears_agent = drone.other_systems, drone.hears_agent
        _add_telemetry(facts, drone, now)
        _add_fall(facts, drone, now)
        _add_height(facts, drone, height_limit_m)
    else:
        facts.silence = "autopilot" if drone.online and drone.link is not None else "link"
        if last is not None:
            facts.armed, facts.airborne, facts.height_m = last.armed, last.airborne, last.height_m
            if last.custom_mode is not None:
                _add_mode(facts, last.autopilot or 0, last.vehicle_type or 0, last.custom_mode)
    return facts


def _add_telemetry(facts: Facts, drone: LiveDrone, now: float) -> None:
    telemetry = drone.telemetry
    telemetry.decode(now)
    facts.battery_percent, facts.battery_charge = telemetry.battery_percent, telemetry.battery_charge
    facts.battery_number = telemetry.battery_number
    facts.gps_lost, facts.gps_fix, facts.gps_number = telemetry.gps_lost, telemetry.gps_fix, telemetry.gps_number
    facts.sensor_fault, facts.estimator_fault = telemetry.sensor_fault, telemetry.estimator_fault
    facts.vibration_m_s2, facts.fence_breach = telemetry.vibration_m_s2, telemetry.fence_breach
    facts.aircraft_near, facts.foreign_drone_near = drone.aircraft_near
    facts.zone_near, facts.zone_breach = drone.zone_watch.situation
    facts.motion = drone.motion_check.why if drone.armed is not False else None
    if drone.heartbeat is not None:
        heart = payload(drone.heartbeat).ljust(_HEARTBEAT, b"\0")
        facts.system_status = heart[_STATUS]
        _add_failsafe(facts, drone, heart[_AUTOPILOT])


def _add_failsafe(facts: Facts, drone: LiveDrone, autopilot: int) -> None:
    family = registry.FAMILIES.get(autopilot)
    if family is None or not family.shows_failsafe:
        return
    is_active = facts.system_status == mavlink.MAV_STATE_CRITICAL and drone.armed is True
    told = drone.telemetry.failsafe_told
    if not is_active:
        # The event comes up to a heartbeat before the state: the last one is kept until the drone is disarmed.
        facts.failsafe = ""
        if drone.armed is False:
            drone.telemetry.failsafe_told = None
        return
    facts.failsafe = NOT_TOLD if told is None else told.words
    facts.failsafe_cause = "" if told is None else told.cause.name.lower()


def _add_fall(facts: Facts, drone: LiveDrone, now: float) -> None:
    if drone.heartbeat is None or payload(drone.heartbeat)[_TYPE] not in MULTICOPTERS:
        return
    watch = drone.fall_watch
    watch.look(
        position=drone.position_frame,
        position_at=drone.position_at,
        attitude=drone.telemetry.newest.get((ATTITUDE, 0)),
        armed=drone.armed,
        airborne=drone.airborne,
        may_dive=now - drone.sticks_at < BY_HAND_FOR_S and not _keeps_height(drone.heartbeat),
        now=now,
    )
    facts.falls, facts.sinks, facts.crashed = watch.falls, watch.sinks, watch.crashed
    facts.motors_stopped = watch.stopped


def _keeps_height(heartbeat: bytes) -> bool:
    """Whether the autopilot keeps the height in its mode, sticks or not."""
    heart = payload(heartbeat).ljust(_HEARTBEAT, b"\0")
    profile = registry.nearest(heart[_AUTOPILOT], heart[_TYPE])
    custom_mode = int.from_bytes(heart[:_TYPE], "little")
    return profile.flies_without_sticks(custom_mode) or profile.holds_when_centred(custom_mode)


def _add_height(facts: Facts, drone: LiveDrone, of_tower_m: float) -> None:
    """The height changes all the time, and the rules run again when a fact changes: left out where no limit applies."""
    facts.height_limit_m = _height_limit(drone, of_tower_m)
    if facts.height_limit_m is not None and drone.airborne and drone.position_frame is not None:
        place = whole_place_in(drone.position_frame)
        facts.height_m = None if place is None else place.alt_rel_m


def _add_mode(facts: Facts, autopilot: int, vehicle_type: int, custom_mode: int) -> None:
    profile = registry.nearest(autopilot, vehicle_type)
    mode = profile.mode(custom_mode)
    facts.mode = profile.mode_name(custom_mode)
    facts.task = mode.task if mode is not None else None


def _height_limit(drone: LiveDrone, of_tower_m: float) -> float | None:
    if not drone.record.loans:
        return of_tower_m or None
    limits = [of_tower_m] if of_tower_m else []
    limits += [
        loan.max_height_m
        for loan in drone.record.loans
        if loan.max_height_m is not None and loan.user.id == drone.holder_id
    ]
    return min(limits, default=None)
