"""ArduCopter's own failsafes: radio, ground station, battery, position estimate.

Each acts once, when it sets in. When its cause ends, the flag clears and the mode stays.
"""

from __future__ import annotations

from typing import NamedTuple

from simulator.flight import Flight, OwnFailsafes
from simulator.homing import Land
from simulator.modes import Mode
from simulator.notices import Severity
from simulator.parameters import Parameters

CONTINUE_AUTO_ON_RADIO_LOSS = 1
CONTINUE_AUTO_ON_GCS_LOSS = 2
CONTINUE_GUIDED_ON_RADIO_LOSS = 4
CONTINUE_LANDING = 8
CONTINUE_PILOTED_ON_GCS_LOSS = 16
"""FS_OPTIONS."""

POSITION_LOST_S = 1.0
"""The position estimate must be bad, or good, for this long before that failsafe sets in or ends."""
REPORT_ONLY, ALT_HOLD, LAND_EVEN_STABILIZE = 0, 2, 3
"""FS_EKF_ACTION; any other value means LAND in modes that need a position."""


class BatteryLevel(NamedTuple):
    """0 is off."""

    volts: float
    mah: float

    @classmethod
    def of(cls, parameters: Parameters, level: str) -> BatteryLevel:
        return cls(parameters[f"BATT_{level}_VOLT"], parameters[f"BATT_{level}_MAH"])

    def reached(self, voltage_v: float, left_mah: float) -> bool:
        """Returns whether the battery has fallen below this level."""
        return (self.volts > 0 and voltage_v < self.volts) or (self.mah > 0 and left_mah < self.mah)


