"""The PX4 flavour: a test for each rule in which it differs from ArduCopter."""

from __future__ import annotations

import cmath
import math
import struct
from collections.abc import Callable
from typing import Any

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.mission_plan import Item
from simulator.px4.flavour import PX4
from simulator.px4.modes import Px4Mode

ACCEPTED, REJECTED, DENIED = 0, 1, 2
HOME_AMSL_M = 488.0
SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
Make = Callable[..., Any]


def manual(x: int = 0, y: int = 0, z: int = 500, r: int = 0) -> Any:
    return mavlink.MAVLink_manual_control_message(1, x, y, z, r, 0)


def set_mode(ground: Any, mode: Px4Mode) -> int | None:
    answer: int | None = ground.command(SET_MODE, 1, int(mode) >> 16 & 0xFF, int(mode) >> 24)
    return answer


@pytest.fixture
def px4(ground: Make) -> Make:
    """Without a radio by default, receives from any ground station, sticks centred."""

    def make(**options: Any) -> Any:
        options.setdefault("receiver", "none")
        made = ground(flavour=PX4, **options)
        made.sticks = manual()
        return made.ready()

    return make


@pytest.fixture
def flying(px4: Make) -> Make:
    def make(mode: Px4Mode = Px4Mode.POSCTL, **options: Any) -> Any:
        made = px4(**options)
        assert made.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, math.nan, 0, 0, HOME_AMSL_M + 20) == ACCEPTED
        assert made.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
        made.until(lambda: made.flight.mode is Px4Mode.LOITER)
        assert made.body.alt_m == pytest.approx(20, abs=0.3)
        assert set_mode(made, mode) == ACCEPTED
        return made

    return make


def test_the_heartbeat_names_px4_and_packs_the_mode(px4: Make) -> None:
    ground = px4()
    ground.run(1.1)
    beat = ground.of("HEARTBEAT")[-1]
    assert beat.autopilot == mavlink.MAV_AUTOPILOT_PX4
    assert beat.custom_mode == 4 << 16 | 3 << 24


@pytest.mark.parametrize("mode", list(Px4Mode))
def test_each_mode_is_asked_for_by_main_and_sub_number(px4: Make, mode: Px4Mode) -> None:
    ground = px4()
    ground.vehicle.flight.plans.store(0, [_item(), _item()], None)
    assert set_mode(ground, mode) == ACCEPTED
    assert ground.flight.mode is mode


def _item() -> Any:
    return Item(16, x=473977420, y=85455940, z=20.0)


def test_an_unknown_mode_or_a_missing_flag_is_denied(px4: Make) -> None:
    ground = px4()
    assert ground.command(SET_MODE, 1, 9, 0) == DENIED
    assert ground.command(SET_MODE, 0, 2, 0) == DENIED


def test_the_mode_is_told_once_a_second_and_on_request_but_not_at_once(flying: Make) -> None:
    ground = flying()
    count = len(ground.of("HEARTBEAT"))
    ground.until(lambda: len(ground.of("HEARTBEAT")) > count)
    before = len(ground.of("HEARTBEAT"))
    assert set_mode(ground, Px4Mode.ALTCTL) == ACCEPTED
    ground.run(0.3)
    assert len(ground.of("HEARTBEAT")) == before
    assert ground.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 0) == ACCEPTED
    assert ground.of("HEARTBEAT")[-1].custom_mode == Px4Mode.ALTCTL


def test_the_rate_of_the_heartbeat_cannot_be_changed(px4: Make) -> None:
    ground = px4()
    assert ground.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, 50_000) == ACCEPTED
    ground.heard.clear()
    ground.run(5.0)
    assert len(ground.of("HEARTBEAT")) == 5


def test_sticks_of_any_sender_fly(flying: Make) -> None:
    ground = flying()
    ground.sticks = None
    for _ in range(40):
        ground.send(manual(x=1000), sysid=77, compid=3)
        ground.run(0.05)
    assert math.hypot(ground.body.vn_mps, ground.body.ve_mps) > 2.0


