"""The shell at a running vehicle: its commands over the modes of ArduCopter and PX4, and its socket."""

from __future__ import annotations

import asyncio
import socket
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from simulator.ardupilot import ARDUPILOT
from simulator.dialect import mavlink
from simulator.firmware.command_set import MAX_LINE
from simulator.firmware.fault_table import TABLE, FaultName
from simulator.firmware.states import SystemState
from simulator.flavour import Flavour
from simulator.px4.flavour import PX4
from simulator.receiver import Receiver
from simulator.shell_socket import MAX_TERMINALS, UNSENT_MAX, ShellSocket
from simulator.vehicle_shell import COMMANDS, VehicleShell

Ground = Any
HEARTBEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)


class FakeClocks:
    def __init__(self) -> None:
        self.passed_s = self.busy_s = 0.0

    def pair(self) -> tuple[Callable[[], float], Callable[[], float]]:
        return lambda: self.passed_s, lambda: self.busy_s


def shell_at(*stations: Ground) -> VehicleShell:
    return VehicleShell([station.vehicle for station in stations], FakeClocks().pair())


def ready(ground: Callable[..., Ground], flavour: Flavour = ARDUPILOT, **options: Any) -> tuple[Ground, VehicleShell]:
    station = ground(commander=True, boot_s=3.0, flavour=flavour, **options)
    station.ready()
    return station, shell_at(station)


def test_help_names_what_the_flight_controllers_own_shell_has(ground: Callable[..., Ground]) -> None:
    words = {line.split()[0] for line in shell_at(ground(commander=True)).execute("help").splitlines()}
    assert words == set(COMMANDS)
    wanted = "help info top tasks display arm auto manual calibrate reset fault"
    assert set(wanted.split()) <= words


@pytest.mark.parametrize("flavour", [ARDUPILOT, PX4], ids=lambda one: one.name)
def test_it_takes_off_and_lands(ground: Callable[..., Ground], flavour: Flavour) -> None:
    station, shell = ready(ground, flavour)
    assert "SYS_SAFE" in shell.execute("info")
    answer = shell.execute("auto hover")
    assert answer.startswith("hover: SYS_RUN_AUTO"), answer
    station.until(lambda: station.flight.alt_over_home_m() > 9.5)
    for command in ("arm", "calibrate", "reset"):
        assert shell.execute(command) == "refused: in SYS_SAFE only; this is SYS_RUN_AUTO"
    assert shell.execute("stop") == "refused: it is in the air; auto land"
    assert shell.execute("auto land") == "land: SYS_RUN_AUTO, mode LAND"
    station.until(lambda: not station.flight.armed)
    assert shell.state is SystemState.SAFE
    assert shell.execute("auto land") == "refused: not armed"


def test_only_a_commander_that_is_ready_arms(ground: Callable[..., Ground]) -> None:
    station = ground(commander=True, boot_s=8.0)
    shell = shell_at(station)
    assert shell.execute("arm") == "refused: in SYS_SAFE only; this is SYS_INIT"
    assert shell.execute("manual").startswith("refused: ")
    assert shell.execute("auto hover").startswith("refused: ")
    assert not station.flight.armed
    with pytest.raises(ValueError, match="commander"):
        shell_at(ground())


def test_manual_flight_stops_on_the_ground(ground: Callable[..., Ground]) -> None:
    _, shell = ready(ground)
    assert shell.execute("manual") == "SYS_RUN_MANUAL, mode ALT_HOLD"
    assert shell.execute("stop") == "SYS_SAFE"
    _, px4 = ready(ground, PX4, receiver=Receiver.NONE)
    refused = px4.execute("manual")
    assert refused.startswith("refused: "), refused


def test_a_fault_comes_with_its_text_and_goes(ground: Callable[..., Ground]) -> None:
    station, shell = ready(ground)
    shell.execute("auto hover")
    station.until(lambda: station.flight.alt_over_home_m() > 9.0)
    station.vehicle.said.clear()
    assert shell.execute("fault gps_loss") == "gps_loss: no position from satellites"
    station.run(1.0)
    assert {"GPS lost", "SYS_FAIL_MINOR"} <= set(station.vehicle.said)
    assert "faults: gps_loss" in shell.execute("info")
    assert shell.execute("fault gps_loss off") == "gps_loss ended"
    station.run(2.0)
    assert shell.state is SystemState.RUN_AUTO
    assert shell.execute("fault imu_noise") == "refused: imu_noise needs --model sensing"
    for wrong in ("fault", "fault x", "fault gps_loss on"):
        assert shell.execute(wrong).startswith("refused: fault NAME [off]")


@pytest.mark.parametrize("name", [name for name in FaultName if not TABLE[name].needs_sensors])
def test_every_fault_can_be_made(ground: Callable[..., Ground], name: FaultName) -> None:
    station = ground(commander=True)
    shell_at(station).execute(f"fault {name}")
    assert station.vehicle.failures == {TABLE[name].failure}


def test_a_compass_is_calibrated_kept_and_wants_a_reset(ground: Callable[..., Ground]) -> None:
    station, shell = ready(ground)
    assert shell.execute("calibrate") == "compass calibration started; info shows it"
    station.run(10.0)
    assert "compass calibration: 50 %" in shell.execute("info")
    assert shell.execute("arm") == "refused: Arm: Compass calibration running"
    assert shell.execute("calibrate keep").startswith("refused: ")
    station.run(11.0)
    assert shell.execute("calibrate keep") == "kept; reset now"
    assert "PreArm: Compass calibrated requires reboot" in shell.execute("info")
    assert shell.execute("reset") == "it restarts"
    station.run(0.5)
    assert shell.state in {SystemState.INIT, SystemState.STARTUP}
    station.ready()
    assert "ready" in shell.execute("info").splitlines()
    _, px4 = ready(ground, PX4)
    assert px4.execute("calibrate").startswith("compass calibration started")


