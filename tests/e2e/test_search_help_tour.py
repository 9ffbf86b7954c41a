"""What helps people along: the tour at the first run, the search, help on every page, saved views, compact lines."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from axe_look import Axe
from console_page import SIMULATOR, ConsolePage, Somebody, visitors
from furnished import furnish
from playwright.sync_api import Browser, expect
from touch_targets import Measured
from worlds.processes import World


@pytest.fixture(scope="module")
def office(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower with twelve drones; Kestrel is switched on."""
    folder = tmp_path_factory.mktemp("office")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", options=SIMULATOR)
        admin = world.visitor("admin")
        furnish(world, admin)
        world.wait_until_online(admin, 1)
        yield world


@pytest.fixture
def come(chromium: Browser, office: World) -> Iterator[Somebody]:
    with visitors(chromium, office.address) as somebody:
        yield somebody


def entered(come: Somebody, name: str, *, is_first: bool = False) -> ConsolePage:
    console = come(is_first=is_first)
    console.sign_in(name)
    expect(console.part("squad-row").first).to_be_visible()
    return console


def search(console: ConsolePage, text: str) -> None:
    console.page.keyboard.press("Control+k")
    expect(console.part("search-dialog")).to_be_visible()
    console.part("search-text").fill(text)


def test_the_tour_has_four_steps_and_comes_once(come: Somebody, axe: Axe) -> None:
    bob = entered(come, "bob", is_first=True)
    tour = bob.part("tour")
    for step in range(1, 5):
        expect(tour).to_have_attribute("data-step", str(step))
        axe.look(bob, f"tour-{step}")
        if step < 4:
            bob.part("tour-next").click()
    with bob.page.expect_response(lambda one: one.url.endswith("/preferences/console")):
        bob.part("tour-next").click()
    expect(tour).to_have_count(0)
    # Nor does it come in another browser: the tower remembers it.
    there = entered(come, "bob", is_first=True)
    with there.page.expect_response(lambda one: one.url.endswith("/me/preferences")):
        there.page.reload()
    expect(there.part("squad-row").first).to_be_visible()
    expect(there.part("tour")).to_have_count(0)


def test_the_search_finds_drones_pages_and_commands(come: Somebody, axe: Axe) -> None:
    alice = entered(come, "alice")
    search(alice, "kes")
    first = alice.part("search-entry").first
    expect(first).to_contain_text("Kestrel")
    expect(first).to_have_attribute("data-kind", "drone")
    axe.look(alice, "search")
    alice.page.keyboard.press("Enter")
    expect(alice.part("value-armed")).to_be_visible()
    search(alice, "take kestrel")
    alice.page.keyboard.press("Enter")
    expect(alice.part("bar-own")).to_contain_text("Kestrel")
    search(alice, "hold kestrel")
    alice.page.keyboard.press("Enter")
    expect(alice.part("bar-answer")).to_contain_text("Hold")
    search(alice, "contrast")
    alice.page.keyboard.press("Enter")
    expect(alice.page.locator("html[data-theme=contrast]")).to_have_count(1)
    search(alice, "release")
    alice.page.keyboard.press("Enter")
    expect(alice.part("control-acquire")).to_be_visible()
    search(alice, "parameters of kestrel")
    alice.page.keyboard.press("Enter")
    expect(alice.part("parameters-state")).to_be_visible()
    search(alice, "no such thing")
    expect(alice.part("search-dialog")).to_contain_text("Nothing is called")
    alice.page.keyboard.press("Escape")
    # The theme follows the user to another browser.
    there = entered(come, "alice")
    expect(there.page.locator("html[data-theme=contrast]")).to_have_count(1)


def test_every_page_has_its_help(come: Somebody, axe: Axe) -> None:
    admin = entered(come, "admin")
    titles = set()
    for address in ("", "drone/1", "drone/1/parameters", "drone/1/logs", "missions", "squad-mission/1", "videos"):
        admin.page.evaluate(f"window.location.hash = '#/{address}'")
        admin.part("open-help").click()
        sheet = admin.part("shortcut-sheet")
        expect(sheet.get_by_role("listitem").first).to_be_visible()
        titles.add(sheet.get_by_role("heading").first.inner_text())
        admin.page.keyboard.press("Escape")
        expect(sheet).to_have_count(0)
        admin.page.keyboard.press("?")
        expect(sheet).to_be_visible()
        admin.page.keyboard.press("Escape")
    assert len(titles) == 7, titles
    axe.look_beneath(admin, "open-help", "help")


def test_views_are_saved_for_the_user(come: Somebody, axe: Axe) -> None:
    admin = entered(come, "admin")
    admin.part("squad-view").get_by_text("Compact").click()
    admin.part("squad-filter").select_option("offline")
    admin.part("views-menu").click()
    admin.part("view-save").click()
    admin.part("view-name").fill("Who is off")
    axe.look(admin, "view-dialog")
    admin.part("view-submit").click()
    expect(admin.part("views-menu")).to_contain_text("Who is off")
    admin.part("views-menu").click()
    with admin.page.expect_response(lambda one: one.url.endswith("/preferences/monitor-views")):
        admin.part("view-first").click()
    # In another browser the Monitor opens with it.
    there = come()
    there.sign_in("admin")
    expect(there.part("squad-filter")).to_have_value("offline")
    expect(there.part("squad-row")).to_have_count(11)
    there.part("views-menu").click()
    there.part("view-usual").click()
    expect(there.part("squad-filter")).to_have_value("all")
    there.part("squad-search").fill("nothing of this name")
    there.part("show-every-drone").click()
    expect(there.part("squad-row").first).to_be_visible()
    # Removed again.
    there.part("views-menu").click()
    there.part("view-saved").click()
    there.part("views-menu").click()
    with there.page.expect_response(lambda one: one.url.endswith("/preferences/monitor-views")):
        there.part("view-remove").click()
    expect(there.part("views-menu")).to_have_accessible_name("Views")


def test_twelve_drones_need_no_scrolling(come: Somebody, axe: Axe) -> None:
    admin = entered(come, "admin")
    admin.page.set_viewport_size({"width": 1440, "height": 900})
    admin.part("squad-view").get_by_text("Compact").click()
    rows = admin.part("squad-row")
    expect(rows).to_have_count(12)
    frame = admin.page.get_by_role("region", name="Drones").bounding_box()
    last = rows.last.bounding_box()
    assert frame is not None and last is not None
    assert last["y"] + last["height"] <= frame["y"] + frame["height"], (frame, last)
    axe.look(admin, "monitor-compact")
    measured = Measured(admin)
    measured.look("compact")
    assert not measured.faults, "\n".join(measured.faults)