def test_an_axis_that_is_not_given_reads_as_centred(flying: Make) -> None:
    ground = flying()
    ground.sticks = manual(x=32767, y=32767, z=32767, r=32767)
    ground.run(2.0)
    assert math.hypot(ground.body.vn_mps, ground.body.ve_mps) < 0.2
    assert ground.body.alt_m == pytest.approx(20, abs=0.3)


def test_a_zero_in_an_override_is_a_value_and_not_a_release(flying: Make) -> None:
    ground = flying(parameters={"COM_RC_IN_MODE": 2})
    ground.sticks = ground.override(1500, 1500, 1500, 1500)
    ground.run(1.0)
    height_m = ground.body.alt_m
    ground.sticks = ground.override(1500, 1500, 0, 1500)
    ground.run(3.0)
    assert ground.body.alt_m < height_m - 2.0


@pytest.mark.parametrize(("mode", "flies"), [(0, False), (1, True), (2, False), (3, False), (4, False)])
def test_com_rc_in_mode_decides_between_the_receiver_and_the_ground_station(px4: Make, mode: int, flies: bool) -> None:
    ground = px4(receiver="low", parameters={"COM_RC_IN_MODE": mode})
    ground.sticks = manual(y=1000)
    ground.run(0.5)
    assert (ground.flight.sticks.roll > 0.9) is flies


def test_in_mode_2_the_ground_station_takes_over_once_the_receiver_is_silent(px4: Make) -> None:
    ground = px4(receiver="low", parameters={"COM_RC_IN_MODE": 2})
    ground.sticks = manual(y=1000)
    ground.vehicle.failures.add(Failure.RADIO_LOST)
    ground.run(1.0)
    assert ground.flight.sticks.roll > 0.9


@pytest.mark.parametrize("mode", [Px4Mode.ALTCTL, Px4Mode.POSCTL, Px4Mode.LOITER])
def test_sticks_lost_hold_for_five_seconds_and_return(flying: Make, mode: Px4Mode) -> None:
    ground = flying(mode)
    ground.sticks = None
    took_s = ground.until(lambda: ground.flight.failsafes.radio)
    assert took_s == pytest.approx(0.5, abs=0.15)
    ground.run(0.05)
    assert ground.flight.mode is Px4Mode.LOITER
    took_s = ground.until(lambda: ground.flight.mode is Px4Mode.RTL)
    assert took_s == pytest.approx(5.0, abs=0.2)


def test_sticks_that_come_back_during_the_hold_get_their_mode_back(flying: Make) -> None:
    ground = flying(Px4Mode.ALTCTL)
    ground.sticks = None
    ground.run(2.0)
    assert ground.flight.mode is Px4Mode.LOITER
    ground.sticks = manual()
    ground.run(0.2)
    assert ground.flight.mode is Px4Mode.ALTCTL


def test_sticks_lost_mean_nothing_in_a_mode_that_is_excepted(flying: Make) -> None:
    ground = flying(Px4Mode.LOITER, parameters={"COM_RCL_EXCEPT": 2})
    ground.sticks = None
    ground.run(8.0)
    assert ground.flight.mode is Px4Mode.LOITER


def test_who_took_off_without_sticks_loses_none(px4: Make) -> None:
    ground = px4()
    ground.sticks = None
    ground.run(1.0)
    assert ground.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HOME_AMSL_M + 10) == ACCEPTED
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
    ground.until(lambda: ground.flight.mode is Px4Mode.LOITER)
    ground.run(8.0)
    assert ground.flight.mode is Px4Mode.LOITER
    assert set_mode(ground, Px4Mode.ALTCTL) == REJECTED


def test_nav_rcl_act_says_what_follows(flying: Make) -> None:
    ground = flying(Px4Mode.POSCTL, parameters={"NAV_RCL_ACT": 3, "COM_FAIL_ACT_T": 0})
    ground.sticks = None
    ground.run(1.0)
    assert ground.flight.mode is Px4Mode.LAND


def _station(ground: Any, seconds: float, sysid: int = 42) -> None:
    for _ in range(round(seconds)):
        ground.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), sysid=sysid)
        ground.run(1.0)


