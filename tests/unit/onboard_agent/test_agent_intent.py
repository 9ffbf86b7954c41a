"""The intent of frames: sticks, centred or not, and commands that need sticks or not; and the gate that uses it."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.autopilot.flight_modes import flies_without_sticks, holds_when_centred
from onboard_agent.autopilot.intent import Command, Intent, Sticks, Target, read_intent
from onboard_agent.sticks.stick_gate import StickGate
from wire.autopilots.px4_multicopter import custom_mode as px4_custom_mode
from wire.dialect import build, mavlink

ARDUPILOT, PX4 = 3, 12
MIDDLES = (1500, 1500, 1500, 1500)


def intent(message: Any, *, kind: int = ARDUPILOT, middles: tuple[int, int, int, int] = MIDDLES) -> Intent | None:
    frame = build(message, system_id=255, component_id=190, sequence=0)
    return read_intent(frame, autopilot_kind=kind, middles_us=middles)


def manual(x: int, y: int, z: int, r: int) -> Any:
    return mavlink.MAVLink_manual_control_message(1, x, y, z, r, 0)


def override(*channels: int) -> Any:
    return mavlink.MAVLink_rc_channels_override_message(1, 1, *channels, *([65535] * (8 - len(channels))))


def command(number: int, *parameters: float) -> Any:
    return mavlink.MAVLink_command_long_message(1, 1, number, 0, *parameters, *([0.0] * (7 - len(parameters))))


@pytest.mark.parametrize(
    ("message", "centred"),
    [
        (manual(0, 0, 500, 0), True),
        (manual(50, -50, 525, 50), True),
        (manual(51, 0, 500, 0), False),
        (manual(0, -51, 500, 0), False),
        (manual(0, 0, 526, 0), False),
        (manual(0, 0, 474, 0), False),
        (manual(0, 0, 500, 51), False),
        (manual(0, 0, 0, 0), False),
        (manual(32767, 32767, 500, 32767), True),
        (manual(0, 0, 32767, 0), False),
        (override(1500, 1500, 1500, 1500), True),
        (override(1525, 1475, 1500, 1500), True),
        (override(1526, 1500, 1500, 1500), False),
        (override(1500, 1500, 1100, 1500), False),
        (override(1500, 1500, 65535, 1500), False),
        (override(1500, 1500, 0, 1500), False),
        (override(0xDCDC, 0xDCDC, 0xDCDC, 0xDCDC), False),
    ],
)
def test_centred_sticks(message: Any, centred: bool) -> None:
    assert intent(message) == Sticks(centred)


def test_the_middle_of_a_channel_is_the_drones_own() -> None:
    middles = (1510, 1490, 1420, 1600)
    assert intent(override(*middles), middles=middles) == Sticks(True)
    assert intent(override(1500, 1500, 1500, 1500), middles=middles) == Sticks(False)


def test_an_override_that_gives_back_or_leaves_alone_is_no_hand() -> None:
    assert intent(override(65535, 65535, 65535, 65535)) is None
    assert intent(override(0, 0, 0, 0)) is None


@pytest.mark.parametrize(
    ("message", "kind", "needs_sticks", "goes_home"),
    [
        (command(176, 1, 6), ARDUPILOT, False, True),
        (command(176, 1, 5), ARDUPILOT, True, False),
        (command(176, 1, 2), ARDUPILOT, True, False),
        (command(176, 1, 99), ARDUPILOT, True, False),
        (command(176, 1, 4, 3), PX4, False, False),
        (command(176, 1, 4, 5), PX4, False, True),
        (command(176, 1, 3, 0), PX4, True, False),
        (command(20), ARDUPILOT, False, True),
        (command(21), ARDUPILOT, False, True),
        (command(22, 0, 0, 0, 0, 0, 0, 10), ARDUPILOT, False, False),
        (mavlink.MAVLink_set_mode_message(1, 1, 9), ARDUPILOT, False, True),
        (mavlink.MAVLink_set_mode_message(1, 1, 0), ARDUPILOT, True, False),
        (mavlink.MAVLink_command_int_message(1, 1, 0, 192, 0, 0, 0, 0, 0, 0, 1, 2, 3.0), ARDUPILOT, False, False),
    ],
)
def test_commands(message: Any, kind: int, needs_sticks: bool, goes_home: bool) -> None:
    assert intent(message, kind=kind) == Command(needs_sticks, getattr(message, "command", None), goes_home)


def test_a_target_is_no_command() -> None:
    message = mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, 0, 0, 0, 0.0, 0, 0, 0, 0, 0, 0, 0, 0)
    assert intent(message) == Target()


@pytest.mark.parametrize(
    "message",
    [
        command(400, 1),
        command(511, 30, 1e5),
        command(176, 1, float("nan")),
        command(176, 1, float("inf")),
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
    ],
)
def test_everything_else_has_no_intent(message: Any) -> None:
    assert intent(message) is None


@given(st.sampled_from([11, 69, 70, 75, 76, 82, 84, 86]), st.binary(max_size=255), st.sampled_from([ARDUPILOT, PX4]))
def test_any_payload_can_be_read(msgid: int, body: bytes, kind: int) -> None:
    frame = bytes([0xFD, len(body), 0, 0, 0, 255, 190, msgid, 0, 0]) + body + b"\0\0"
    assert isinstance(read_intent(frame, autopilot_kind=kind, middles_us=MIDDLES), Sticks | Command | Target | None)


def test_modes_that_fly_without_sticks() -> None:
    assert {mode for mode in range(30) if flies_without_sticks(ARDUPILOT, mode)} == {3, 4, 6, 9, 17, 20, 21, 27}
    assert flies_without_sticks(PX4, px4_custom_mode(4, 3))
    assert not flies_without_sticks(PX4, px4_custom_mode(2, 0))


def test_an_orbit_of_px4_is_shown_as_a_position_mode_and_is_flown_without_sticks() -> None:
    orbit, slow = px4_custom_mode(3, 1), px4_custom_mode(3, 2)
    assert (flies_without_sticks(PX4, orbit), holds_when_centred(PX4, orbit)) == (True, False)
    assert (flies_without_sticks(PX4, slow), holds_when_centred(PX4, slow)) == (False, True)


def test_the_gate_opens_with_centred_sticks_and_stays_open() -> None:
    gate = StickGate()
    assert gate.admit(Sticks(False))
    gate.close()
    assert not gate.admit(Sticks(False))
    assert gate.admit(Sticks(True))
    assert gate.admit(Sticks(False))


def test_the_gate_opens_when_nothing_is_left_to_protect() -> None:
    gate = StickGate()
    gate.close()
    gate.let_go()
    assert gate.admit(Sticks(False))
