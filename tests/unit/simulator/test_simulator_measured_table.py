"""One test for each row measured on ArduCopter 4.6.2 (the last table of AUTOPILOTS.md)."""

from __future__ import annotations

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.modes import Mode

ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
TAKE_OFF = mavlink.MAV_CMD_NAV_TAKEOFF
SET_INTERVAL = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL


def test_mode_change_is_acknowledged_first_and_then_told_at_once(ground):
    station = ground().ready()
    for mode in [Mode.LOITER, Mode.ALT_HOLD, Mode.GUIDED, Mode.STABILIZE] * 10:
        station.run(0.037)
        station.send(mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, int(mode), 0, 0, 0, 0, 0))
        heard = [m for m in station.run(0.01) if m.get_type() in ("COMMAND_ACK", "HEARTBEAT")]
        assert [m.get_type() for m in heard][:2] == ["COMMAND_ACK", "HEARTBEAT"]
        assert heard[0].result == ACCEPTED
        assert heard[1].custom_mode == mode


def test_the_same_mode_again_is_accepted_each_time(ground):
    station = ground().ready()
    for _ in range(2):
        assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
    for _ in range(3):
        station.send(mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, 2, 0, 0, 0, 0, 0))
    acks = [m for m in station.run(0.1) if m.get_type() == "COMMAND_ACK"]
    assert [m.result for m in acks] == [ACCEPTED] * 3


def test_without_the_custom_flag_denied_and_an_unknown_mode_failed_with_a_text(ground):
    station = ground().ready()
    assert station.command(SET_MODE, 0, 2) == DENIED
    assert station.command(SET_MODE, 1, 99) == FAILED
    assert "No such mode 99" in station.texts()
    assert station.flight.mode is Mode.STABILIZE


def test_position_modes_are_accepted_without_a_position_while_disarmed(ground):
    station = ground(failures={Failure.NEVER_READY})
    station.run(1)
    assert station.set_mode(Mode.LOITER) == ACCEPTED
    assert station.set_mode(Mode.GUIDED) == ACCEPTED


def test_position_modes_fail_in_the_air_about_six_seconds_after_the_gps_is_lost(ground):
    station = ground().take_off()
    station.sticks = station.override(1500, 1500, 1500, 1500)
    assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(5)
    assert station.set_mode(Mode.LOITER) == ACCEPTED
    assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
    station.run(1.5)
    for mode in (Mode.LOITER, Mode.GUIDED):
        assert station.set_mode(mode) == FAILED
        assert f"Mode change to {mode.name} failed: requires position" in station.texts()
    station.run(1.1)
    assert station.of("HEARTBEAT")[-1].custom_mode == Mode.ALT_HOLD


def test_old_set_mode_has_no_answer_but_the_heartbeat(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_set_mode_message(1, 1, int(Mode.LOITER)))
    heard = station.run(0.1)
    assert [m.get_type() for m in heard] == ["HEARTBEAT"]
    assert heard[0].custom_mode == Mode.LOITER


def test_any_component_and_any_sender_but_not_another_system(ground):
    station = ground().ready()
    assert station.command(SET_MODE, 1, 2, to=(1, 0)) == ACCEPTED
    assert station.command(SET_MODE, 1, 5, to=(1, 100)) == ACCEPTED
    assert station.command(SET_MODE, 1, 0, to=(99, 1)) is None
    assert station.flight.mode is Mode.LOITER
    assert station.command(SET_MODE, 1, 0, sysid=77) == ACCEPTED
    assert station.flight.mode is Mode.STABILIZE


def test_arming_and_disarming_and_take_off_in_the_wrong_mode(ground):
    station = ground(boot_s=5)
    station.run(1)
    assert station.command(ARM, 1) == FAILED
    assert any(text.startswith("Arm: ") for text in station.texts())
    station.until(lambda: station.flight.estimator.position_ok)
    assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
    assert station.command(ARM, 1) == ACCEPTED
    assert station.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, 10) == FAILED
    assert station.command(ARM, 0) == ACCEPTED
    station.take_off()
    assert station.command(ARM, 0) == FAILED
    assert station.flight.armed
    assert station.command(ARM, 0, 21196) == ACCEPTED
    assert not station.flight.armed