@pytest.mark.parametrize(("action", "mode"), [(0, Px4Mode.LOITER), (2, Px4Mode.RTL), (3, Px4Mode.LAND)])
def test_a_lost_ground_station_is_a_loss_after_ten_seconds_if_asked_for(
    flying: Make, action: int, mode: Px4Mode
) -> None:
    ground = flying(Px4Mode.LOITER, parameters={"NAV_DLL_ACT": action, "COM_FAIL_ACT_T": 0})
    _station(ground, 3)
    ground.run(8.0)
    assert ground.flight.mode is Px4Mode.LOITER
    ground.run(3.0)
    assert ground.flight.mode is mode


def test_heartbeats_of_a_companion_are_no_ground_station(flying: Make) -> None:
    ground = flying(Px4Mode.LOITER, parameters={"NAV_DLL_ACT": 3, "COM_FAIL_ACT_T": 0})
    _station(ground, 2)
    for _ in range(12):
        ground.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), sysid=1)
        ground.run(1.0)
    assert ground.flight.mode is Px4Mode.LAND


def test_integer_parameters_travel_as_bits(px4: Make) -> None:
    ground = px4()
    name = b"COM_RC_IN_MODE"
    ground.send(mavlink.MAVLink_param_request_read_message(1, 1, name, -1))
    ground.run(0.1)
    value = ground.of("PARAM_VALUE")[-1]
    assert (value.param_type, struct.pack("<f", value.param_value)) == (6, struct.pack("<i", 3))
    bits = struct.unpack("<f", struct.pack("<i", 1))[0]
    ground.send(mavlink.MAVLink_param_set_message(1, 1, name, bits, 6))
    ground.run(0.1)
    assert ground.vehicle.parameters["COM_RC_IN_MODE"] == 1
    ground.send(mavlink.MAVLink_param_set_message(1, 1, name, 2.0, 9))
    ground.run(0.1)
    assert ground.vehicle.parameters["COM_RC_IN_MODE"] == 1


def test_a_go_to_takes_heights_above_the_sea(flying: Make) -> None:
    ground = flying(Px4Mode.LOITER)
    place = {"x": 473_980_000, "y": 85_455_940}
    go = mavlink.MAV_CMD_DO_REPOSITION
    assert ground.command_int(go, -1, 1, 0, math.nan, **place, z=HOME_AMSL_M + 30, frame=0) == ACCEPTED
    ground.run(15.0)
    assert ground.body.alt_m == pytest.approx(30, abs=0.5)
    assert ground.body.north_m > 20
    assert ground.command_int(go, -1, 1, 0, math.nan, **place, z=30, frame=6) == DENIED


def test_a_go_to_may_say_which_way_to_look(flying: Make) -> None:
    ground = flying(Px4Mode.LOITER)
    here = {"x": 473_977_420, "y": 85_455_940}
    go = mavlink.MAV_CMD_DO_REPOSITION
    for yaw_rad in (1.5, -1.5):
        assert ground.command_int(go, -1, 1, 0, yaw_rad, **here, z=HOME_AMSL_M + 20, frame=0) == ACCEPTED
        ground.run(15.0)
        assert ground.body.attitude()[2] == pytest.approx(yaw_rad, abs=0.05)


@pytest.mark.parametrize("radius_m", [15.0, -15.0], ids=["clockwise", "counter-clockwise"])
def test_an_orbit_goes_round_a_place_at_a_height_above_the_sea(flying: Make, radius_m: float) -> None:
    ground = flying(Px4Mode.LOITER)
    centre = {"x": round(47.3977e7), "y": round(8.5456e7)}
    orbit = mavlink.MAV_CMD_DO_ORBIT
    assert ground.command_int(orbit, radius_m, 4, 0, math.nan, **centre, z=HOME_AMSL_M + 25, frame=0) == ACCEPTED
    assert ground.flight.mode is Px4Mode.ORBIT
    north_m, east_m = ground.flight.origin.to_local(47.3977, 8.5456)

    def gap() -> complex:
        return complex(ground.body.north_m - north_m, ground.body.east_m - east_m)

    ground.run(20.0)
    assert abs(gap()) == pytest.approx(15, abs=1)
    assert ground.body.alt_m == pytest.approx(25, abs=0.5)
    before = gap()
    ground.run(1.0)
    turned = cmath.phase(gap() / before)
    assert turned == pytest.approx(math.copysign(4 / 15, radius_m), abs=0.08)


