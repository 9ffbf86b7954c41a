"""Fixtures for the browser tests: a real Chromium and a real squad."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from axe_look import Axe
from console_page import FLAGS, SIMULATOR, Somebody, visitors
from playwright.sync_api import Browser, expect, sync_playwright
from worlds.modest_chromium import modest
from worlds.processes import World, wait_for


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker("browser")


@pytest.fixture(scope="session")
def modest_chromium(chromium_path: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The whole Chromium at a low priority, for what the shell lacks."""
    return modest(chromium_path, tmp_path_factory.mktemp("chromium"))


@pytest.fixture(scope="session")
def modest_shell(page_browser_path: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What shows pages, at a low priority."""
    return modest(page_browser_path, tmp_path_factory.mktemp("shell"))


# Not for the session: Playwright keeps an event loop running in this thread, and the asyncio tests need their own.
@pytest.fixture(scope="module")
def chromium(modest_shell: Path, console: Path) -> Iterator[Browser]:
    expect.set_options(timeout=20_000)  # a deadline for a busy machine, not a delay
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=modest_shell, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def prepared_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """alice owns Kestrel (1), bob owns Merlin (2), and there is an admin."""
    folder = tmp_path_factory.mktemp("prepared")
    with World(folder) as world:
        for operator in ("alice", "bob"):
            world.add_user(operator)
        world.add_user("admin", "admin")
        assert world.add_drone("Kestrel", "alice") == 1
        assert world.add_drone("Merlin", "bob") == 2
    return folder


@pytest.fixture
def quiet_world(tmp_path: Path, prepared_folder: Path) -> Iterator[World]:
    """A tower with all drones switched off."""
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    with World(tmp_path, prepared=True) as world:
        world.start_tower()
        yield world


@pytest.fixture
def world(quiet_world: World, request: pytest.FixtureRequest) -> World:
    """A tower and Kestrel, simulated and online; or the drones that `@pytest.mark.drones` names, all of sysid 1."""
    marker = request.node.get_closest_marker("drones")
    drones = marker.args if marker else ("Kestrel",)
    quiet_world.start_simulated(*drones, options=SIMULATOR)
    admin = quiet_world.visitor("admin")

    def ids() -> list[int] | None:
        answer = admin.ask("GET", "/drones")  # a tower that is kept busy may refuse one
        return [drone["id"] for drone in answer.json if drone["name"] in drones] if answer.status == 200 else None

    quiet_world.wait_until_online(admin, *wait_for("the squad", ids))
    return quiet_world


@pytest.fixture
def patient_drones(world: World) -> None:
    """For flying by hand: a browser that draws in software is sometimes late; other tests check the limits."""
    patient = {"sticks_stale_s": 2.0, "sticks_late_s": 2.0, "rtt_limit_ms": 5000, "rtt_limit_s": 5.0}
    answer = world.visitor("admin").ask("PATCH", "/drones/1/settings", patient)
    assert answer.status == 200, answer.body


@pytest.fixture
def somebody(chromium: Browser, world: World, request: pytest.FixtureRequest) -> Iterator[Somebody]:
    """Opens the console in a separate browser profile, so that several people can be signed in at once.

    A module about the map says `HAS_MAP = True`."""
    with visitors(chromium, world.address, has_map=getattr(request.module, "HAS_MAP", False)) as come:
        yield come


@pytest.fixture
def somebody_early(chromium: Browser, quiet_world: World, request: pytest.FixtureRequest) -> Iterator[Somebody]:
    """The same, before any drone is switched on."""
    with visitors(chromium, quiet_world.address, has_map=getattr(request.module, "HAS_MAP", False)) as come:
        yield come


@pytest.fixture
def axe() -> Iterator[Axe]:
    looks = Axe()
    yield looks
    assert not looks.faults, "\n".join(looks.faults)
