"""Facts measured on ArduCopter: flight without GPS, and reports."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from measured_facts import ACCEPTED, CENTRED, FAILED, Make, centre, fact_table, in_mode, mode_after, stop_sticks

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.modes import Mode
from simulator.parameters import Parameters

RECEIVER = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER


FACTS, fact = fact_table()


def asked(station: Any, message_id: int, name: str) -> Any:
    assert station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message_id) == ACCEPTED
    return station.of(name)[-1]


def receiver_bits(station: Any) -> tuple[bool, bool, bool]:
    """Returns present, enabled, healthy."""
    status = asked(station, 1, "SYS_STATUS")
    return (
        bool(status.onboard_control_sensors_present & RECEIVER),
        bool(status.onboard_control_sensors_enabled & RECEIVER),
        bool(status.onboard_control_sensors_health & RECEIVER),
    )


def channel_count(station: Any) -> int:
    return int(asked(station, 65, "RC_CHANNELS").chancount)


def ekf_flags(station: Any) -> int:
    return int(asked(station, 193, "EKF_STATUS_REPORT").flags)


# GPS.


@fact("GPS lost, armed: LOITER, GUIDED and BRAKE still accepted for about 6 s, then requires position, and so is RTL")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(5)
    for mode in (Mode.LOITER, Mode.GUIDED, Mode.BRAKE, Mode.ALT_HOLD):
        assert station.set_mode(mode) == ACCEPTED
    station.run(1)
    for mode in (Mode.LOITER, Mode.GUIDED, Mode.BRAKE, Mode.RTL):
        assert station.set_mode(mode) == FAILED
        assert station.texts()[-1] == f"Mode change to {mode.name} failed: requires position"


@fact("GPS lost in a mode that needs a position: EKF failsafe LAND 1 s after it is gone, 4 s at the same height first")
def _(ground: Make) -> None:
    for mode in (Mode.GUIDED, Mode.BRAKE, Mode.LOITER):
        station = in_mode(ground, mode)
        station.vehicle.failures.add(Failure.GPS_LOST)
        assert station.until(lambda s=station: s.flight.mode is Mode.LAND, 12) == pytest.approx(7.0, abs=0.2)
        assert "EKF variance" in station.texts()
        assert "EKF Failsafe: changed to LAND Mode" in station.texts()
        station.run(3.8)
        assert station.body.alt_m == pytest.approx(20, abs=0.2)
        station.run(4)
        assert station.body.alt_m < 19


@fact("GPS lost in ALT_HOLD: EKF Failsafe, and the mode stays")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.vehicle.failures.add(Failure.GPS_LOST)
    assert mode_after(station, 15) is Mode.ALT_HOLD
    assert "EKF Failsafe" in station.texts()
    station.vehicle.failures.discard(Failure.GPS_LOST)
    station.run(1.5)
    assert "EKF Failsafe Cleared" in station.texts()


@fact("GPS lost in a hold without a radio: RTL refused, LAND when the sticks stop")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD, receiver="none")
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(8)
    assert station.set_mode(Mode.RTL) == FAILED
    stop_sticks(station)
    assert mode_after(station, 1.5) is Mode.LAND
    assert "Mode change to RTL failed: requires position" in station.texts()


@fact("EKF_STATUS_REPORT: 167 before the first position, 831 with it, 37 after a loss and 167 again 8 s later")
def _(ground: Make) -> None:
    station = ground(boot_s=10)
    station.run(5)
    assert ekf_flags(station) == 167
    station.ready()
    assert ekf_flags(station) == 831
    station.take_off()
    station.set_mode(Mode.ALT_HOLD)
    centre(station)
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(5)
    assert ekf_flags(station) == 831
    station.run(2)
    assert ekf_flags(station) == 37
    station.run(8)
    assert ekf_flags(station) == 167
    station.vehicle.failures.discard(Failure.GPS_LOST)
    station.run(0.1)
    assert ekf_flags(station) == 831


# Reports.


@fact("no radio, no sticks yet: SYS_STATUS without a receiver, RC_CHANNELS with chancount 0 and zeros")
def _(ground: Make) -> None:
    station = ground(receiver="none").ready()
    assert receiver_bits(station) == (False, False, False)
    assert channel_count(station) == 0
    assert station.of("RC_CHANNELS")[-1].chan1_raw == 0


@fact("no radio, sticks come: a receiver is present, enabled and healthy, but chancount stays 0")
def _(ground: Make) -> None:
    station = ground(receiver="none").ready()
    centre(station)
    station.run(1)
    assert receiver_bits(station) == (True, True, True)
    assert channel_count(station) == 0
    assert station.of("RC_CHANNELS")[-1].chan3_raw == 1500
    stop_sticks(station)
    station.run(2)
    assert receiver_bits(station) == (True, True, False)
    assert station.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_CRITICAL


@fact("no radio, FS_THR_ENABLE 0, sticks have stopped: the receiver is healthy all the same")
def _(ground: Make) -> None:
    station = ground(receiver="none", parameters={"FS_THR_ENABLE": 0}).ready()
    centre(station)
    station.run(1)
    stop_sticks(station)
    station.run(10)
    assert receiver_bits(station) == (True, True, True)
    assert channel_count(station) == 0


@fact("a receiver: present, enabled, healthy, chancount 8; its transmitter lost: not healthy, chancount 8")
def _(ground: Make) -> None:
    station = ground().ready()
    assert receiver_bits(station) == (True, True, True)
    assert channel_count(station) == 8
    station.vehicle.failures.add(Failure.RADIO_LOST)
    station.run(1.5)
    assert receiver_bits(station) == (True, True, False)
    assert channel_count(station) == 8
    assert station.of("RC_CHANNELS")[-1].chan3_raw == 1000


@fact("battery_remaining falls with use")
def _(ground: Make) -> None:
    station = ground(battery_mah=1000).take_off()
    before = asked(station, 1, "SYS_STATUS").battery_remaining
    station.run(30)
    assert 8 <= before - asked(station, 1, "SYS_STATUS").battery_remaining <= 20


@fact("set home here in the air: heights over home jump, and are negative after landing")
def _(ground: Make) -> None:
    station = ground().take_off(25)
    assert asked(station, 33, "GLOBAL_POSITION_INT").relative_alt == pytest.approx(25_000, abs=200)
    assert station.command(mavlink.MAV_CMD_DO_SET_HOME, 1) == ACCEPTED
    assert asked(station, 33, "GLOBAL_POSITION_INT").relative_alt == pytest.approx(0, abs=100)
    station.set_mode(Mode.LAND)
    station.until(lambda: not station.flight.armed, 90)
    assert asked(station, 33, "GLOBAL_POSITION_INT").relative_alt == pytest.approx(-25_000, abs=200)


@fact("channel 5 overridden, or its override lapsing, changes the mode by itself, in the air too")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.sticks = station.override(*CENTRED, 1300)
    station.run(0.5)
    assert station.flight.mode is Mode.LAND
    centre(station)
    assert mode_after(station, 4) is Mode.STABILIZE


@fact("a board may refuse a mission of a size that its documents allow")
def _(ground: Make) -> None:
    station = ground(failures={Failure.MISSION_FULL}).ready()
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 724, 0))
    station.run(0.5)
    assert station.of("MISSION_ACK")[-1].type == mavlink.MAV_MISSION_NO_SPACE


@fact("parameters: about 1,391")
def _(_ground: Make) -> None:
    assert abs(sum(1 for _ in Parameters()) - 1391) < 10


@fact("a mode may be acknowledged and come late: mode-change-slow")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.vehicle.failures.add(Failure.MODE_CHANGE_SLOW)
    assert station.set_mode(Mode.BRAKE) == ACCEPTED
    assert mode_after(station, 1.0) is Mode.ALT_HOLD
    assert mode_after(station, 0.6) is Mode.BRAKE


@pytest.mark.parametrize("check", FACTS)
def test_it_does_what_was_measured(check: Callable[[Make], None], ground: Make) -> None:
    check(ground)
