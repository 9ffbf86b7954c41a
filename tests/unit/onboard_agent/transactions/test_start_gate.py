"""Every message that would start the mission, on each kind of vehicle, and nothing else."""

from typing import Any

import pytest

from onboard_agent.autopilot.mode_names import mode_name
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.start_gate import SAY_EVERY_S, StartGate, starts_mission
from wire.dialect import build, decode, mavlink

COPTER, PLANE, ROVER, SUB = 2, 1, 10, 12
ARDUPILOT, PX4 = 3, 12


def mode(main: float, sub: float = 0, base: float = 1) -> Any:
    return mavlink.MAVLink_command_long_message(1, 1, 176, 0, base, main, sub, 0, 0, 0, 0)


def command(number: int, *params: float) -> Any:
    return mavlink.MAVLink_command_long_message(1, 1, number, 0, *[*params, *[0.0] * 7][:7])


def starts(message: Any, kind: int, vehicle: int, custom_mode: int = 0) -> bool:
    frame = build(message, system_id=255, component_id=190, sequence=0)
    return starts_mission(frame, autopilot_kind=kind, vehicle_type=vehicle, custom_mode=custom_mode)


@pytest.mark.parametrize(
    ("kind", "vehicle", "message", "expected"),
    [
        (ARDUPILOT, COPTER, mode(3), True),
        (ARDUPILOT, COPTER, mode(10), False),
        (ARDUPILOT, PLANE, mode(10), True),
        (ARDUPILOT, PLANE, mode(3), False),
        (ARDUPILOT, ROVER, mode(10), True),
        (ARDUPILOT, SUB, mode(3), True),
        (ARDUPILOT, COPTER, mode(3, base=0), False),
        (ARDUPILOT, COPTER, mode(0, base=mavlink.MAV_MODE_AUTO_ARMED), True),
        (ARDUPILOT, COPTER, mode(float("inf")), False),
        (PX4, COPTER, mode(4, 4), True),
        (PX4, COPTER, mode(4, 0), True),
        (PX4, COPTER, mode(4, 3), False),
        (PX4, COPTER, mode(3), False),
        (PX4, COPTER, mavlink.MAVLink_set_mode_message(1, 1, 4 << 16 | 4 << 24), True),
        (PX4, COPTER, mavlink.MAVLink_set_mode_message(1, 1, 4 << 16 | 3 << 24), False),
        (ARDUPILOT, COPTER, mavlink.MAVLink_set_mode_message(1, 92, 0), True),
        (ARDUPILOT, COPTER, mavlink.MAVLink_command_int_message(1, 1, 3, 224, 0, 0, 1, 0, 0, 0, 0, 0, 0), True),
        (ARDUPILOT, COPTER, mavlink.MAVLink_command_long_message(1, 1, 189, 0, 0, 0, 0, 0, 0, 0, 0), True),
        (ARDUPILOT, COPTER, mavlink.MAVLink_command_long_message(1, 1, 16, 0, 0, 0, 0, 0, 0, 0, 0), False),
        (ARDUPILOT, COPTER, command(218, 16, 2), True),  # the switch for AUTO
        (ARDUPILOT, COPTER, command(218, 55, 2), False),
        (PX4, COPTER, command(252, 1), True),
        (PX4, COPTER, command(252, 0), False),
        (PX4, COPTER, command(262, 6), True),
        (PX4, COPTER, command(262, 5), False),
        (PX4, COPTER, command(262, float("nan")), False),
    ],
)
def test_ways_to_start(kind: int, vehicle: int, message: Any, expected: bool) -> None:
    assert starts(message, kind, vehicle) is expected


def test_arming_starts_it_where_the_mode_is_the_missions_already() -> None:
    arm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0)
    disarm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 0, 0, 0, 0, 0, 0, 0)
    assert [starts(arm, ARDUPILOT, COPTER, custom) for custom in (3, 4, 27)] == [True, False, True]
    assert not starts(disarm, ARDUPILOT, COPTER, 3)
    switch = command(218, 153, 2)
    assert [starts(switch, ARDUPILOT, COPTER, custom) for custom in (3, 4, 27)] == [True, False, True]


@pytest.mark.parametrize("length", [20, 50, 57, 100])
def test_the_reason_comes_whole_and_once_a_second_the_denial_each_time(length: int) -> None:
    gate = StartGate(FrameMaker())
    frame = build(mode(3), system_id=255, component_id=190, sequence=0)
    why = "x" * length
    said = [decode(one) for one in gate.answers(frame, why, 5.0, vehicle_system_id=9)]
    ack, *texts = said
    assert (ack.command, ack.result, ack.target_system, ack.target_component) == (176, 2, 255, 190)
    assert (ack.get_srcSystem(), ack.get_srcComponent()) == (9, 1)
    assert "".join(text.text for text in texts) == why
    assert [text.chunk_seq for text in texts] == list(range(len(texts)))
    assert len(texts[-1].text) < 50 and len({text.id for text in texts}) == 1 and texts[0].id
    assert [decode(one).get_type() for one in gate.answers(frame, why, 5.5, vehicle_system_id=9)] == ["COMMAND_ACK"]
    assert len(gate.answers(frame, why, 5.0 + SAY_EVERY_S, vehicle_system_id=9)) == len(said)


def test_modes_have_names() -> None:
    assert [mode_name(ARDUPILOT, COPTER, number) for number in (3, 17, 99)] == ["AUTO", "BRAKE", "mode 99"]
    assert (mode_name(ARDUPILOT, PLANE, 10), mode_name(PX4, COPTER, 4 << 16 | 5 << 24)) == ("AUTO", "AUTO.RTL")
