"""Behaviour of a real ArduCopter that a hold depends on. The simulator has to agree with each row."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest
from real.by_wire import ACCEPTED, CENTRED, CLIMB, DESCEND, DOWN, RELEASED, ByWire, by_wire

from bench.real_autopilot import Receiver
from bench.rig import wait_for
from wire.dialect import mavlink

HEIGHT_M = 20.0
WATCHED_S = 8.0
SET_UP = {"FS_OPTIONS": 16.0 + 1 + 4 + 8}
WITHOUT_FAILSAFE = {"FS_THR_ENABLE": 0.0}
FAILED = mavlink.MAV_RESULT_FAILED

Work = Callable[[ByWire], Coroutine[Any, Any, str]]


async def at_once(
    program: Path, folder: Path, rows: dict[str, tuple[Receiver, dict[str, float], Work]]
) -> dict[str, str]:
    """Runs each row with its own autopilot, at most four at once."""
    booting = asyncio.Semaphore(4)

    async def fly(name: str, receiver: Receiver, parameters: dict[str, float], work: Work) -> str:
        async with booting, by_wire(program, folder / name.replace(" ", "-"), receiver, parameters) as hands:
            return await work(hands)

    done = await asyncio.gather(*(fly(name, *row) for name, row in rows.items()))
    return dict(zip(rows, done, strict=True))


def sticks_stop_in(mode: str, *, fails: int = 0) -> Work:
    """`fails`: SIM_RC_FAIL while sticks still hide it. 1: no pulses, 2: throttle at 950, 3: the receiver's own sign."""

    async def work(hands: ByWire) -> str:
        """Returns what it does within WATCHED_S of the last stick."""
        await hands.up(HEIGHT_M)
        if mode != "ALT_HOLD":
            await hands.change_mode(mode)
        if fails:
            await hands.truth.set_parameter("SIM_RC_FAIL", fails)
        await hands.passed(2.0)
        assert hands.mode == mode, "sticks hide it"
        hands.sticks = None
        stopped_at, height_m = hands.now, hands.truth.alt_m
        await hands.passed(WATCHED_S)
        went = next((seen for seen in hands.truth.modes if seen.at > stopped_at and hands.mode != mode), None)
        if went is not None:
            changed_at = next(
                s.at for s in hands.truth.modes if s.at > stopped_at and s.custom_mode == hands.truth.mode
            )
            soon = 0.7 < changed_at - stopped_at < 2.2
            return f"{hands.mode} {'about 1 s' if soon else f'{changed_at - stopped_at:.1f} s'} later"
        if abs(hands.truth.alt_m - height_m) < 0.5:
            return "stays"
        return "comes down on" if mode == "LAND" else ("sinks" if hands.truth.motions[-1].climb_mps < -2 else "?")

    return work


async def test_what_it_does_when_sticks_stop(arducopter: Path, tmp_path: Path) -> None:
    low, none = Receiver.LOW, Receiver.NONE
    rows: dict[str, tuple[Receiver, dict[str, float], Work]] = {
        "low ALT_HOLD": (low, {}, sticks_stop_in("ALT_HOLD")),
        "low LOITER": (low, {}, sticks_stop_in("LOITER")),
        "low CIRCLE": (low, {}, sticks_stop_in("CIRCLE")),
        "centred CIRCLE": (Receiver.CENTRED, {}, sticks_stop_in("CIRCLE")),
        "low BRAKE": (low, {}, sticks_stop_in("BRAKE")),
        "low GUIDED": (low, {}, sticks_stop_in("GUIDED")),
        "centred ALT_HOLD": (Receiver.CENTRED, {}, sticks_stop_in("ALT_HOLD")),
        "none ALT_HOLD": (none, {}, sticks_stop_in("ALT_HOLD")),
        "none BRAKE": (none, {}, sticks_stop_in("BRAKE")),
        "none GUIDED": (none, {}, sticks_stop_in("GUIDED")),
        "none LAND": (none, {}, sticks_stop_in("LAND")),
        "none set up BRAKE": (none, SET_UP, sticks_stop_in("BRAKE")),
        "none set up GUIDED": (none, SET_UP, sticks_stop_in("GUIDED")),
        "none set up LAND": (none, SET_UP, sticks_stop_in("LAND")),
        "none without failsafe BRAKE": (none, WITHOUT_FAILSAFE, sticks_stop_in("BRAKE")),
        "none without failsafe ALT_HOLD": (none, WITHOUT_FAILSAFE, sticks_stop_in("ALT_HOLD")),
    }
    assert await at_once(arducopter, tmp_path, rows) == {
        "low ALT_HOLD": "sinks",
        "low LOITER": "sinks",
        "low CIRCLE": "sinks",
        "centred CIRCLE": "stays",
        "low BRAKE": "stays",
        "low GUIDED": "stays",
        "centred ALT_HOLD": "stays",
        "none ALT_HOLD": "RTL about 1 s later",
        "none BRAKE": "RTL about 1 s later",
        "none GUIDED": "RTL about 1 s later",
        "none LAND": "RTL about 1 s later",
        "none set up BRAKE": "RTL about 1 s later",
        "none set up GUIDED": "stays",
        "none set up LAND": "comes down on",
        "none without failsafe BRAKE": "stays",
        "none without failsafe ALT_HOLD": "stays",
    }


