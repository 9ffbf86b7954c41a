"""The page of statistics: sums, plot, log book, CSV, links by place, maintenance, at widths from a phone to a desk."""

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

NOW = datetime.now(UTC)
AGO = (timedelta(days=40), timedelta(hours=1))
"""When the flights were."""
SIZES = ((390, 844), (1024, 768), (1440, 900))


@pytest.fixture(scope="module")
def recorded(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower that finds two flights of Kestrel, forty days apart, and computes their figures."""
    folder = tmp_path_factory.mktemp("statistics")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        people = {"drone": "Kestrel", "pilot": "alice", "admin": "admin"}
        with closing(sqlite3.connect(folder / "tower.sqlite3")) as database:
            # Flights before a drone was made are not its own.
            database.execute("UPDATE drones SET created_at = '2020-01-01 00:00:00.000000'")
            database.commit()
        for ago in AGO:
            write_flight(folder / "files" / "flights", drone_id=1, began_at=NOW - ago, lasts_s=120.0, **people)
        world.start_tower()
        yield world


@pytest.fixture
def come(chromium: Browser, recorded: World) -> Iterator[Somebody]:
    with visitors(chromium, recorded.address, has_map=True) as somebody:
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
    first, last = (12 * moment.year + moment.month for moment in (NOW - ago for ago in AGO))
    expect(console.part("hours-plot")).to_have_attribute("data-months", str(last - first + 1))
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


def test_links_by_place(come: Somebody, axe: Axe) -> None:
    console = come()
    console.sign_in("admin")
    console.page.set_viewport_size({"width": 390, "height": 844})
    console.open("/#/statistics")
    console.part("tab-link").click()
    rows = console.part("link-row")
    # Kestrel flies on a circle of 300 m, so its reports are in several cells; in one of them the link was only lost.
    expect(rows.nth(4)).to_be_visible()
    expect(rows.first).to_contain_text("Link lost")
    expect(rows.nth(1)).to_contain_text("Good")
    expect(console.part("link-map").locator("canvas.maplibregl-canvas")).to_be_visible()
    expect(console.part("link-legend")).to_contain_text("up to 2 %")
    assert console.page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth") == 0
    axe.look(console, "links by place at 390")
    console.part("link-measure").get_by_text("Round trip").click()
    expect(console.part("link-legend")).to_contain_text("up to 150 ms")
    rows.nth(1).get_by_role("button").click()
    figures = console.part("link-figures")
    expect(figures).to_contain_text("1.0 %")
    expect(figures).to_contain_text("48 ms")
    # The row's place is in the middle of the map now, where Enter picks.
    place = rows.nth(1).get_by_role("button").inner_text()
    console.part("link-measure").get_by_text("Loss").click()
    expect(figures).to_contain_text(place)
    console.part("link-cell-size").select_option(label="2.00 km")
    expect(figures).to_contain_text("Choose a cell")
    canvas = console.part("link-map").locator("canvas.maplibregl-canvas")
    console.wait("one or a few large cells", lambda: rows.count() < 5)
    canvas.focus()
    canvas.press("Enter")
    expect(figures).to_contain_text("Median round trip")
    with console.page.expect_download() as download:
        console.part("csv-link").click()
    cells = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
    assert len(cells) == rows.count()
    assert sum(int(cell["losses"]) for cell in cells) == 2
    console.part("statistics-from").fill("2099-01-01T00:00")
    console.part("statistics-show").click()
    expect(console.part("link-nowhere")).to_be_visible()
