"""Conditions of the machine: battery, position estimate, vibration, fence, height. Pure.

A limit has a way back: an alert that is open ends only when the value is better than the limit by a margin.
"""

from typing import Final

from server.alerts.core.facts import Facts
from server.alerts.core.finding import Finding, Not
from wire.dialect import mavlink
from wire.open_holds import HoldStage, LostPhase

LOW_PERCENT: Final = 30
CRITICAL_PERCENT: Final = 15
"""For an autopilot that has no thresholds of its own."""
BACK_PERCENT: Final = 3
MAX_VIBRATION_M_S2: Final = 60.0
"""ArduPilot's documents call 30 acceptable and 60 a certain problem."""
VIBRATION_BACK_M_S2: Final = 45.0
HEIGHT_BACK_M: Final = 2.0

_OK: Final = int(mavlink.MAV_BATTERY_CHARGE_STATE_OK)
_LOW: Final = int(mavlink.MAV_BATTERY_CHARGE_STATE_LOW)
_CRITICAL: Final = int(mavlink.MAV_STATE_CRITICAL)
_EMERGENCY: Final = int(mavlink.MAV_STATE_EMERGENCY)
_COMES_DOWN: Final = (LostPhase.ASKING, LostPhase.DONE)
_3D_FIX: Final = int(mavlink.GPS_FIX_TYPE_3D_FIX)
_MOTION: Final = {
    "jump": "Its position jumped",
    "speed": "It reports a speed that no drone has",
    "height": "It reports a height where no drone flies",
    "course": "It does not move where its speed points",
}


def battery_critical(facts: Facts, is_open: bool) -> Finding:
    return _battery(facts, "critical", is_open) if not _is_on_bench(facts) else Not.SO


def battery_low(facts: Facts, is_open: bool) -> Finding:
    return _battery(facts, "low", is_open) if not _is_on_bench(facts) else Not.SO


def battery_on_ground(facts: Facts, is_open: bool) -> Finding:
    if not _is_on_bench(facts):
        return Not.SO if facts.armed is not None or facts.airborne is not None else Not.KNOWN
    found = _battery(facts, "critical", is_open)
    return found if isinstance(found, str) else _battery(facts, "low", is_open)


def autopilot_emergency(facts: Facts, is_open: bool) -> Finding:
    if facts.silence or facts.system_status is None:
        return Not.KNOWN
    if facts.system_status == _CRITICAL and facts.failsafe is not None:
        return Not.SO  # its failsafe acts, and has an alert of its own
    if facts.system_status in (_CRITICAL, _EMERGENCY):
        return f"The autopilot of {facts.name} reports an emergency."
    return Not.SO


def estimator(facts: Facts, is_open: bool) -> Finding:
    if not facts.flies or facts.estimator_fault is None:
        return _on_ground(facts)
    if facts.estimator_fault:
        return f"{facts.name} does not trust its position estimate (EKF): {facts.estimator_fault}."
    return Not.SO


def gps(facts: Facts, is_open: bool) -> Finding:
    if not facts.flies or facts.gps_lost is None:
        return _on_ground(facts)
    return f"{facts.name} has no GPS fix in the air." if facts.gps_lost else Not.SO


def sensor(facts: Facts, is_open: bool) -> Finding:
    """One that others may replace: without any GPS fix there is another alert."""
    if not facts.flies or (facts.sensor_fault is None and facts.gps_lost is None):
        return _on_ground(facts)
    if facts.sensor_fault:
        return f"{facts.name} flies with a sensor that fails: {facts.sensor_fault}."
    is_one_lost = facts.gps_lost is False and facts.gps_fix is not None and facts.gps_fix < _3D_FIX
    return f"GPS {facts.gps_number} of {facts.name} has no fix. Another one has." if is_one_lost else Not.SO


def vibration(facts: Facts, is_open: bool) -> Finding:
    if not facts.flies or facts.vibration_m_s2 is None:
        return _on_ground(facts)
    limit = VIBRATION_BACK_M_S2 if is_open else MAX_VIBRATION_M_S2
    if facts.vibration_m_s2 >= limit:
        return f"{facts.name} vibrates too much: {facts.vibration_m_s2:.0f} m/s²."
    return Not.SO


def falls(facts: Facts, is_open: bool) -> Finding:
    if facts.silence:
        return Not.KNOWN
    if not facts.falls:
        return Not.SO
    stopped = " Its motors are off." if facts.armed is False else ""
    return f"{facts.name} falls: {facts.falls}.{stopped}"


