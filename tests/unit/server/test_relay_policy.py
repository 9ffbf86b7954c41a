"""Permissions of a frame: the table, row by row."""

import math
from dataclasses import replace
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.control.core.policy import (
    ASK_AGAIN_WITHIN_S,
    Authorization,
    Kind,
    RepeatConfirmation,
    command_in,
    ends_the_flight,
    kind_of,
    refusal_of,
)
from wire.dialect import build, mavlink
from wire.drops import DropReason

HOLDER = Authorization(has_turn=True, armed=True, airborne=True, loss_check_open=False)
WATCHER = Authorization(has_turn=False, armed=True, airborne=True, loss_check_open=False)
ON_GROUND = Authorization(has_turn=True, armed=False, airborne=False, loss_check_open=True)

M = mavlink


def frame(message: object) -> bytes:
    return build(message, system_id=255, component_id=190, sequence=0)


def command(number: int, param1: float = 0.0, param2: float = 0.0, confirmation: int = 0) -> bytes:
    return frame(M.MAVLink_command_long_message(1, 1, number, confirmation, param1, param2, 0, 0, 0, 0, 0))


READING = {
    "param list": frame(M.MAVLink_param_request_list_message(1, 1)),
    "param read": frame(M.MAVLink_param_request_read_message(1, 1, b"X", -1)),
    "mission list": frame(M.MAVLink_mission_request_list_message(1, 1)),
    "timesync": frame(M.MAVLink_timesync_message(0, 1)),
    "request message": command(M.MAV_CMD_REQUEST_MESSAGE, 148),
}
FLYING = {
    "sticks": frame(M.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0)),
    "overrides": frame(M.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8)),
    "arm": command(M.MAV_CMD_COMPONENT_ARM_DISARM, 1),
    "mode": command(M.MAV_CMD_DO_SET_MODE, 1, 4),
    "old mode": frame(M.MAVLink_set_mode_message(1, 1, 4)),
    "set param": frame(M.MAVLink_param_set_message(1, 1, b"X", 1.0, 9)),
    "mission count": frame(M.MAVLink_mission_count_message(1, 1, 3)),
    "mission clear": frame(M.MAVLink_mission_clear_all_message(1, 1)),
    "interval": command(M.MAV_CMD_SET_MESSAGE_INTERVAL, 30, 1000),
    "heartbeat": frame(M.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)),
    "unknown": b"\xfd\x03\x00\x00\x07\x01\x01\xf0\xff\x7f" + b"abc" + b"\x12\x34",
}
NEVER = {
    "signing key": frame(M.MAVLink_setup_signing_message(1, 1, [0] * 32, 0)),
    "operator control, new": command(32100, 1),
    "operator control": frame(M.MAVLink_change_operator_control_message(1, 0, 0, b"x")),
}


@pytest.mark.parametrize(("name", "standing"), list(product(READING, (HOLDER, WATCHER))))
def test_reading_is_for_whoever_may_watch(name: str, standing: Authorization) -> None:
    assert refusal_of(READING[name], command_in(READING[name]), standing) is None


@pytest.mark.parametrize("name", list(FLYING))
def test_everything_else_is_the_holders(name: str) -> None:
    assert refusal_of(FLYING[name], command_in(FLYING[name]), HOLDER) is None
    assert refusal_of(FLYING[name], command_in(FLYING[name]), WATCHER) is DropReason.NOT_IN_CONTROL


@pytest.mark.parametrize(("name", "standing"), list(product(NEVER, (HOLDER, WATCHER))))
def test_some_things_are_nobodys(name: str, standing: Authorization) -> None:
    assert refusal_of(NEVER[name], command_in(NEVER[name]), standing) is DropReason.NOT_ALLOWED


def test_arming_waits_for_the_loss_check_and_only_arming() -> None:
    arm, disarm = FLYING["arm"], command(M.MAV_CMD_COMPONENT_ARM_DISARM, 0)
    assert refusal_of(arm, command_in(arm), ON_GROUND) is DropReason.LOSS_CHECK
    assert refusal_of(disarm, command_in(disarm), ON_GROUND) is None
    assert refusal_of(FLYING["mode"], command_in(FLYING["mode"]), ON_GROUND) is None


