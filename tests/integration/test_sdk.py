"""The SDK before a real tower with real agents: its examples fly, and whoever takes control ends a program."""

import asyncio
import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from agent_fakes import until
from worlds.clean_install import closure, fill
from worlds.processes import CHECKOUT, World

from control_tower import ControlLost, LossCause, Refused, Tower, sync

DRONES = ("Kestrel", "Merlin", "Hobby", "Falcon", "Harrier")
SPEED = 8
# On a busy machine a drone at this speed would disarm between arming and take-off.
FAST = ("--param", "LAND_SPEED=200", "--param", "RTL_LOIT_TIME=0", "--param", "DISARM_DELAY=0")
"""Landings take most of the time otherwise."""


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", CHECKOUT / "docs" / "examples" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """Five simulated drones of alice, and root, an admin. Both have tokens that fly."""
    with World(tmp_path_factory.mktemp("sdk")) as world:
        world.add_user("alice")
        world.add_user("root", "admin")
        ids = [world.add_drone(name, "alice") for name in DRONES]
        for user in ("alice", "root"):
            scopes = ("--scope", "watch", "--scope", "fly") + ("--scope", "admin") * (user == "root")
            world.tower_command("token", "add", user, "sdk", *scopes, "--token-file", str(world.folder / user))
        world.start_tower()
        world.start_simulated(
            *DRONES, options=("--boot-s", "1", "--speed", str(SPEED), "--real-rates", "--battery-mah", "1500", *FAST)
        )
        root = world.visitor("root")
        world.wait_until_online(root, *ids)
        for drone_id in ids:  # what has not been read yet may look like a danger, and nobody reads it here
            root.ask("POST", f"/drones/{drone_id}/control/acquire", {})
            root.accept_loss_check(drone_id)
            root.ask("POST", f"/drones/{drone_id}/control/release", {})
        yield world


def token(world: World, user: str) -> str:
    return (world.folder / user).read_text().strip()


@pytest.fixture
def signed_in(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOWER_URL", world.address)
    monkeypatch.setenv("TOWER_TOKEN", token(world, "root"))


async def test_every_example_flies(signed_in: None, capsys: pytest.CaptureFixture[str]) -> None:
    hello, go_to, watch, patrol = map(example, ("hello", "go_to", "watch", "patrol"))
    watching = asyncio.create_task(watch.main(600.0))
    _, missed_m, left_percent = await asyncio.gather(
        hello.main("Kestrel"), asyncio.to_thread(go_to.main, "Merlin"), patrol.main("Hobby", 97.0)
    )
    assert len(missed_m) == 4
    assert max(missed_m) < 4.0
    assert 0.0 < left_percent <= 97.0
    nearest_m = await example("formation").main(list(DRONES))
    assert len(nearest_m) == 2
    assert all(9.0 < distance_m < 19.0 for distance_m in nearest_m)
    assert not watching.done()
    watching.cancel()
    await asyncio.wait({watching})
    said = capsys.readouterr().out
    for words in (
        "Kestrel has landed",
        "from the corner",
        "%: home",
        "controls acquired by root",
    ):
        assert words in said
    assert "Harrier: 47.39" in said


async def test_a_take_ends_what_the_program_does(world: World) -> None:
    caught: list[Exception] = []

    async def stubborn(flight: Any) -> None:
        while True:
            try:
                await flight.go_to(47.3985, 8.5456, 15, speed_m_s=2)
                await flight.go_to(47.3977, 8.5456, 15, speed_m_s=2)
            except Exception as error:
                caught.append(error)

    async with (
        Tower(world.address, token(world, "alice")) as tower,
        Tower(world.address, token(world, "root")) as admin,
    ):
        drone = tower.drone("kestrel")
        with pytest.raises(ControlLost) as lost, drone.events() as events:
            async with drone.fly() as flight:
                await flight.acknowledge_loss_check()
                await flight.take_off(10)
                flying = asyncio.create_task(stubborn(flight))
                await flight.until(lambda now: (now.north_m_s or 0) > 1, "on its way")
                await admin.request("POST", f"/drones/{drone.id}/control/take", {"reason": "a helicopter"})
                await asyncio.Event().wait()
        assert lost.value.loss.cause in (LossCause.TAKEN, LossCause.HELD)
        await asyncio.wait({flying}, timeout=10)
        assert flying.cancelled()
        assert caught == []
        assert flight.loss == lost.value.loss
        with pytest.raises(ControlLost):
            await flight.hold()
        with pytest.raises(Refused) as refused:
            async with drone.fly():
                raise AssertionError("not reached")
        assert refused.value.code == "taken-away"
        seen = [await asyncio.wait_for(anext(events), 10) for _ in range(2)]
        assert all(event.drone_id == drone.id for event in seen)


async def test_an_error_in_the_air_brings_it_home(world: World) -> None:
    async with Tower(world.address, token(world, "root")) as tower:
        drone = tower.drone("Merlin")
        with pytest.raises(ZeroDivisionError):
            async with drone.fly() as flight:
                await flight.take_off(8)
                raise ZeroDivisionError
        with drone.watch() as telemetry:
            async with asyncio.timeout(30):
                async for now in telemetry:
                    if now.mode == "RTL":
                        break
        # The release is told after the drone shows the mode.
        await until(lambda: drone.state.holder is None or drone.state.holder.name != "root", what="the release")


def test_a_program_without_asyncio_is_ended_too(world: World) -> None:
    with sync.Tower(world.address, token(world, "root")) as tower:
        drone = tower.drone("Hobby")
        with pytest.raises(ControlLost) as lost, drone.fly() as flight:
            flight.mode("GUIDED")
            # Somebody signed in as the same user releases it elsewhere.
            tower.request("POST", f"/drones/{drone.id}/control/release", {})
            flight.until(lambda now: False, "anything")
        assert lost.value.loss.cause is LossCause.TAKEN


def test_folder_of_examples_is_flown() -> None:
    """Every example is in the test above."""
    there = {path.stem for path in (Path(CHECKOUT) / "docs" / "examples").glob("*.py")}
    assert there == {"hello", "go_to", "watch", "patrol", "formation"}


def test_its_wheel_is_whole(world: World, tmp_path: Path) -> None:
    """With nothing of the checkout beside it, and only what it declares. It asks the tower, and no drone: five at eight
    times the speed take more of a machine than the test."""
    world.running("simulator").terminate()
    build = ("wheel", "-q", "--no-deps", "--no-build-isolation", "--no-index", "-w", str(tmp_path))
    sdk = CHECKOUT / "deploy" / "packages" / "sdk"
    subprocess.run([sys.executable, "-m", "pip", *build, str(sdk)], check=True, timeout=60)
    wheel = next(tmp_path.glob("control_tower_sdk-*.whl"))
    fill(tmp_path / "site", wheel)
    script = (
        "import sys; sys.path.insert(0, sys.argv[1]); from control_tower import sync\n"
        "with sync.Tower() as tower: print([drone.name for drone in tower.drones])\n"
    )
    python = (sys.executable, "-I", "-S", "-c", script, str(tmp_path / "site"))
    environment = {"TOWER_URL": world.address, "TOWER_TOKEN": token(world, "alice")}
    said = subprocess.run(python, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert said.stdout == f"{list(DRONES)}\n", said.stderr
    names = {one.metadata["Name"].lower() for one in closure(wheel)}
    assert names == {"cryptography", "cffi", "fastcrc", "msgspec", "pycparser", "websockets"}