def test_nothing_circles_on_the_ground(px4: Make) -> None:
    ground = px4()
    place = {"x": round(47.3977e7), "y": round(8.5456e7)}
    assert ground.command_int(mavlink.MAV_CMD_DO_ORBIT, 15, 4, 0, 0, **place, z=HOME_AMSL_M + 25, frame=0) == DENIED


def test_take_off_with_no_height_given_uses_the_parameter(px4: Make) -> None:
    ground = px4(parameters={"MIS_TAKEOFF_ALT": 6})
    assert ground.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, math.nan, math.nan, math.nan, math.nan) == ACCEPTED
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
    ground.until(lambda: ground.flight.mode is Px4Mode.LOITER)
    assert ground.body.alt_m == pytest.approx(6, abs=0.3)


def test_streams_come_without_being_asked_for(px4: Make) -> None:
    ground = px4()
    ground.heard.clear()
    ground.run(4.0)
    assert len(ground.of("ATTITUDE")) == pytest.approx(60, abs=2)
    for name in ("GLOBAL_POSITION_INT", "SYS_STATUS", "EXTENDED_SYS_STATE", "BATTERY_STATUS", "VFR_HUD"):
        assert ground.of(name), name


@pytest.mark.parametrize("receiver", ["none", "low"])
def test_sys_status_shows_a_receiver_while_sticks_come_that_count(px4: Make, receiver: str) -> None:
    ground = px4(receiver=receiver, parameters={"COM_RC_IN_MODE": 1})
    bit = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
    for sticks, present in ((manual(), True), (None, False)):
        ground.sticks = sticks
        ground.run(2.0)
        status = ground.of("SYS_STATUS")[-1]
        assert bool(status.onboard_control_sensors_present & bit) is present
        assert status.onboard_control_sensors_health & bit


@pytest.mark.parametrize(
    ("receiver", "override", "count"),
    [("none", False, None), ("low", False, 8), ("centred", False, 8), ("none", True, 18)],
)
def test_rc_channels_only_come_while_a_receiver_or_an_override_is_heard(
    px4: Make, receiver: str, override: bool, count: int | None
) -> None:
    ground = px4(receiver=receiver)
    if override:
        ground.sticks = ground.override(1500, 1500, 1500, 1500)
    ground.run(1.0)
    ground.heard.clear()
    ground.run(1.0)
    counts = {message.chancount for message in ground.of("RC_CHANNELS")}
    assert counts == ({count} if count is not None else set())


@pytest.mark.parametrize(("action", "excepted"), [(0, ""), (1, ""), (2, ""), (3, ""), (2, "this"), (2, "the others")])
@pytest.mark.parametrize(("mode", "bit"), [(Px4Mode.MISSION, 1), (Px4Mode.LOITER, 2), (Px4Mode.OFFBOARD, 4)])
def test_what_follows_when_sticks_stop_in_a_mode_that_needs_none(
    flying: Make, mode: Px4Mode, bit: int, action: int, excepted: str
) -> None:
    except_bits = {"": 0, "this": bit, "the others": 7 & ~bit}[excepted]
    parameters = {"COM_RC_IN_MODE": 1, "NAV_RCL_ACT": action, "COM_RCL_EXCEPT": except_bits, "COM_FAIL_ACT_T": 0}
    ground = flying(Px4Mode.LOITER, parameters=parameters)
    place = ground.flight.origin.to_place(400, 0, 0)
    items = [Item(16, x=round(place.lat_deg * 1e7), y=round(place.lon_deg * 1e7), z=20.0)] * 2
    ground.flight.plans.store(0, items, None)
    assert set_mode(ground, mode) == ACCEPTED
    ground.run(1.0)
    ground.sticks = None
    ground.run(2.0)
    follows = {0: mode, 1: Px4Mode.LOITER, 2: Px4Mode.RTL, 3: Px4Mode.LAND}[action]
    assert ground.flight.mode is (mode if bit & except_bits else follows)


def test_who_has_no_receiver_and_sends_no_sticks_can_fly_without_any(px4: Make) -> None:
    ground = px4(parameters={"COM_RC_IN_MODE": 1})
    ground.sticks = None
    ground.run(1.0)
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED


def test_it_disarms_two_seconds_after_a_landing(flying: Make) -> None:
    ground = flying(Px4Mode.LOITER)
    assert ground.command(mavlink.MAV_CMD_NAV_LAND) == ACCEPTED
    ground.until(lambda: not ground.flight.armed)
    assert ground.body.alt_m == pytest.approx(0, abs=0.1)


def test_position_mode_falls_back_to_altitude_when_the_place_is_lost(flying: Make) -> None:
    ground = flying(Px4Mode.POSCTL)
    ground.vehicle.failures.add(Failure.GPS_LOST)
    ground.run(7.0)
    assert ground.flight.mode is Px4Mode.ALTCTL


def test_the_hash_of_all_parameters_is_told_before_the_list_and_stops_it(px4: Make) -> None:
    ground = px4()

    def values(seconds: float) -> list[Any]:
        return [m for m in ground.run(seconds) if m.get_type() == "PARAM_VALUE"]

    ground.send(mavlink.MAVLink_param_request_list_message(1, 1))
    reported = values(0.5)
    first = reported[0]
    assert (first.param_id, first.param_index, first.param_type) == ("_HASH_CHECK", 65535, 5)
    assert [m.param_index for m in reported[1:]] == list(range(first.param_count))
    ground.send(mavlink.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1))
    assert [m.param_value for m in values(0.1)] == [first.param_value]
    ground.vehicle.parameters.set("NAV_DLL_ACT", 3.0)
    ground.send(mavlink.MAVLink_param_request_list_message(1, 1))
    ground.send(mavlink.MAVLink_param_set_message(1, 1, b"_HASH_CHECK", 0.0, 5))
    (other,) = values(0.5)
    assert other.param_value != first.param_value


def test_a_mode_change_is_accepted_by_what_receives_it_and_then_answered(flying: Make) -> None:
    ground = flying()
    ground.sticks = None
    ground.run(1.0)
    ground.heard.clear()
    assert set_mode(ground, Px4Mode.ALTCTL) == REJECTED
    assert [one.result for one in ground.of("COMMAND_ACK")] == [ACCEPTED, REJECTED]


def moved_in_loiter(flying: Make, **options: Any) -> Any:
    ground = flying(Px4Mode.LOITER, **options)
    ground.sticks = manual(z=1000)
    ground.run(0.3)
    return ground


def test_sticks_that_move_take_over_from_a_mode_that_needs_none(flying: Make) -> None:
    ground = moved_in_loiter(flying)
    assert ground.flight.mode is Px4Mode.POSCTL
    assert any("Pilot took over" in one.text for one in ground.of("STATUSTEXT"))


def test_sticks_take_nothing_over_where_they_may_not(flying: Make) -> None:
    assert moved_in_loiter(flying, parameters={"COM_RC_OVERRIDE": 0}).flight.mode is Px4Mode.LOITER


def test_sticks_that_rest_deflected_take_nothing_over(flying: Make) -> None:
    ground = flying()
    ground.sticks = manual(z=1000)
    ground.run(1.0)
    assert set_mode(ground, Px4Mode.LOITER) == ACCEPTED
    ground.run(2.0)
    assert ground.flight.mode is Px4Mode.LOITER
    ground.sticks = manual()
    ground.run(0.1)
    assert ground.flight.mode is Px4Mode.POSCTL, "the jump to the middle is a motion"


def test_while_its_failsafe_has_chosen_the_mode_it_is_critical_and_a_command_ends_that(flying: Make) -> None:
    ground = flying()
    ground.sticks = None
    ground.run(2.0)
    assert (ground.flight.mode, state(ground)) == (Px4Mode.LOITER, mavlink.MAV_STATE_CRITICAL)
    assert set_mode(ground, Px4Mode.LOITER) == ACCEPTED
    assert state(ground) == mavlink.MAV_STATE_ACTIVE
    ground.run(10.0)
    assert ground.flight.mode is Px4Mode.LOITER


def state(ground: Any) -> int:
    assert ground.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 0) == ACCEPTED
    status: int = ground.of("HEARTBEAT")[-1].system_status
    return status
