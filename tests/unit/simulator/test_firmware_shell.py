"""The command line of a flight controller: what it answers, and what it does only in SYS_SAFE."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from simulator.cli import FLIGHT_COMMANDS
from simulator.firmware.command_line import app
from simulator.firmware.command_set import MAX_LINE
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.fault_plan import FaultPlan
from simulator.firmware.fault_table import FaultName
from simulator.firmware.shell import _COMMANDS, Shell
from simulator.firmware.states import SystemState


def make_fleet() -> Fleet:
    return Fleet(FleetSettings(dt_s=0.02))


def started() -> Shell:
    shell = Shell(make_fleet(), make_fleet)
    shell.advance(3.0)
    assert shell.state is SystemState.SAFE
    return shell


@pytest.fixture(scope="module")
def flown() -> Shell:
    shell = started()
    assert shell.execute("auto hover") == "hover: SYS_RUN_AUTO"
    shell.advance(9.0)
    return shell


def test_help_names_every_command() -> None:
    words = {line.split()[0] for line in started().execute("help").splitlines()}
    assert words == set(_COMMANDS)
    wanted = "help info top tasks display arm auto manual calibrate reset fault"
    assert set(wanted.split()) <= words


def test_the_start_is_told_state_by_state() -> None:
    shell = Shell(make_fleet(), make_fleet)
    told = " ".join(shell.advance(3.0))
    assert told.index("SYS_STARTUP") < told.index("SYS_SAFE")
    assert "1.50 kg" in shell.execute("info")
    assert "5.0 Hz" in shell.execute("tasks")
    assert "% of a core" in shell.execute("top")


def test_display_shows_once_or_repeatedly() -> None:
    shell = started()
    assert "SYS_SAFE" in shell.execute("display")
    assert not any("roll" in line for line in shell.advance(3.0))
    shell.execute("display 3")
    assert sum("roll" in line for line in shell.advance(5.0)) == 2
    for bad in ("0", "101", "x", "-1", "1.5"):
        assert shell.execute(f"display {bad}").startswith("refused: a number")


def test_it_flies_and_lands(flown: Shell) -> None:
    assert flown.fleet.body.alt_m[0] == pytest.approx(10.0, abs=1.0)
    assert flown.execute("auto square") == "refused: it flies already; auto land first"
    assert flown.execute("stop") == "refused: it is in the air; auto land"


@pytest.mark.parametrize("command", ["arm", "calibrate", "reset"])
def test_some_commands_are_active_in_safe_only(flown: Shell, command: str) -> None:
    assert flown.execute(command).startswith("refused: in SYS_SAFE only")


def test_an_eight_is_flown_and_each_step_can_be_logged() -> None:
    shell, steps = started(), []
    shell.on_step = lambda fleet: steps.append(float(fleet.body.position_m[0, 0]))
    assert shell.execute("auto eight") == "eight: SYS_RUN_AUTO"
    shell.advance(14.0)
    assert len(steps) == 700
    assert max(steps) > 4.0, "north, into the first half of the eight"


def test_a_fault_by_name_is_reported_and_taken_back() -> None:
    shell = started()
    shell.execute("auto hover")
    shell.advance(1.0)
    assert shell.execute("fault gps_loss") == "gps_loss: no position from satellites"
    assert any("GPS lost" in line for line in shell.advance(1.0))
    assert shell.state is SystemState.FAIL_MINOR
    shell.execute("fault gps_loss off")
    shell.advance(5.0)
    assert shell.state is SystemState.RUN_AUTO
    answer = shell.execute("fault nonsense")
    assert all(name in answer for name in FaultName)


def test_a_planned_fault_comes_and_goes_and_comes_again_after_a_reset() -> None:
    shell = Shell(make_fleet(), make_fleet, FaultPlan(["battery_sag@5-6.5", "stuck_baro@9"]))
    for _ in range(2):
        told = shell.advance(3.0)
        shell.execute("arm")
        told += shell.advance(1.9)
        assert not shell.fleet.board.batteries.extra_resistance_ohm[0]
        told += shell.advance(0.6)
        assert shell.fleet.board.batteries.extra_resistance_ohm[0] > 0.0
        told += shell.advance(5.5)
        assert not shell.fleet.board.batteries.extra_resistance_ohm[0]
        assert any("Barometer stuck" in line for line in told)
        assert shell.execute("stop") == "SYS_SAFE"
        assert shell.execute("reset") == "SYS_INIT"
    with pytest.raises(ValueError, match="with NAME one of gps_loss"):
        FaultPlan(["battery_sag@7-6"])


def test_arm_manual_stop_and_reset() -> None:
    shell = started()
    assert shell.execute("arm") == "armed: SYS_RUN_AUTO"
    assert shell.execute("manual") == "SYS_RUN_MANUAL"
    assert shell.execute("stop") == "SYS_SAFE"
    assert shell.execute("reset") == "SYS_INIT"
    assert shell.execute("auto hover").startswith("refused: not ready")


@given(st.text(max_size=300))
@settings(max_examples=examples(20, long=120), deadline=None)
def test_any_line_has_an_answer(line: str) -> None:
    shell = Shell(make_fleet(), make_fleet)
    answer = shell.execute(line)
    words = line.split()
    if len(line) > MAX_LINE or (words and words[0] not in _COMMANDS):
        assert answer.startswith("refused:")


def test_the_program_knows_the_commands_of_the_flight_controller() -> None:
    assert {command.callback.__name__ for command in app.registered_commands if command.callback} == set(
        FLIGHT_COMMANDS
    )