@pytest.mark.parametrize(
    "frame_",
    [
        command(M.MAV_CMD_COMPONENT_ARM_DISARM, math.nan),
        command(M.MAV_CMD_MISSION_START),
        command(M.MAV_CMD_DO_LAND_START),
        command(M.MAV_CMD_SOLO_BTN_FLY_HOLD),
        command(M.MAV_CMD_DO_AUX_FUNCTION, 153, 2),
    ],
)
def test_what_arms_besides_waits_for_the_loss_check_too(frame_: bytes) -> None:
    assert refusal_of(frame_, command_in(frame_), ON_GROUND) is DropReason.LOSS_CHECK
    assert refusal_of(frame_, command_in(frame_), HOLDER) is None
    unknown = replace(ON_GROUND, armed=None, airborne=None)
    assert refusal_of(frame_, command_in(frame_), unknown) is DropReason.LOSS_CHECK


@pytest.mark.parametrize(
    ("frame_", "airborne", "falls"),
    [
        (command(M.MAV_CMD_COMPONENT_ARM_DISARM, 0), True, True),
        (command(M.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196), True, True),
        (command(M.MAV_CMD_COMPONENT_ARM_DISARM, 0), None, True),
        (command(M.MAV_CMD_COMPONENT_ARM_DISARM, 0), False, False),
        (command(M.MAV_CMD_COMPONENT_ARM_DISARM, 1), True, False),
        (command(M.MAV_CMD_DO_FLIGHTTERMINATION, 1), False, True),
        (command(M.MAV_CMD_DO_FLIGHTTERMINATION, 0), True, False),
        (command(M.MAV_CMD_COMPONENT_ARM_DISARM, math.nan), True, True),
        (command(M.MAV_CMD_DO_FLIGHTTERMINATION, math.nan), False, True),
        (command(M.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1), True, True),
        (command(M.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1), None, True),
        (command(M.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1), False, False),
        (command(M.MAV_CMD_DO_AUX_FUNCTION, 31, 2), True, True),
        (command(M.MAV_CMD_DO_AUX_FUNCTION, 165, 0), True, True),
        (command(M.MAV_CMD_DO_AUX_FUNCTION, 9, 2), True, False),
        (command(M.MAV_CMD_NAV_LAND), True, False),
    ],
)
def test_what_makes_a_drone_fall(frame_: bytes, airborne: bool | None, falls: bool) -> None:
    seen = command_in(frame_)
    assert seen is not None
    standing = Authorization(has_turn=True, armed=True, airborne=airborne, loss_check_open=False)
    assert ends_the_flight(seen, standing) is falls


def test_asking_twice_is_asking_anew_and_not_repeating() -> None:
    first = command_in(command(M.MAV_CMD_COMPONENT_ARM_DISARM, 0))
    repeat = command_in(command(M.MAV_CMD_COMPONENT_ARM_DISARM, 0, confirmation=1))
    assert first is not None
    assert repeat is not None
    asked = RepeatConfirmation()
    assert not asked.confirms(1, first, 0.0)
    assert not asked.confirms(1, repeat, 0.5)
    assert not asked.confirms(2, first, 0.6), "another drone"
    assert asked.confirms(2, first, 1.0)
    assert not asked.confirms(1, first, 2.0)
    assert not asked.confirms(1, first, 2.1 + ASK_AGAIN_WITHIN_S), "too late counts as the first time"
    assert asked.confirms(1, first, 3.0 + ASK_AGAIN_WITHIN_S)


def test_kinds() -> None:
    assert kind_of(FLYING["sticks"]) is Kind.STICKS
    assert kind_of(FLYING["overrides"]) is Kind.STICKS
    assert kind_of(FLYING["mode"]) is Kind.COMMAND
    assert kind_of(READING["timesync"]) is Kind.OTHER


@given(st.floats(), st.floats(), st.integers(0, 65535), st.integers(0, 255))
def test_any_command_gets_a_decision(param1: float, param2: float, number: int, confirmation: int) -> None:
    param1, param2 = (value if abs(value) < 3e38 else math.inf for value in (param1, param2))
    made = command(number, param1, param2, confirmation)
    seen = command_in(made)
    assert seen is not None
    assert seen.command == number
    expected = {32100: (DropReason.NOT_ALLOWED,)}.get(number, (None, DropReason.NOT_IN_CONTROL))
    assert refusal_of(made, seen, WATCHER) in expected
    ends_the_flight(seen, HOLDER)
