"""The arming checks of PX4, from its EVENT messages. No I/O.

A report is a summary, an event for each check that fails with the flight modes that it bars, and a second summary. PX4
sends one whenever its result changes, on every link, and none without a change. It counts once all of it is there: an
event that was missed comes late. Names and layouts: its sources, 1.16;
checked on it. The words are ours: PX4's own come with its metadata, where it has them.
"""

from struct import Struct
from typing import Final

from wire.autopilots.event_log import KEPT, EventLog, LoggedEvent, ahead, before
from wire.autopilots.px4_events import event_id

_BEGINS: Final = event_id("commander_arming_check_summary")
_ENDS: Final = event_id("commander_health_summary")
_MODES: Final = Struct("<I")
MAX_REASONS: Final = 32

_FENCE: Final = {
    event_id("check_gf_violation_max_alt"): "its maximum height",
    event_id("check_gf_violation_max_hor_dist"): "its maximum distance",
    event_id("check_gf_violation_custom_gf"): "its boundary",
}

_WORDS: Final = {
    "check_modes_global_pos": "it has no global position",
    "check_modes_local_pos": "it has no position",
    "check_modes_local_alt": "it has no height",
    "check_modes_attitude": "it has no attitude",
    "check_modes_angular_velocity": "its gyroscopes give no rates",
    "check_modes_home_position": "home is not set",
    "check_modes_mission": "no mission is on board",
    "check_modes_offboard_signal": "no set-points arrive for this mode",
    "check_modes_manual_control": "no sticks arrive",
    "check_modes_cannot_takeoff": "it does not arm in this mode",
    "check_system_no_home_pos": "home is not set",
    "check_system_no_global_pos": "it has no global position",
    "check_system_safety_button": "the safety button is not pressed",
    "check_system_flight_term_active": "it has ended its flight, and must be restarted",
    "check_system_usb_connected": "a USB cable is plugged in",
    "check_system_arm_auth_failed": "it was not authorized to arm",
    "check_missing_fmu_sdcard": "its memory card is missing",
    "check_hardfault_present": "its memory card holds a crash report",
    "check_armable_configuration": "it is in its safety configuration",
    "check_rc_dl_no_dllink": "it hears no ground station",
    "check_man_control_kill_engaged": "the kill switch is on",
    "check_man_control_rtl_engaged": "the return switch is on",
    "check_man_control_landing_gear_up": "the landing gear switch is up",
    "check_battery_low": "the battery is low",
    "check_battery_critical": "the battery is critically low",
    "check_battery_emergency": "the battery is nearly empty",
    "check_battery_unhealthy": "the battery reports a fault",
    "check_battery_fault": "the battery reports a fault",
    "check_battery_missing": "a battery is missing",
    "check_battery_disconnected": "a battery is disconnected",
    "check_battery_rem_flight_time_low": "the battery lasts only for the way home",
    "check_avionics_power_low": "its supply voltage is too low",
    "check_avionics_power_high": "its supply voltage is too high",
    "check_avionics_power_missing": "its power module is not connected",
    "check_missing_system_power": "its power supply does not report",
    "check_cpuload_too_high": "its processor is overloaded",
    "check_ram_usage_too_high": "its memory is full",
    "check_accel_missing": "an accelerometer is missing",
    "check_accel_no_data": "an accelerometer gives no data",
    "check_accel_not_calibrated": "an accelerometer is not calibrated",
    "check_imu_accel_inconsistent": "its accelerometers disagree",
    "check_gyro_missing": "a gyroscope is missing",
    "check_gyro_no_data": "a gyroscope gives no data",
    "check_gyro_not_calibrated": "a gyroscope is not calibrated",
    "check_imu_gyro_inconsistent": "its gyroscopes disagree",
    "check_mag_missing": "a compass is missing",
    "check_mag_sys_has_mag_missing": "a compass is missing",
    "check_mag_no_data": "a compass gives no data",
    "check_mag_not_calibrated": "a compass is not calibrated",
    "check_mag_consistency": "its compasses disagree",
    "check_mag_fault": "the estimator rejects a compass",
    "check_estimator_mag_interference": "a magnetic field disturbs its compass",
    "check_estimator_mag_fault": "the estimator rejects a compass",
    "check_baro_missing": "a barometer is missing",
    "check_baro_no_data": "a barometer gives no data",
    "check_estimator_missing_data": "its estimator is not ready",
    "check_estimator_heading_not_stable": "its heading is not settled",
    "check_estimator_hor_vel_not_stable": "its speed is not settled",
    "check_estimator_vert_vel_not_stable": "its climb is not settled",
    "check_estimator_hor_pos_not_stable": "its position is not settled",
    "check_estimator_hgt_not_stable": "its height is not settled",
    "check_estimator_low_position_accuracy": "its position is not accurate enough",
    "check_estimator_high_accel_bias": "an accelerometer has drifted: calibrate it",
    "check_estimator_high_gyro_bias": "a gyroscope has drifted: calibrate it",
    "check_estimator_gps_fix_too_low": "the GPS has no 3D fix",
    "check_estimator_gps_num_sats_too_low": "the GPS has too few satellites",
    "check_estimator_gps_pdop_too_high": "the satellites stand unfavourably",
    "check_estimator_gps_hor_pos_err_too_high": "the GPS is not accurate enough",
    "check_estimator_gps_vert_pos_err_too_high": "the GPS is not accurate enough",
    "check_estimator_gps_speed_acc_too_low": "the GPS is not accurate enough",
    "check_estimator_gps_hor_pos_drift_too_high": "the GPS position drifts",
    "check_estimator_gps_vert_pos_drift_too_high": "the GPS position drifts",
    "check_estimator_gps_hor_speed_drift_too_high": "the GPS position drifts",
    "check_estimator_gps_vert_speed_drift_too_high": "the GPS position drifts",
    "check_estimator_gps_generic": "the GPS is not good enough",
    "check_estimator_gps_not_fusing": "the estimator does not use the GPS",
    "check_estimator_gps_jamming_critical": "the GPS is jammed",
    "check_estimator_gps_spoofed": "the GPS signal is forged",
    "check_estimator_gps_spoofing_indicated": "the GPS signal may be forged",
    "check_failure_detector_roll": "it is tipped over",
    "check_failure_detector_pitch": "it is tipped over",
    "check_failure_detector_alt": "it loses height",
    "check_failure_detector_motor": "a motor has failed",
    "check_failure_detector_arm_esc": "a speed controller has failed",
    "check_failure_detector_imbalanced_prop": "a propeller is out of balance",
    "check_escs_offline": "a speed controller does not report",
    "check_escs_fault": "a speed controller reports a fault",
    "check_escs_telem_missing": "the speed controllers do not report",
    "check_gf_no_home": "its fence needs a home",
    "check_gf_violation_max_alt": "it is outside its fence",
    "check_gf_violation_max_hor_dist": "it is outside its fence",
    "check_gf_violation_custom_gf": "it is outside its fence",
    "check_mission_failure": "its mission cannot be flown",
    "check_wind_too_high": "the wind is too strong",
    "check_flight_time_limit": "its flight time is used up",
    "check_parachute_missing": "its parachute does not report",
    "check_parachute_unhealthy": "its parachute is not ready",
    "check_open_drone_id_missing": "its Remote ID does not report",
    "check_open_drone_id_unhealthy": "its Remote ID is not ready",
    "check_distance_sensor_missing": "a distance sensor is missing",
    "check_distance_sensor_invalid": "a distance sensor gives no data",
    "check_optical_sensor_missing": "its optical flow sensor is missing",
    "check_optical_flow_sensor_invalid": "its optical flow sensor gives no data",
}
_BY_NUMBER: Final = {event_id(name): words for name, words in _WORDS.items()}

