"""`tower-sim --commander`: the commander alone arms, reports faults by STATUSTEXT and SYS_STATUS, and ends a flight."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from server.alerts.core.status_texts import StatusText
from server.alerts.core.text_alerts import RULES, TextAlerts
from simulator.airframe_model import AirframeModel
from simulator.arming import FORCE_MAGIC
from simulator.dialect import mavlink
from simulator.failure_modes import Failure, PlannedFailure
from simulator.firmware.fault_table import TABLE, FaultName
from simulator.firmware.health import Health, Sensor, check_init, check_run_auto, check_run_manual, check_startup
from simulator.firmware.states import FLYING, SystemState
from simulator.flight_commander import FlightCommander
from simulator.modes import Mode
from simulator.px4.flavour import PX4
from simulator.px4.modes import Px4Mode
from simulator.reports_health import _CONCERNED
from simulator.squad import parse_fault

Ground = Any
HEARTBEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
ARM, ACCEPTED, FAILED = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED
LONG = pytest.mark.long("a fault that a cheaper model flies too")
CASES = [
    pytest.param(
        model,
        name,
        id=f"{model}-{name}",
        marks=() if model is (AirframeModel.SENSING if TABLE[name].needs_sensors else AirframeModel.EXACT) else LONG,
    )
    for model in AirframeModel
    for name in FaultName
    if model is AirframeModel.SENSING or not TABLE[name].needs_sensors
]
LASTS_S = 5.0
RECOVERS_S = 10.0
SINGLE_BITS = {
    "GPS lost": mavlink.MAV_SYS_STATUS_SENSOR_GPS,
    "Compass inconsistent": mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    "Barometer stuck": mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
    "Battery voltage low": mavlink.MAV_SYS_STATUS_SENSOR_BATTERY,
}


def commander_of(station: Ground) -> FlightCommander:
    found = station.flight.commander
    assert isinstance(found, FlightCommander)
    return found


def listen(station: Ground, seconds: float) -> dict[SystemState, float]:
    """Runs with a heartbeat each second. Returns when each state was first seen, in seconds from now."""
    began_s, seen, beat_s = station.now_s, {}, station.now_s
    while station.now_s < began_s + seconds:
        if station.now_s >= beat_s:
            station.send(HEARTBEAT)
            beat_s += 1.0
        station.run(0.1)
        seen.setdefault(commander_of(station).state, station.now_s - began_s)
    return seen


def hovering(ground: Callable[..., Ground], model: AirframeModel = AirframeModel.EXACT) -> Ground:
    station = ground(model=model, commander=True, boot_s=3.0)
    station.send(HEARTBEAT)
    station.take_off()
    listen(station, 3.0)
    assert commander_of(station).state is SystemState.RUN_AUTO, station.texts()
    station.heard.clear()
    return station


def sys_status(station: Ground) -> Any:
    station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_SYS_STATUS)
    return station.of("SYS_STATUS")[-1]


def alerts_of(station: Ground) -> set[str]:
    """The rules of the tower that the texts raise while the vehicle is armed."""
    alerts = TextAlerts()
    for at_s, message in station.heard:
        if message.get_type() == "STATUSTEXT":
            alerts.take("Alpha", StatusText(message.severity, message.text), at_s)
    return {rule for rule, _ in alerts.found(station.now_s)}


@pytest.mark.parametrize(("model", "name"), CASES)
def test_each_fault_leads_to_its_state_text_and_alert(
    ground: Callable[..., Ground], model: AirframeModel, name: FaultName
) -> None:
    station, row = hovering(ground, model), TABLE[name]
    station.vehicle.plan_failure(PlannedFailure(station.now_s, row.failure, station.now_s + LASTS_S))
    seen = listen(station, LASTS_S - 0.2)
    assert seen.get(row.state, 99.0) <= row.within_s, (seen, station.texts())
    raised = alerts_of(station)
    if row.text and row.failure is not Failure.MAVLINK_MUTE:
        assert row.text in station.texts()
    elif not row.text:
        assert set(seen) == {SystemState.RUN_AUTO}
    if row.rule in RULES:
        assert row.rule in raised
    if name is FaultName.MAVLINK_MUTE:
        assert station.of("HEARTBEAT")[-1:] == [] or station.heard[-1][0] < station.now_s - 3.0
    if row.text in SINGLE_BITS:
        assert not sys_status(station).onboard_control_sensors_health & SINGLE_BITS[row.text]
    if row.state is not SystemState.FAIL_MINOR:
        return
    listen(station, RECOVERS_S)
    assert commander_of(station).state is SystemState.RUN_AUTO, station.texts()
    assert "Recovered" in station.texts()
    assert sys_status(station).onboard_control_sensors_health & SINGLE_BITS.get(row.text, 1)


def test_without_a_commander_nothing_of_it_is_seen(ground: Callable[..., Ground]) -> None:
    station = ground()
    station.take_off()
    assert station.flight.commander is None
    assert not [text for text in station.texts() if text.startswith("SYS_")]
    assert station.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_ACTIVE


def test_not_even_a_forced_arming_goes_past_it(ground: Callable[..., Ground]) -> None:
    assert ground(boot_s=8.0).command(ARM, 1, FORCE_MAGIC) == ACCEPTED
    station = ground(commander=True, boot_s=8.0)
    assert station.command(ARM, 1, FORCE_MAGIC) == FAILED
    assert "Arm: not ready: the start is not finished" in station.texts()
    station.ready()
    assert [text for text in station.texts() if text.startswith("SYS_")] == ["SYS_STARTUP", "SYS_SAFE"]
    assert station.command(ARM, 1, FORCE_MAGIC) == ACCEPTED
    assert commander_of(station).state is SystemState.RUN_MANUAL  # STABILIZE
    assert station.command(ARM, 0) == ACCEPTED
    assert commander_of(station).state is SystemState.SAFE


def test_a_check_of_the_commander_refuses_what_the_autopilot_allows(ground: Callable[..., Ground]) -> None:
    station = ground(commander=True, parameters={"ARMING_CHECK": 0.0})
    station.ready()
    station.set_mode(Mode.GUIDED)
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(0.5)
    assert station.command(ARM, 1) == FAILED
    assert station.texts()[-1] == "Arm: GPS lost"
    station.vehicle.failures.clear()
    station.run(0.5)
    assert station.command(ARM, 1) == ACCEPTED


def test_modes_by_hand_and_without_sticks_are_two_states(ground: Callable[..., Ground]) -> None:
    station = hovering(ground)
    for mode, state in (
        (Mode.LOITER, SystemState.RUN_MANUAL),
        (Mode.BRAKE, SystemState.RUN_AUTO),
        (Mode.ALT_HOLD, SystemState.RUN_MANUAL),
        (Mode.RTL, SystemState.RUN_AUTO),
    ):
        assert station.set_mode(mode) == ACCEPTED
        assert commander_of(station).state is state


def test_a_lost_radio_is_a_fault_of_flight_by_hand(ground: Callable[..., Ground]) -> None:
    station = hovering(ground)
    station.set_mode(Mode.LOITER)
    station.vehicle.parameters.set("FS_THR_ENABLE", 0.0)
    station.vehicle.failures.add(Failure.RADIO_LOST)
    listen(station, 2.0)
    assert commander_of(station).state is SystemState.FAIL_MINOR
    assert "Radio lost" in station.texts()
    station.vehicle.failures.clear()
    listen(station, 2.0)
    assert commander_of(station).state is SystemState.RUN_MANUAL


def test_a_major_fault_lands_refuses_other_modes_and_ends_safe(ground: Callable[..., Ground]) -> None:
    station = hovering(ground)
    station.flight.battery.used_mah = station.flight.battery.capacity_mah * 0.999
    station.until(lambda: commander_of(station).state is SystemState.FAIL_MAJOR)
    station.run(0.1)
    assert station.flight.mode is Mode.LAND
    assert station.set_mode(Mode.GUIDED) == FAILED
    assert "Mode change to GUIDED failed: a major fault: it stops" in "".join(station.texts())
    assert station.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_EMERGENCY
    station.until(lambda: commander_of(station).state is SystemState.SAFE)
    assert not station.flight.armed
    assert station.command(ARM, 1, FORCE_MAGIC) == FAILED


def test_px4_has_the_same_commander(ground: Callable[..., Ground]) -> None:
    station = ground(commander=True, flavour=PX4, boot_s=3.0)
    station.ready()
    assert station.command(ARM, 1) == ACCEPTED
    assert commander_of(station).state is SystemState.RUN_AUTO
    assert station.flight.mode is Px4Mode.LOITER
    assert "SYS_RUN_AUTO" in station.texts()


def test_a_flight_without_faults_is_told_none(ground: Callable[..., Ground]) -> None:
    """Fast and far, by command and by hand: none of it looks like a fault."""
    station = hovering(ground)
    station.command_int(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, 0, x=474_000_000, y=85_500_000, z=40.0, frame=6)
    seen = listen(station, 30.0)
    assert station.from_home_m() > 150.0
    station.set_mode(Mode.LOITER)
    station.sticks = station.override(2000, 1000, 1500, 1500)
    seen |= listen(station, 6.0)
    station.sticks = None
    station.set_mode(Mode.RTL)
    seen |= listen(station, 40.0)
    assert set(seen) == {SystemState.RUN_AUTO, SystemState.RUN_MANUAL}


def test_every_fault_of_a_part_has_its_bit() -> None:
    worst = Health(present=frozenset(), calibrated=frozenset(), radio=False, mavlink_required=True, mavlink_in=False)
    for flag in ("motors", "battery_volts_ok", "compass_believed", "barometer_moving", "vibration_low", "in_place"):
        setattr(worst, flag, False)
    worst.heading_known = False
    worst.battery_flat = True
    faults = {fault.text for check in (check_run_auto, check_run_manual) for fault in check(worst)}
    worst.gps_fix, worst.gps_believed = True, False
    faults |= {fault.text for fault in check_run_auto(worst)}
    assert faults - set(_CONCERNED) == {"MAVLink lost", "Blown away"}
    assert set(_CONCERNED) <= faults
    assert len(check_init(worst)) == len(Sensor) == len(check_startup(worst)) - 1


@pytest.mark.parametrize("name", FaultName)
def test_a_fault_is_planned_by_name(name: FaultName) -> None:
    row = TABLE[name]
    assert parse_fault(f"{name}@30-40", AirframeModel.SENSING) == PlannedFailure(30.0, row.failure, 40.0)
    if row.needs_sensors:
        with pytest.raises(ValueError, match="needs --model sensing"):
            parse_fault(name, AirframeModel.EXACT)
    for wrong in (f"{name}@x", f"{name}@9-8", "gps-lost", ""):
        with pytest.raises(ValueError, match="with NAME one of gps_loss"):
            parse_fault(wrong, AirframeModel.SENSING)


STEPS = st.one_of(
    st.tuples(st.just("arm"), st.sampled_from([0.0, FORCE_MAGIC])),
    st.tuples(st.just("disarm"), st.sampled_from([0.0, FORCE_MAGIC])),
    st.tuples(st.just("mode"), st.sampled_from(list(Mode))),
    st.tuples(st.just("fail"), st.sampled_from([TABLE[n].failure for n in FaultName if not TABLE[n].needs_sensors])),
    st.tuples(st.just("wait"), st.sampled_from([0.1, 0.5, 2.0])),
)


@given(st.lists(STEPS, max_size=15))
@settings(max_examples=examples(15, long=60), deadline=None)
def test_whatever_happens_it_is_armed_exactly_in_the_states_that_fly(steps: list[tuple[str, Any]]) -> None:
    from conftest import Ground as Station

    station = Station(commander=True, boot_s=0.5)
    before = SystemState.INIT
    for verb, value in steps:
        match verb:
            case "arm":
                station.command(ARM, 1, value)
            case "disarm":
                station.command(ARM, 0, value)
            case "mode":
                station.set_mode(value)
            case "fail":
                station.vehicle.failures ^= {value}
            case _:
                station.run(value)
        now = commander_of(station).state
        assert station.flight.armed == (now in FLYING)
        if now in FLYING and before not in FLYING:
            assert verb == "arm"
        before = now