def motors_stopped(facts: Facts, is_open: bool) -> Finding:
    if facts.silence:
        return Not.KNOWN
    if not facts.motors_stopped:
        return Not.SO
    return f"The motors of {facts.name} stopped in the air, {facts.motors_stopped}."


def sinks_in_hold(facts: Facts, is_open: bool) -> Finding:
    """A hold that is confirmed keeps the height. Its lost action may bring it down."""
    if facts.silence:
        return Not.KNOWN
    hold = facts.hold
    if hold is None or not hold.open or hold.stage is HoldStage.NONE or hold.phase in _COMES_DOWN or not facts.flies:
        return Not.SO
    return f"{facts.name} sinks although it holds: {facts.sinks}." if facts.sinks else Not.SO


def crashed(facts: Facts, is_open: bool) -> Finding:
    if facts.silence:
        return Not.KNOWN
    return f"{facts.name} has crashed: {facts.crashed}." if facts.crashed else Not.SO


def fence_breached(facts: Facts, is_open: bool) -> Finding:
    if not facts.flies or facts.fence_breach is None:
        return _on_ground(facts)
    return f"{facts.name} broke {facts.fence_breach}." if facts.fence_breach else Not.SO


def aircraft_near(facts: Facts, is_open: bool) -> Finding:
    return _aircraft(facts, facts.aircraft_near)


def foreign_drone_near(facts: Facts, is_open: bool) -> Finding:
    return _aircraft(facts, facts.foreign_drone_near)


def zone_breached(facts: Facts, is_open: bool) -> Finding:
    return _zone(facts, facts.zone_breach)


def zone_near(facts: Facts, is_open: bool) -> Finding:
    return _zone(facts, facts.zone_near)


def height_limit(facts: Facts, is_open: bool) -> Finding:
    if facts.height_limit_m is None:
        return Not.KNOWN if facts.silence else Not.SO
    if not facts.flies or facts.height_m is None:
        return _on_ground(facts)
    limit = facts.height_limit_m - HEIGHT_BACK_M if is_open else facts.height_limit_m
    if facts.height_m > limit:
        return f"{facts.name} is at {facts.height_m:.0f} m, above the limit of {facts.height_limit_m:.0f} m."
    return Not.SO


def suspicious_motion(facts: Facts, is_open: bool) -> Finding:
    if facts.silence:
        return Not.KNOWN
    if facts.motion is None:
        return Not.SO
    what = _MOTION.get(facts.motion, "It does not move as a drone can")
    return f"Do not trust the position of {facts.name}. {what}, and others are not warned of it."


def _is_on_bench(facts: Facts) -> bool:
    return facts.armed is False and not facts.airborne


def _aircraft(facts: Facts, words: str) -> Finding:
    if not facts.flies:
        return _on_ground(facts)
    return f"{facts.name}: {words}." if words else Not.SO


def _zone(facts: Facts, words: str) -> Finding:
    if not facts.flies:
        return _on_ground(facts)
    return f"{facts.name} {words}." if words else Not.SO


def _on_ground(facts: Facts) -> Finding:
    """What matters in the air is over on the ground."""
    return Not.SO if not facts.silence and facts.airborne is False else Not.KNOWN


def _battery(facts: Facts, level: str, is_open: bool) -> Finding:
    percent, charge = facts.battery_percent, facts.battery_charge
    if facts.silence or (percent is None and charge is None):
        return Not.KNOWN
    if _battery_level(percent, charge, level if is_open else "") != level:
        return Not.SO
    at = "" if percent is None else f": {percent} %"
    by = " by its autopilot's threshold" if charge is not None and charge >= _LOW else ""
    which = "The battery" if facts.battery_number is None else f"Battery {facts.battery_number}"
    return f"{which} of {facts.name} is {level}{by}{at}."


def _battery_level(percent: int | None, charge: int | None, open_level: str) -> str:
    """The autopilot's own thresholds decide; ours count where it has none. `open_level`: of the alert that is open."""
    if charge is not None and charge >= _LOW:
        return "low" if charge == _LOW else "critical"
    if percent is None:
        return ""
    critical = CRITICAL_PERCENT + (BACK_PERCENT if open_level == "critical" else 0)
    low = LOW_PERCENT + (BACK_PERCENT if open_level == "low" else 0)
    if charge == _OK:
        # A threshold that nobody set never warns: a battery near its end is low whatever the autopilot says.
        return "low" if percent <= CRITICAL_PERCENT + (BACK_PERCENT if open_level == "low" else 0) else ""
    return "critical" if percent <= critical else "low" if percent <= low else ""
