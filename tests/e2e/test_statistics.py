"""The page of statistics: sums, plot, log book, CSV and maintenance, at the width of a phone, a tablet and a desk."""

import csv
import io
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from axe_look import Axe
from console_page import Somebody, visitors
from playwright.sync_api import Browser, expect
from worlds.flight_files import write_flight
from worlds.processes import World

SIZES = ((390, 844), (1024, 768), (1440, 900))


@pytest.fixture(scope="module")
def recorded(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower that finds two flights of Kestrel, forty days apart, and computes their figures."""
    folder = tmp_path_factory.mktemp("statistics")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        people = {"drone": "Kestrel", "pilot": "alice", "admin": "admin"}
        now = datetime.now(UTC)
        with closing(sqlite3.connect(folder / "tower.sqlite3")) as database:
            # Flights before a drone was made are not its own.
            database.execute("UPDATE drones SET created_at = '2020-01-01 00:00:00.000000'")
            database.commit()
        for ago in (timedelta(days=40), timedelta(hours=1)):
            write_flight(folder / "files" / "flights", drone_id=1, began_at=now - ago, lasts_s=120.0, **people)
        world.start_tower()
        yield world


@pytest.fixture
def come(chromium: Browser, recorded: World) -> Iterator[Somebody]:
    with visitors(chromium, recorded.address) as somebody:
        yield somebody


def test_statistics_and_maintenance(come: Somebody, axe: Axe) -> None:
    console = come()
    console.sign_in("admin")
    console.open("/#/flights")
    console.part("open-statistics").click()
    total = console.part("statistics-total")
    show = console.part("statistics-show")

    def is_there() -> bool:
        show.click()
        console.page.wait_for_timeout(200)
        return total.get_attribute("data-flights") == "2"

    console.wait("the figures of both flights", is_there)
    expect(console.part("total-hours")).to_have_text("4 min")
    expect(console.part("hours-plot")).to_have_attribute("data-months", "2")
    expect(console.part("statistics-row")).to_contain_text("2 holds, 2 link losses")
    for width, height in SIZES:
        console.page.set_viewport_size({"width": width, "height": height})
        expect(console.part("hours-plot").locator("canvas")).to_be_visible()
        for_sideways = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert console.page.evaluate(for_sideways) == 0, f"the page scrolls sideways at {width} px"
        axe.look(console, f"statistics at {width}")
    with console.page.expect_download() as download:
        console.part("csv-flights").click()
    rows = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
    assert [row["drone"] for row in rows] == ["Kestrel", "Kestrel"]
    console.part("tab-pilots").click()
    expect(console.part("pilot-row")).to_have_count(2)
    console.part("tab-log-book").click()
    console.part("tab-maintenance").click()
    console.part("maintenance-drone").select_option(label="Kestrel")
    console.part("maintenance-title").fill("Propellers")
    console.part("maintenance-interval").fill("50")
    console.part("maintenance-add").click()
    row = console.part("maintenance-row")
    expect(row).to_contain_text("50 h 00 min left")
    axe.look(console, "maintenance")
    console.part("maintenance-done").click()
    console.part("confirm-button").click()
    expect(row).to_contain_text("by admin")
