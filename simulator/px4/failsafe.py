"""PX4's own failsafes: sticks lost, ground station lost, battery, position estimate.

Sticks: silent for COM_RC_LOSS_T, in every mode not excepted by COM_RCL_EXCEPT (default: none), unless they were already
missing at arming. Ground station: no heartbeat of any ground station for COM_DL_LOSS_T. The vehicle holds for
COM_FAIL_ACT_T before it acts. If the loss ends during that hold, so does the failsafe; later, the mode stays.

While its own failsafe has chosen the mode, the heartbeat's state is CRITICAL, and an EVENT has told why; the hold
before it acts also shows AUTO.LOITER. A mode that a pilot commands ends it (measured on 1.16). Sticks that move end a
mode that flies without them (COM_RC_OVERRIDE), whoever sends them.
"""

from __future__ import annotations

from simulator.flight import Flight, OwnFailsafes
from simulator.notices import Severity
from simulator.px4.events import check_report, entered, entered_hold
from simulator.px4.modes import STICK_MODES, Px4Mode
from simulator.px4.sticks import Px4Sticks

NOTHING, HOLD, RETURN, LAND, TERMINATE, DISARM = 0, 1, 2, 3, 5, 6
"""NAV_RCL_ACT and NAV_DLL_ACT."""
_EXCEPT_MISSION, _EXCEPT_AUTO, _EXCEPT_OFFBOARD = 1, 2, 4
_DELAYED = frozenset({RETURN, LAND})
_OVERRIDE_AUTO, _OVERRIDE_OFFBOARD = 1, 2
"""COM_RC_OVERRIDE."""
_AUTO_MODES = frozenset({Px4Mode.TAKEOFF, Px4Mode.LOITER, Px4Mode.MISSION, Px4Mode.RTL, Px4Mode.LAND})
_CHECKS = {
    "Attitude estimate": "check_modes_attitude",
    "Position estimate": "check_modes_global_pos",
    "manual control": "check_modes_manual_control",
}
_OTHER_CHECK = "check_modes_cannot_takeoff"
STICKS_LOST, STATION_LOST, BATTERY_CRITICAL = 1, 2, 4
"""Causes, as its events number them."""
_EVENT_ACTIONS = {HOLD: 5, RETURN: 6, LAND: 7, TERMINATE: 10, DISARM: 9}
"""Numbers of its actions in events."""


