"""For all tests: a part that is missing is a failure in CI, and a skip with the reason elsewhere."""

import asyncio
import gc
import os
import shutil
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import asyncpg
import pytest
import structlog
from worlds.costs import CostsPlugin
from worlds.event_loop import LoopsOfTests
from worlds.postgres import postgres_programs, temporary_postgres
from worlds.side_by_side import Groups, order_of_start, turns_of_this_run
from worlds.tiers import register_tiers

from server.storage.database import open_database
from server.storage.schema import migrate

CHROMIUM_NAMES: Final = ("chromium", "chromium-browser", "google-chrome")
HEADLESS_SHELL: Final = "chromium-headless-shell"
CONSOLE: Final = Path(__file__).resolve().parent.parent / "web" / "dist" / "index.html"


register_tiers()
asyncio.set_event_loop_policy(LoopsOfTests())

# Its own default prints the variables of every frame of a traceback: seconds for an error that a test provokes.
_PLAIN = structlog.dev.ConsoleRenderer(exception_formatter=structlog.dev.plain_traceback)
structlog.configure(processors=[*structlog.get_config()["processors"][:-1], _PLAIN])

_turns = turns_of_this_run()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--costs", metavar="FILE", help="measure the processor time of each module, and write it to FILE")


def pytest_configure(config: pytest.Config) -> None:
    if file := config.getoption("--costs"):
        config.pluginmanager.register(CostsPlugin(config, Path(file)), "costs")
    gc.disable()  # until all is imported and collected: nothing of it is garbage


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Groups:
    return Groups(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if _turns is not None:
        order_of_start(items)


def pytest_collection_finish() -> None:
    """What was imported and collected stays to the end: no search for garbage goes through it again."""
    gc.enable()
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> Generator[None, bool, bool]:
    if _turns is not None:
        _turns.enter(item)
    try:
        return (yield)
    finally:
        if _turns is not None:
            _turns.leave(item, nextitem)


@pytest.fixture(autouse=True)
def _state_of_its_own(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an agent remembers of an autopilot is for this test alone, and nothing of it in anybody's home."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path_factory.getbasetemp() / f"state-{uuid4().hex}"))


def pytest_sessionfinish() -> None:
    if _turns is not None:
        _turns.tidy_up()


@pytest.fixture(scope="session")
def missing() -> Callable[[str], None]:
    """Call it with the name of a part that is not there, and how to get it."""

    def say(part: str) -> None:
        if os.environ.get("CI"):
            pytest.fail(f"this test needs {part}", pytrace=False)
        pytest.skip(f"this test needs {part}")

    return say


@pytest.fixture(scope="session")
def chromium_path(missing: Callable[[str], None]) -> str:
    """The system's Chromium."""
    found = next((path for name in CHROMIUM_NAMES if (path := shutil.which(name))), None)
    if found is None:
        missing("Chromium (Debian: apt-get install chromium)")
    assert found is not None
    return found


@pytest.fixture(scope="session")
def page_browser_path(chromium_path: str) -> str:
    """The same Chromium as a shell without the browser's own windows, where there is one: it opens a page with half of
    the processor time. It has no installed apps and no push messages."""
    return shutil.which(HEADLESS_SHELL) or chromium_path


@pytest.fixture(scope="session")
def console(missing: Callable[[str], None]) -> Path:
    """The built console."""
    if not CONSOLE.exists():
        missing("the console, built (make setup)")
    return CONSOLE


@pytest.fixture(scope="session")
def postgres_server(missing: Callable[[str], None]) -> Iterator[str]:
    """The address of a PostgreSQL server of our own."""
    programs = postgres_programs()
    if programs is None:
        missing("PostgreSQL (Debian: apt-get install postgresql)")
    assert programs is not None
    with temporary_postgres(programs) as address:
        yield address


@pytest.fixture
def postgres_url(postgres_server: str) -> str:
    """An empty database on it."""
    return _new_database(postgres_server, "template1")


@pytest.fixture(scope="session")
def _migrated_template(postgres_server: str) -> str:
    """The name of a database of the newest revision, to which nobody connects."""
    url = _new_database(postgres_server, "template1")

    async def work() -> None:
        database = open_database(url.replace("postgresql://", "postgresql+asyncpg://"))
        await migrate(database)
        await database.close()

    asyncio.run(work())
    return url.rpartition("/")[2]


@pytest.fixture
def migrated_postgres_url(postgres_server: str, _migrated_template: str) -> str:
    """A database of the newest revision on it. Migrating one takes most of a second."""
    return _new_database(postgres_server, _migrated_template)


def _new_database(server: str, template: str) -> str:
    name = f"test_{uuid4().hex}"

    async def create() -> None:
        connection = await asyncpg.connect(f"{server}/postgres")
        try:
            await connection.execute(f"CREATE DATABASE {name} TEMPLATE {template}")
        finally:
            await connection.close()

    asyncio.run(create())
    return f"{server}/{name}"