_NAV_STATES: Final = {
    (1, 0): 0,
    (2, 0): 1,
    (3, 0): 2,
    (3, 1): 21,
    (3, 2): 6,
    (4, 0): 3,
    (4, 2): 17,
    (4, 3): 4,
    (4, 4): 3,
    (4, 5): 5,
    (4, 6): 18,
    (5, 0): 10,
    (6, 0): 14,
    (7, 0): 15,
}
"""(main, sub) of a flight mode to its bit in what a check bars."""


class Px4Checks:
    """Feed it EVENT frames; read `reasons` and `fence_breach`. Each is of the last whole report."""

    def __init__(self) -> None:
        self._failed: dict[int, int] = {}
        """Event to the modes that it bars."""
        self._events = EventLog()
        self._end: int | None = None
        """The sequence with which the last whole report ended; None: there was none."""

    def take(self, frame: bytes) -> bool:
        """Takes an EVENT frame, of whatever it tells. Whether it is new."""
        if not self._events.take(frame):
            return False
        newest = self._events.newest
        assert newest is not None
        if self._end is not None and self._end not in self._events and ahead(self._end, newest) > -KEPT:
            self._end = None  # the autopilot counts anew
        for count in range(KEPT):
            end = before(newest, count)
            if end == self._end:
                break
            event = self._events.get(end)
            report = self._report_before(end) if event is not None and event.number == _ENDS else None
            if report is not None:
                failing = ((one.number, _MODES.unpack_from(one.arguments)[0]) for one in reversed(report))
                self._failed = dict([one for one in failing if one[0] in _BY_NUMBER][:MAX_REASONS])
                self._end = end
                break
        return True

    def _report_before(self, end: int) -> list[LoggedEvent] | None:
        """The events of the report that ends there, newest first; None: one of them is missing."""
        found: list[LoggedEvent] = []
        for count in range(1, KEPT):
            event = self._events.get(before(end, count))
            if event is None or event.number == _ENDS:
                return None
            if event.number == _BEGINS:
                return found
            found.append(event)
        return None

    def reasons(self, custom_mode: int) -> tuple[str, ...]:
        """Why it does not arm in this flight mode."""
        bit = _NAV_STATES.get((custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF))
        if bit is None:
            return ()
        words = (_BY_NUMBER[number] for number, modes in self._failed.items() if modes >> bit & 1)
        return tuple(dict.fromkeys(words))

    @property
    def fence_breach(self) -> str | None:
        """Which limit of its fence is broken; empty: none; None: not known."""
        if self._end is None:
            return None
        return next((words for number, words in _FENCE.items() if number in self._failed), "")
