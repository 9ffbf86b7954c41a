"""Lost pilots on a real ArduCopter, through a real tower and real agents: the core of `bench control --autopilot`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

import pytest

from bench.control_flown import flights_of, fly_table
from bench.rows import Report

CORE = (
    "take+hover+low",
    "browser gone+full forward+none",
    "tab silent+full descent+centred",
    "give and accept+hover+none",
    "release+full climb+low",
    "agent restarted+AUTO+centred",
    "agent killed+hover+low",
    "take+near the ground+centred",
    "browser gone+RTL+low",
)
TOWER_KILLED = ("tower killed+hover+low", "tower killed+AUTO+none", "tower killed+full forward+centred")


def options(program: Path, *cases: str, **more: object) -> Namespace:
    usual = {"n": 1, "drones": 5, "set_up": False, "lost_action": "return", "rounds": 3, "autopilot": program}
    return Namespace(**{**usual, "cases": ",".join(cases), **more})


async def flown(tmp_path: Path, chosen: Namespace) -> dict[tuple[str, str], float]:
    report = Report("control")
    await fly_table(report, chosen, tmp_path / "flown")
    return {(row.case, row.metric): row.value for row in report.rows}


@pytest.mark.parametrize("cases", [CORE, TOWER_KILLED], ids=["core", "tower killed"])
async def test_nobody_sinks_and_everybody_is_told_before_it_comes_down(
    cases: tuple[str, ...], arducopter: Path, tmp_path: Path
) -> None:
    found = await flown(tmp_path, options(arducopter, *cases))
    assert found["flown table", "flights"] == len(cases)
    assert found["flown table", "went_wrong"] == 0, {name: value for name, value in found.items() if "wrong" in name[1]}


async def test_a_lost_transmitter_takes_no_drone_out_of_its_hold(arducopter: Path, tmp_path: Path) -> None:
    cases = ("transmitter lost+hover+low", "transmitter lost+full forward+centred")
    found = await flown(tmp_path, options(arducopter, *cases, drones=2))
    assert found["flown table", "went_wrong"] == 0, found
    down = [seconds for (_, metric), seconds in found.items() if metric == "comes_down_after"]
    assert [29.0 < seconds < 33.0 for seconds in down] == [True] * len(cases), "the lost action, not the radio failsafe"


async def test_a_drone_that_shall_stay_stays(arducopter: Path, tmp_path: Path) -> None:
    cases = ("take+full climb+low", "take+hover+none", "browser gone+full forward+centred")
    found = await flown(tmp_path, options(arducopter, *cases, lost_action="stay", drones=3))
    assert found["flown table", "went_wrong"] == 0
    assert not [name for name in found if name[1] == "comes_down_after"]


async def test_a_take_beside_arm_or_take_off_is_held(arducopter: Path, tmp_path: Path) -> None:
    found = await flown(tmp_path, options(arducopter, "take_race", drones=4))
    assert found["take_race", "wrong"] == 0
    for what in ("arm", "take-off"):
        assert found[f"take_race, after {what}", "first_armed_heartbeat_to_hold_p95"] < 250


async def test_an_ordered_hold_comes_soon_and_no_old_frame_after_it(arducopter: Path, tmp_path: Path) -> None:
    found = await flown(tmp_path, options(arducopter, "ordered_hold", "drift", "round_trip", drones=2, rounds=4))
    assert found["ordered_hold", "request_to_mode_at_port_p95"] < 250
    assert found["late_frames", "old_holders_frames_after_hold"] == 0
    assert found["drift", "after_stage_two_max"] < 8
    assert found["round_trip", "slower_to_hold_max"] < 1.5


def test_the_table_is_not_empty() -> None:
    """A misspelt name of a flight would let every other test pass."""
    assert len(flights_of((), 1, set_up=False, lost_action="return")) == 8 * 7 * 3
    for name in (*CORE, *TOWER_KILLED):
        assert len(flights_of((name,), 1, set_up=False, lost_action="return")) == 1, name