class Failsafes(OwnFailsafes):
    def __init__(self) -> None:
        super().__init__()
        self._position_turned_s: float | None = None
        """Start of the present contradiction: a position during its failsafe, or no position outside it."""
        self._low_since_s: float | None = None
        self._critical_since_s: float | None = None
        self._levels_version = -1
        self._low = self._critical = BatteryLevel(0.0, 0.0)

    def update(self, flight: Flight) -> None:
        self._update_radio(flight)
        self._update_ground_station(flight)
        self._update_battery(flight)
        self._update_position(flight)

    def _update_radio(self, flight: Flight) -> None:
        parameters, sticks = flight.parameters, flight.sticks
        enabled = parameters.whole("FS_THR_ENABLE")
        silent = sticks.silent_for_s(flight.now_s) > parameters["RC_FS_TIMEOUT"]
        concerns = flight.armed or sticks.ever_heard
        if self.radio and (not silent or not enabled):
            self.radio = False
            flight.notify(Severity.WARNING, "Radio Failsafe Cleared")
        elif not self.radio and enabled and silent and concerns:
            self.radio = True
            self._act_on_radio(flight, enabled)

    def _act_on_radio(self, flight: Flight, enabled: int) -> None:
        options = flight.parameters.whole("FS_OPTIONS")
        if not flight.armed or _may_disarm(flight):
            flight.notify(Severity.WARNING, "Radio Failsafe - Disarming")
            flight.disarm()
        elif flight.flying.disarms_on_landing and options & CONTINUE_LANDING:
            flight.notify(Severity.WARNING, "Radio Failsafe - Continuing Landing")
            _land(flight)
        elif flight.mode is Mode.AUTO and options & CONTINUE_AUTO_ON_RADIO_LOSS:
            flight.notify(Severity.WARNING, "Radio Failsafe - Continuing Auto")
        elif flight.mode is Mode.GUIDED and options & CONTINUE_GUIDED_ON_RADIO_LOSS:
            flight.notify(Severity.WARNING, "Radio Failsafe - Continuing Guided Mode")
        else:
            flight.notify(Severity.WARNING, "Radio Failsafe")
            _leave(flight, {3: Mode.LAND, 7: Mode.BRAKE}.get(enabled, Mode.RTL))

    def _update_ground_station(self, flight: Flight) -> None:
        parameters = flight.parameters
        enabled, seen = parameters.whole("FS_GCS_ENABLE"), self.ground_station_seen_s
        lost = enabled > 0 and seen is not None and flight.now_s - seen > parameters["FS_GCS_TIMEOUT"]
        if self.ground_station and not lost:
            self.ground_station = False
            flight.notify(Severity.WARNING, "GCS Failsafe Cleared")
        elif lost and not self.ground_station:
            self.ground_station = True
            self._act_on_ground_station(flight, enabled)

    def _act_on_ground_station(self, flight: Flight, enabled: int) -> None:
        flight.sticks.clear_overrides()
        options = flight.parameters.whole("FS_OPTIONS")
        if not flight.armed:
            flight.notify(Severity.WARNING, "GCS Failsafe")
            return
        if _may_disarm(flight):
            flight.notify(Severity.WARNING, "GCS Failsafe - Disarming")
            flight.disarm()
            return
        if flight.flying.disarms_on_landing and options & CONTINUE_LANDING:
            flight.notify(Severity.WARNING, "GCS Failsafe - Continuing Landing")
            _land(flight)
        elif flight.mode is Mode.AUTO and options & CONTINUE_AUTO_ON_GCS_LOSS:
            flight.notify(Severity.WARNING, "GCS Failsafe - Continuing Auto Mode")
        elif flight.rules(flight.mode).pilot_controlled and options & CONTINUE_PILOTED_ON_GCS_LOSS:
            flight.notify(Severity.WARNING, "GCS Failsafe - Continuing Pilot Control")
        else:
            flight.notify(Severity.WARNING, "GCS Failsafe")
            _leave(flight, {5: Mode.LAND, 7: Mode.BRAKE}.get(enabled, Mode.RTL))

    def _update_battery(self, flight: Flight) -> None:
        parameters, battery = flight.parameters, flight.battery
        if parameters.version != self._levels_version:
            self._levels_version = parameters.version
            self._low, self._critical = BatteryLevel.of(parameters, "LOW"), BatteryLevel.of(parameters, "CRT")
        wait_s = parameters["BATT_LOW_TIMER"]
        left_mah = battery.capacity_mah - battery.used_mah
        critical, low = (
            self._critical.reached(battery.voltage_v, left_mah),
            self._low.reached(battery.voltage_v, left_mah),
        )
        self._critical_since_s = _since(self._critical_since_s, critical, flight.now_s)
        self._low_since_s = _since(self._low_since_s, low, flight.now_s)
        if not self.battery_critical and _lasted(self._critical_since_s, flight.now_s, wait_s):
            self.battery_critical = True
            self._act_on_battery(flight, "critical", parameters.whole("BATT_FS_CRT_ACT"))
        elif not self.battery_low and _lasted(self._low_since_s, flight.now_s, wait_s):
            self.battery_low = True
            self._act_on_battery(flight, "low", parameters.whole("BATT_FS_LOW_ACT"))

    def _act_on_battery(self, flight: Flight, level: str, action: int) -> None:
        battery = flight.battery
        flight.notify(
            Severity.WARNING,
            f"Battery 1 is {level} {battery.voltage_v:.2f}V used {battery.used_mah:.0f} mAh",
        )
        if not flight.armed or action == 0:
            return
        flight.notify(Severity.WARNING, "Battery Failsafe")
        if _may_disarm(flight):
            flight.disarm()
        elif flight.mode is not Mode.LAND:
            _leave(flight, Mode.LAND if action in (1, 4) else Mode.RTL)

    def _update_position(self, flight: Flight) -> None:
        lost = not flight.estimator.position_ok and flight.estimator_was_ready
        self._position_turned_s = _since(self._position_turned_s, lost is not self.position, flight.now_s)
        if not _lasted(self._position_turned_s, flight.now_s, POSITION_LOST_S):
            return
        self.position = lost
        if not lost:
            flight.notify(Severity.CRITICAL, "EKF Failsafe Cleared")
            return
        flight.notify(Severity.CRITICAL, "EKF variance")
        if flight.armed:
            self._act_on_position(flight, flight.parameters.whole("FS_EKF_ACTION"))

    def _act_on_position(self, flight: Flight, action: int) -> None:
        concerns = flight.rules(flight.mode).needs_position or action == LAND_EVEN_STABILIZE
        if action == REPORT_ONLY or flight.mode is Mode.LAND or not concerns:
            flight.notify(Severity.CRITICAL, "EKF Failsafe")
            return
        if action == ALT_HOLD and not self.radio:
            flight.set_mode(Mode.ALT_HOLD)
        else:
            _land(flight)
        flight.notify(Severity.CRITICAL, f"EKF Failsafe: changed to {flight.mode.name} Mode")


def _since(since_s: float | None, holds: bool, now_s: float) -> float | None:
    if not holds:
        return None
    return now_s if since_s is None else since_s


def _lasted(since_s: float | None, now_s: float, wait_s: float) -> bool:
    return since_s is not None and now_s - since_s >= wait_s


def _may_disarm(flight: Flight) -> bool:
    if flight.rules(flight.mode).manual_throttle and flight.sticks.throttle <= 0.0:
        return True
    return flight.landed


def _leave(flight: Flight, mode: Mode) -> None:
    """Changes to the failsafe's mode; lands if that mode needs a position and there is none."""
    if mode is Mode.LAND or not flight.set_mode(mode):
        _land(flight)


def _land(flight: Flight) -> None:
    """Enters LAND and first waits at this height; a landing in progress continues."""
    landing = flight.behaviour(Mode.LAND)
    if flight.mode is not Mode.LAND and flight.set_mode(Mode.LAND) and isinstance(landing, Land):
        landing.wait_first()