def test_overrides_lapse_after_three_seconds_and_alt_hold_flies_into_the_ground(ground):
    station = ground().take_off()
    station.command(SET_INTERVAL, mavlink.MAVLINK_MSG_ID_RC_CHANNELS, 20_000)
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.set_mode(Mode.ALT_HOLD)
    station.run(2)
    station.sticks = None
    last_s = station.now_s
    station.until(lambda: station.of("RC_CHANNELS")[-1].chan3_raw == 1000, 5)
    assert 2.8 <= station.now_s - last_s <= 3.1
    channels = station.of("RC_CHANNELS")[-1]
    assert (channels.chan1_raw, channels.chan2_raw, channels.chan4_raw) == (1500, 1500, 1500)
    station.until(lambda: station.flight.landed, 20)
    assert station.flight.mode is Mode.ALT_HOLD


def test_giving_back_with_zero_brings_the_radio_at_once(ground):
    station = ground().ready()
    station.send(station.override(1600, 1600, 1600, 1600))
    station.run(0.1)
    assert station.flight.sticks.pwm[:4] == [1600, 1600, 1600, 1600]
    station.send(station.override(0, 0, 0, 0))
    station.run(0.1)
    assert station.flight.sticks.pwm[:4] == [1500, 1500, 1000, 1500]


def test_sticks_only_from_the_configured_ground_station(ground):
    station = ground().ready()
    manual = mavlink.MAVLink_manual_control_message(1, 0, 1000, 500, 0, 0)
    for compid in (1, 190, 42):
        station.send(station.override(1700, 1500, 1500, 1500), 255, compid)
        station.run(0.05)
        assert station.flight.sticks.pwm[0] == 1700
        station.send(manual, 255, compid)
        station.run(0.05)
        assert station.flight.sticks.pwm[0] == 2000
    station.send(station.override(0, 0, 0, 0))
    station.run(0.05)
    station.send(station.override(1700, 1500, 1500, 1500), 77)
    station.send(manual, 77)
    heard = station.run(0.1)
    assert station.flight.sticks.pwm[0] == 1500
    assert [m for m in heard if m.get_type() != "HEARTBEAT"] == []


def test_channel_five_changes_the_mode_when_overridden_and_again_when_it_lapses(ground):
    station = ground().ready()
    station.run(0.5)
    station.send(station.override(1500, 1500, 1000, 1500, 1300))
    station.run(0.5)
    assert station.flight.mode is Mode.LAND
    station.run(3.5)
    assert station.flight.mode is Mode.STABILIZE


def test_alt_hold_keeps_its_height_within_centimetres(ground):
    station = ground().take_off()
    station.run(5)
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.set_mode(Mode.ALT_HOLD)
    station.run(2)
    heights = []
    for _ in range(120):
        station.run(0.1)
        heights.append(station.body.alt_m)
    assert min(heights) > 9.9 and max(heights) < 10.1


def test_nothing_requested_nothing_but_heartbeats_texts_and_a_rare_timesync(ground):
    station = ground()
    station.run(21)
    kinds = [m.get_type() for _, m in station.heard]
    assert set(kinds) == {"HEARTBEAT", "STATUSTEXT", "TIMESYNC"}
    assert kinds.count("HEARTBEAT") == 21
    assert kinds.count("TIMESYNC") == 2
    assert station.command(SET_INTERVAL, mavlink.MAVLINK_MSG_ID_ATTITUDE, 100_000) == ACCEPTED
    attitudes = [m for m in station.run(5) if m.get_type() == "ATTITUDE"]
    assert 49 <= len(attitudes) <= 51


def test_losing_the_ground_station_does_nothing_by_default(ground):
    station = ground().take_off()
    station.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    station.run(15)
    assert station.flight.mode is Mode.GUIDED
    assert not station.flight.failsafes.any


def test_boot_takes_as_long_as_it_is_told(ground):
    station = ground(boot_s=42)
    station.set_mode(Mode.GUIDED)
    station.run(41)
    assert station.command(ARM, 1) == FAILED
    station.run(1)
    assert station.command(ARM, 1) == ACCEPTED
