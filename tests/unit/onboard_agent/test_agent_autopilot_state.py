"""The agent's view of its autopilot: found, lost, rebooted, armed, in the air."""

from typing import Any

import pytest

from onboard_agent.autopilot.autopilot_state import AutopilotEvent, AutopilotView
from wire.control_messages import AutopilotState
from wire.dialect import mavlink


def beat(*, armed: bool = False, mode: int = 5, kind: int = 3, vehicle: int = 2) -> Any:
    return mavlink.MAVLink_heartbeat_message(vehicle, kind, 0x81 if armed else 1, mode, 4, 3)


def position(time_boot_ms: int, alt_rel_m: float = 0.0) -> Any:
    return mavlink.MAVLink_global_position_int_message(time_boot_ms, 0, 0, 0, int(alt_rel_m * 1000), 0, 0, 0, 0)


def found(now: float = 10.0, *, armed: bool = False) -> AutopilotView:
    view = AutopilotView()
    assert view.heartbeat(beat(armed=armed), 1, 1, now) is AutopilotEvent.HEARD
    return view


@pytest.mark.parametrize(
    ("message", "component"),
    [(beat(kind=8), 1), (beat(vehicle=6), 1), (beat(), 154), (beat(), 191)],
    ids=["no autopilot", "a ground station", "a gimbal", "a companion"],
)
def test_other_heartbeats_are_not_the_autopilot(message: Any, component: int) -> None:
    view = AutopilotView()
    assert view.heartbeat(message, 1, component, 0.0) is None
    assert not view.heard
    view = found(armed=True)
    view.heartbeat(message, 1, component, 10.1)
    assert view.armed


def test_another_sysid_is_believed_after_a_long_silence() -> None:
    view = found()
    assert view.heartbeat(beat(), 2, 1, 15.0) is AutopilotEvent.REBOOTED
    assert view.is_autopilot(2, 1)


def test_silence_and_return() -> None:
    view = found()
    assert view.tick(12.9) is None
    assert view.tick(13.0) is AutopilotEvent.LOST
    assert view.tick(13.5) is None
    assert view.heartbeat(beat(), 1, 1, 14.0) is AutopilotEvent.HEARD
    assert view.heartbeat(beat(), 1, 1, 19.0) is AutopilotEvent.REBOOTED


def test_any_frame_of_the_autopilot_keeps_it_heard() -> None:
    view = found()
    view.anything_heard(12.9)
    assert view.tick(13.5) is None


def test_a_clock_that_goes_back_is_a_reboot() -> None:
    view = found()
    assert view.global_position(position(60_000)) is None
    assert view.global_position(position(58_500)) is None, "packets out of order"
    assert view.global_position(position(1_000)) is AutopilotEvent.REBOOTED
    assert view.global_position(position(1_200)) is None


@pytest.mark.parametrize(
    ("armed", "landed_state", "alt_rel_m", "airborne"),
    [
        (False, 2, 50.0, False),
        (True, 1, 50.0, False),
        (True, 2, 0.0, True),
        (True, 3, 0.0, True),
        (True, 4, 0.0, True),
        (True, 0, 1.5, True),
        (True, 0, 0.5, False),
        (True, None, 1.5, True),
        (True, None, 0.5, False),
    ],
)
def test_in_the_air(armed: bool, landed_state: int | None, alt_rel_m: float, airborne: bool) -> None:
    view = found(armed=armed)
    if landed_state is not None:
        view.extended_sys_state(mavlink.MAVLink_extended_sys_state_message(0, landed_state), 10.0)
    view.global_position(position(1, alt_rel_m))
    assert view.airborne(10.5) is airborne


@pytest.mark.parametrize("vehicle", [10, 11, 12], ids=["rover", "boat", "submarine"])
def test_what_never_flies_is_not_in_the_air_on_a_hill(vehicle: int) -> None:
    view = AutopilotView()
    view.heartbeat(beat(armed=True, vehicle=vehicle), 1, 1, 10.0)
    view.global_position(position(1, 130.0))
    assert not view.airborne(10.5)


def test_an_old_landed_state_is_not_believed() -> None:
    view = found(armed=True)
    view.extended_sys_state(mavlink.MAVLink_extended_sys_state_message(0, 1), 10.0)
    view.global_position(position(1, 20.0))
    assert not view.airborne(12.9)
    assert view.airborne(13.1)


def test_the_firmware_is_told_and_forgotten_with_the_autopilot() -> None:
    view = found()
    view.changed(10.0)
    view.autopilot_version(mavlink.MAVLink_autopilot_version_message(0, 0x040602FF, 0, 0, 0, [], [], [], 0, 0, 0))
    told = view.changed(10.1)
    assert told is not None and told.firmware == 0x040602FF
    view.heartbeat(beat(), 1, 1, 20.0)
    told = view.changed(20.0)
    assert told is not None and told.firmware == 0, "after the silence it may be another release"


def test_changes_are_told_once() -> None:
    view = AutopilotView()
    assert view.changed(0.0) == AutopilotState(heard=False, armed=False, airborne=False)
    assert view.changed(0.1) is None
    view.heartbeat(beat(armed=True), 1, 1, 1.0)
    heard = AutopilotState(heard=True, armed=True, airborne=False, system_id=1)
    assert view.changed(1.0) == heard
    view.resend()
    assert view.changed(1.1) == heard
    view.tick(5.0)
    assert view.changed(5.0) == AutopilotState(heard=False, armed=False, airborne=False, system_id=1)