class Px4Failsafes(OwnFailsafes):
    def __init__(self) -> None:
        super().__init__()
        self._sticks_optional = True
        """They were missing at arming, so their absence is no loss."""
        self._intended = Px4Mode.LOITER
        self._planned: tuple[int, float, int] | None = None
        """(action, time, cause) of the failsafe that holds before it acts."""
        self._chosen: Px4Mode | None = None
        self._barred_by: str | None = ""

    @property
    def has_chosen(self) -> bool:
        """Whether the present mode is the failsafe's choice."""
        return self._chosen is not None

    def mode_commanded(self) -> None:
        self._planned = self._chosen = None

    def update(self, flight: Flight) -> None:
        lost_sticks = self._sticks_lost(flight)
        lost_station = self._station_lost(flight)
        parameters = flight.parameters
        if self._edge(flight, "radio", lost_sticks, "Manual control"):
            self._begin(flight, parameters.whole("NAV_RCL_ACT"), STICKS_LOST)
        if self._edge(flight, "ground_station", lost_station, "GCS connection"):
            self._begin(flight, parameters.whole("NAV_DLL_ACT"), STATION_LOST)
        self._go_on(flight)
        self._override(flight)
        self._update_battery(flight)
        self._update_position(flight)
        self._leave_unflyable(flight)
        self._report_checks(flight)
        if not flight.armed or flight.mode is not self._chosen:
            self._chosen = None

    def _report_checks(self, flight: Flight) -> None:
        """On each change of what bars arming."""
        reason = flight.why_not_ready()
        if reason == self._barred_by:
            return
        self._barred_by = reason
        name = None if reason is None else next((one for text, one in _CHECKS.items() if text in reason), _OTHER_CHECK)
        for event in check_report(name):
            flight.tell(event)

    def _override(self, flight: Flight) -> None:
        """Sticks that move take over from a mode that needs none."""
        mask, sticks = flight.parameters.whole("COM_RC_OVERRIDE"), flight.sticks
        auto = flight.mode in _AUTO_MODES and mask & _OVERRIDE_AUTO
        offboard = flight.mode is Px4Mode.OFFBOARD and mask & _OVERRIDE_OFFBOARD
        if not flight.armed or not (auto or offboard) or not (isinstance(sticks, Px4Sticks) and sticks.moving):
            return
        flight.notify(Severity.INFO, "Pilot took over using sticks")
        self.mode_commanded()
        if not flight.set_mode(Px4Mode.POSCTL):
            flight.set_mode(Px4Mode.ALTCTL)

    def _sticks_lost(self, flight: Flight) -> bool:
        missing = bool(flight.sticks.silent_for_s(flight.now_s) > 0.0)
        if not missing:
            self._sticks_optional = False
        elif not flight.armed:
            self._sticks_optional = True
        if flight.parameters.whole("COM_RC_IN_MODE") == 4 or self._sticks_optional:
            return False
        mask = flight.parameters.whole("COM_RCL_EXCEPT")
        return missing and not (self.radio is False and _excepted(flight, mask))

    def _station_lost(self, flight: Flight) -> bool:
        seen_s = self.ground_station_seen_s
        if seen_s is None or not flight.parameters.whole("NAV_DLL_ACT") or flight.mode is Px4Mode.LAND:
            return False
        silent = flight.now_s - seen_s > flight.parameters["COM_DL_LOSS_T"]
        return silent and not (
            self.ground_station is False and _excepted(flight, flight.parameters.whole("COM_DLL_EXCEPT"))
        )

    def _edge(self, flight: Flight, flag: str, lost: bool, what: str) -> bool:
        """True when it sets in; if it ends during the hold, the intended mode returns."""
        was = getattr(self, flag)
        setattr(self, flag, lost)
        if was and not lost:
            flight.notify(Severity.INFO, f"{what} regained")
            if self._planned is not None and flight.mode is Px4Mode.LOITER:
                self._planned = self._chosen = None
                flight.set_mode(self._intended)
        return lost and not was and flight.armed

    def _begin(self, flight: Flight, action: int, cause: int) -> None:
        if action == NOTHING:
            return
        if flight.landed:
            flight.notify(Severity.CRITICAL, "Failsafe activated: Disarming")
            flight.disarm()
            return
        wait_s = flight.parameters["COM_FAIL_ACT_T"] if action in _DELAYED else 0.0
        if wait_s > 0.0 and flight.estimator.position_ok:
            self._intended = Px4Mode(flight.mode)
            event = entered_hold(flight.mode, _EVENT_ACTIONS[action], round(wait_s), cause)
            flight.notify(Severity.CRITICAL, f"Failsafe activated: entering Hold for {wait_s:.0f} seconds", event)
            flight.set_mode(Px4Mode.LOITER)
            self._planned, self._chosen = (action, flight.now_s + wait_s, cause), Px4Mode.LOITER
        else:
            self._act(flight, action, cause)

    def _go_on(self, flight: Flight) -> None:
        if self._planned is None:
            return
        action, due_s, cause = self._planned
        if not flight.armed or flight.mode is not Px4Mode.LOITER:
            self._planned = None  # another mode has been selected
        elif flight.now_s >= due_s:
            self._planned = None
            self._act(flight, action, cause)

    def _act(self, flight: Flight, action: int, cause: int) -> None:
        event = entered(flight.mode, _EVENT_ACTIONS.get(action, 0), cause)
        flight.notify(Severity.CRITICAL, "Failsafe activated", event)
        if action in (TERMINATE, DISARM):
            flight.disarm()
            return
        wanted = {HOLD: Px4Mode.LOITER, RETURN: Px4Mode.RTL}.get(action, Px4Mode.LAND)
        if not flight.set_mode(wanted):
            flight.set_mode(Px4Mode.LAND)
        self._chosen = Px4Mode(flight.mode)

    def _update_battery(self, flight: Flight) -> None:
        left, parameters = flight.battery.left, flight.parameters
        act = parameters.whole("COM_LOW_BAT_ACT")
        if not self.battery_low and left < parameters["BAT_LOW_THR"]:
            self.battery_low = True
            flight.notify(Severity.WARNING, "Low battery level")
        if not self.battery_critical and left < parameters["BAT_CRIT_THR"]:
            self.battery_critical = True
            flight.notify(Severity.CRITICAL, "Critical battery level")
            if flight.armed and act in (2, 3):
                self._act(flight, LAND if act == 2 else RETURN, BATTERY_CRITICAL)

    def _update_position(self, flight: Flight) -> None:
        lost = flight.armed and not flight.estimator.position_ok and flight.estimator_was_ready
        if lost and not self.position:
            flight.notify(Severity.CRITICAL, "Position estimate lost")
        self.position = lost
        if not lost or flight.landed or not flight.rules(flight.mode).needs_position:
            return
        flight.set_mode(Px4Mode.ALTCTL if flight.mode is Px4Mode.POSCTL else Px4Mode.LAND)
        self._chosen = Px4Mode(flight.mode)

    def _leave_unflyable(self, flight: Flight) -> None:
        """A stick mode without sticks that no other rule has handled ends in a return."""
        if (
            flight.armed
            and not flight.landed
            and flight.mode in STICK_MODES
            and flight.sticks.silent_for_s(flight.now_s) > 0.0
        ):
            self._act(flight, RETURN, STICKS_LOST)


def _excepted(flight: Flight, mask: int) -> bool:
    if flight.mode is Px4Mode.MISSION:
        return bool(mask & _EXCEPT_MISSION)
    if flight.mode is Px4Mode.OFFBOARD:
        return bool(mask & _EXCEPT_OFFBOARD)
    return flight.mode not in STICK_MODES and bool(mask & _EXCEPT_AUTO)