async def test_what_it_does_when_sticks_stop_after_its_transmitter_was_lost(arducopter: Path, tmp_path: Path) -> None:
    """FLTMODE_CH 0: a receiver that moves the mode switch when it loses its transmitter changes the mode besides."""
    low, unswitched = Receiver.LOW, {"FLTMODE_CH": 0.0}
    rows: dict[str, tuple[Receiver, dict[str, float], Work]] = {
        "BRAKE": (low, {}, sticks_stop_in("BRAKE", fails=1)),
        "BRAKE throttle 950": (low, unswitched, sticks_stop_in("BRAKE", fails=2)),
        "BRAKE sign": (low, unswitched, sticks_stop_in("BRAKE", fails=3)),
        "BRAKE FS_THR_ENABLE 3": (low, {"FS_THR_ENABLE": 3.0}, sticks_stop_in("BRAKE", fails=1)),
        "BRAKE FS_THR_ENABLE 0": (low, WITHOUT_FAILSAFE, sticks_stop_in("BRAKE", fails=1)),
        "GUIDED": (low, {}, sticks_stop_in("GUIDED", fails=1)),
        "GUIDED set up": (low, SET_UP, sticks_stop_in("GUIDED", fails=1)),
        "ALT_HOLD": (low, {}, sticks_stop_in("ALT_HOLD", fails=1)),
    }
    assert await at_once(arducopter, tmp_path, rows) == {
        "BRAKE": "RTL about 1 s later",
        "BRAKE throttle 950": "RTL 3.0 s later",
        "BRAKE sign": "RTL about 1 s later",
        "BRAKE FS_THR_ENABLE 3": "LAND about 1 s later",
        "BRAKE FS_THR_ENABLE 0": "stays",
        "GUIDED": "RTL about 1 s later",
        "GUIDED set up": "stays",
        "ALT_HOLD": "RTL about 1 s later",
    }


@pytest.mark.parametrize("released", [True, False])
async def test_a_transmitter_flies_at_once_only_if_the_sticks_are_given_back(
    released: bool, arducopter: Path, tmp_path: Path
) -> None:
    modes = {f"FLTMODE{position}": 2.0 for position in range(1, 6)}
    async with by_wire(arducopter, tmp_path / "autopilot", Receiver.LOW, modes) as hands:
        await hands.up(HEIGHT_M)
        await hands.change_mode("BRAKE")
        await hands.autopilot.turn_switch(1000)
        await wait_for("the switch's mode", lambda: hands.mode == "ALT_HOLD", 3)
        hands.sticks = RELEASED if released else None
        await hands.passed(0.15)
        hands.sticks = None
        await hands.passed(1.85)
        sinks = hands.truth.motions[-1].climb_mps < -1.0
        assert sinks is released, "its throttle is at the bottom"


async def _arming(hands: ByWire) -> str:
    await hands.change_mode("GUIDED")
    said = []
    for name, sticks in (("no sticks", None), ("centred", CENTRED), ("down", DOWN)):
        hands.sticks = sticks
        await hands.passed(1.0)
        result, words = await hands.arm()
        said.append(f"{name}: {'armed' if result == ACCEPTED else words}")
    return ", ".join(said)


async def test_without_a_receiver_only_throttle_down_arms(arducopter: Path, tmp_path: Path) -> None:
    rows: dict[str, tuple[Receiver, dict[str, float], Work]] = {"none": (Receiver.NONE, {}, _arming)}
    assert (await at_once(arducopter, tmp_path, rows))["none"] == (
        "no sticks: Arm: RC not found, centred: Arm: Throttle (RC3) is not neutral, down: armed"
    )