def test_display_repeats_top_measures_and_tasks_lists(ground: Callable[..., Ground]) -> None:
    first, second = ground(commander=True), ground(commander=True)
    clocks = FakeClocks()
    shell = VehicleShell([first.vehicle, second.vehicle], clocks.pair())
    assert "roll" in shell.execute("display 3")
    seen = 0
    for _ in range(40):
        first.run(0.1)
        seen += len(shell.step())
    assert seen == 2
    clocks.passed_s, clocks.busy_s = 10.0, 2.5
    assert shell.execute("top") == "up 4.0 s; 25.0 % of a core for 2 vehicles in 10.0 s"
    assert "HEARTBEAT                         1.0 Hz" in shell.execute("tasks")
    assert shell.execute("vehicle 2").startswith("vehicle 2 of 2: SYS_")
    assert shell.execute("vehicle 3") == "refused: a number from 1 to 2"


@given(st.text(max_size=MAX_LINE + 20) | st.lists(st.sampled_from([*COMMANDS, *FaultName, "off", "2"])).map(" ".join))
@settings(max_examples=examples(20, long=120), deadline=None)
def test_any_line_has_an_answer(line: str) -> None:
    from conftest import Ground as Station

    station = Station(commander=True, boot_s=0.5)
    station.run(1.0)
    shell = shell_at(station)
    assert isinstance(shell.execute(line), str)
    station.run(0.1)
    assert station.flight.armed == (shell.state in {SystemState.RUN_AUTO, SystemState.RUN_MANUAL})


# The socket.


async def until(condition: Callable[[], object], act: Callable[[], None] = lambda: None) -> None:
    async with asyncio.timeout(30.0):
        while not condition():
            act()
            await asyncio.sleep(0.01)


def test_a_terminal_hears_answers_and_texts_of_its_vehicle(ground: Callable[..., Ground], tmp_path: Path) -> None:
    path = tmp_path / "sim"

    async def story() -> None:
        first, second = ground(commander=True, boot_s=3.0), ground(commander=True, boot_s=60.0)
        terminals = ShellSocket(path, [first.vehicle, second.vehicle])
        await terminals.open()
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        with pytest.raises(OSError, match="running process"):
            await ShellSocket(path, [first.vehicle]).open()
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(b"info\nbad")
        await writer.drain()
        heard = b""

        async def hear(word: bytes) -> None:
            nonlocal heard
            async with asyncio.timeout(10.0):
                while word not in heard:
                    heard += await reader.read(4096)

        await hear(b"mode STABILIZE")
        writer.write(b"ly\n")
        await hear(b"refused: no command 'badly'")
        first.run(4.0)
        second.run(4.0)
        terminals.step()
        await hear(b"SYS_SAFE")
        assert b"[4.00] SYS_STARTUP" in heard
        writer.close()
        terminals.close()

    asyncio.run(story())
    assert not path.exists()


def test_a_terminal_that_does_not_read_is_cut_and_there_are_only_so_many(
    ground: Callable[..., Ground], tmp_path: Path
) -> None:
    path = tmp_path / "sim"

    async def story() -> None:
        station = ground(commander=True)
        terminals = ShellSocket(path, [station.vehicle])
        await terminals.open()
        lines = [await asyncio.open_unix_connection(path) for _ in range(MAX_TERMINALS)]
        await until(lambda: len(terminals._terminals) == MAX_TERMINALS)
        reader, writer = await asyncio.open_unix_connection(path)
        async with asyncio.timeout(10.0):
            assert await reader.read() == b"refused: too many terminals\n"
        writer.close()

        def talk() -> None:
            station.vehicle.said.extend(["x" * (UNSENT_MAX // 8)] * 8)
            terminals.step()

        await until(lambda: not terminals._terminals, talk)
        for _, other in lines:
            other.close()
        terminals.close()

    asyncio.run(story())


def test_only_a_dead_socket_is_replaced(ground: Callable[..., Ground], tmp_path: Path) -> None:
    async def opened(path: Path) -> None:
        terminals = ShellSocket(path, [ground(commander=True).vehicle])
        await terminals.open()
        terminals.close()

    dead = tmp_path / "dead"
    left = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    left.bind(str(dead))
    left.close()
    asyncio.run(opened(dead))
    precious = tmp_path / "file"
    precious.write_text("mine")
    with pytest.raises(FileExistsError):
        asyncio.run(opened(precious))
    assert precious.read_text() == "mine"


def test_the_programs_talk_to_each_other(tmp_path: Path) -> None:
    path, programs = tmp_path / "sim", Path(sys.executable).parent
    command = [programs / "tower-sim", "--home", "47.4,8.5", "--out", "udp:127.0.0.1:9", "--shell", path]
    simulator = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        asyncio.run(until(lambda: path.exists() or simulator.poll() is not None))
        done = subprocess.run(
            [programs / "tower-sim", "shell", "--attach", path],
            input=b"info\nfault nothing\n",
            capture_output=True,
            timeout=60,
            check=True,
        )
    finally:
        simulator.terminate()
        simulator.wait(10)
    assert b"mode STABILIZE" in done.stdout
    assert b"refused: fault NAME [off]" in done.stdout
    assert not path.exists()
    failed = subprocess.run([programs / "tower-sim", "shell", "--attach", path], capture_output=True, check=False)
    assert failed.returncode == 1
    assert b"No such file" in failed.stderr