async def test_a_heartbeat_that_is_asked_for_shows_at_once_that_it_is_armed(arducopter: Path, tmp_path: Path) -> None:
    async with by_wire(arducopter, tmp_path / "autopilot", Receiver.LOW) as hands:
        truth = hands.truth
        assert (await hands.arm())[0] == ACCEPTED
        asked_at = hands.now
        assert await truth.ask(mavlink.MAV_CMD_REQUEST_MESSAGE, 0) == ACCEPTED
        await wait_for("an armed heartbeat", lambda: truth.armed and truth.modes[-1].at > asked_at, 1)
        assert truth.modes[-1].at - asked_at < 0.1


async def test_a_hold_on_the_ground_in_a_take_off_stays_on_the_ground(arducopter: Path, tmp_path: Path) -> None:
    async def work(hands: ByWire) -> str:
        await hands.change_mode("GUIDED")
        hands.sticks = DOWN
        await hands.passed(0.5)
        assert (await hands.arm())[0] == ACCEPTED
        assert await hands.truth.ask(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HEIGHT_M) == ACCEPTED
        await hands.passed(0.3)
        hands.sticks = CENTRED
        await hands.change_mode("ALT_HOLD")
        await hands.passed(4.0)
        return "on the ground" if hands.truth.alt_m < 0.3 else f"{hands.truth.alt_m:.1f} m"

    rows: dict[str, tuple[Receiver, dict[str, float], Work]] = {
        kind: (kind, {}, work) for kind in (Receiver.LOW, Receiver.NONE)
    }
    assert set((await at_once(arducopter, tmp_path, rows)).values()) == {"on the ground"}


async def test_centred_sticks_keep_the_motors_running_and_resting_ones_end_that(
    arducopter: Path, tmp_path: Path
) -> None:
    """DISARM_DELAY is 10 s."""

    async def work(hands: ByWire) -> str:
        hands.sticks = DOWN
        await hands.passed(0.5)
        assert (await hands.arm())[0] == ACCEPTED
        await hands.change_mode("ALT_HOLD")
        found = []
        for sticks in (CENTRED, DOWN):
            hands.sticks = sticks
            await hands.passed(14.0)
            found.append("armed" if hands.truth.armed else "disarmed")
        return ", ".join(found)

    rows: dict[str, tuple[Receiver, dict[str, float], Work]] = {
        kind: (kind, {}, work) for kind in (Receiver.LOW, Receiver.NONE)
    }
    assert set((await at_once(arducopter, tmp_path, rows)).values()) == {"armed, disarmed"}


async def test_how_far_it_goes_on_into_altitude_hold(arducopter: Path, tmp_path: Path) -> None:
    found: dict[str, float] = {}

    async def climbing(hands: ByWire) -> str:
        await hands.up(HEIGHT_M)
        hands.sticks = CLIMB
        await hands.passed(3.0)
        height_m = hands.truth.alt_m
        hands.sticks = CENTRED
        await hands.passed(4.0)
        found["climb"] = hands.truth.alt_m - height_m
        return ""

    async def sinking(hands: ByWire) -> str:
        await hands.up(10)
        hands.sticks = DESCEND
        await wait_for("5 m", lambda: hands.truth.alt_m < 5, 20)
        height_m = hands.truth.alt_m
        hands.sticks = CENTRED
        await hands.passed(4.0)
        found["descent"] = hands.truth.alt_m - height_m
        return ""

    await at_once(arducopter, tmp_path, {"climb": (Receiver.LOW, {}, climbing), "descent": (Receiver.LOW, {}, sinking)})
    assert 2.0 < found["climb"] < 4.5
    assert -4.0 < found["descent"] < -1.5


async def test_without_a_position_no_mode_that_stays_is_taken(arducopter: Path, tmp_path: Path) -> None:
    async with by_wire(arducopter, tmp_path / "autopilot", Receiver.LOW) as hands:
        await hands.up(HEIGHT_M)
        await hands.truth.set_parameter("SIM_GPS1_ENABLE", 0)
        await wait_for("the estimator to notice", lambda: not hands.truth.has_position, 20)
        assert [await hands.change_mode(name) for name in ("BRAKE", "GUIDED", "RTL")] == [FAILED] * 3
        await hands.passed(3.0)
        assert hands.mode == "ALT_HOLD"
        assert abs(hands.truth.alt_m - HEIGHT_M) < 1.5
