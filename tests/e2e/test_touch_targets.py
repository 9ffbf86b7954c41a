"""On a phone, 390 px wide: every target in the states of the pages that a pilot needs is 44 px wide and high."""

from collections.abc import Iterator
from typing import Final

import pytest
from console_page import SIMULATOR, Somebody, visitors
from playwright.sync_api import Browser, expect
from touch_targets import Measured
from worlds.processes import CHECKOUT, World

BEYOND_THE_PAGE: Final = """(cells) =>
  cells.filter((one) => one.getBoundingClientRect().right > innerWidth).map((one) => one.outerHTML)"""
HEADINGS_AND_VALUES: Final = """(cells) =>
  cells.map((one) => [getComputedStyle(one, '::before').content, one.innerText])"""


@pytest.fixture(scope="module")
def yard(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """alice owns Kestrel and Merlin, both switched on; an admin."""
    with World(tmp_path_factory.mktemp("yard")) as world:
        world.add_user("alice")
        world.add_user("admin", "admin")
        ids = [world.add_drone(name, "alice") for name in ("Kestrel", "Merlin")]
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=SIMULATOR)
        world.wait_until_online(world.visitor("alice"), *ids)
        yield world


@pytest.fixture
def come(chromium: Browser, yard: World) -> Iterator[Somebody]:
    with visitors(chromium, yard.address, has_map=True) as somebody:
        yield somebody


def test_every_target_is_as_large_as_a_finger(come: Somebody) -> None:
    console = come(has_touch=True)
    measured = Measured(console)
    page, part = console.page, console.part
    page.on("dialog", lambda dialog: dialog.accept())  # "leave the page?"
    measured.look("sign-in")
    console.sign_in("alice")
    expect(part("squad-row").first).to_be_visible()
    console.wait_for_frames(2)
    measured.look("monitor")
    page.get_by_role("button", name="Show Kestrel on the map").click()
    expect(part("drone-card")).to_be_visible()
    measured.look("card")
    page.get_by_role("button", name="Close the card").click()
    part("bar-alerts").click()
    measured.look("alerts")
    page.keyboard.press("Escape")
    part("user-menu").click()
    measured.look("menu")
    page.keyboard.press("Escape")

    console.open("/#/drone/1")
    expect(part("bar-state")).to_be_visible()
    measured.look("control, free")
    for panel in ("values", "link", "messages", "checks", "commands"):
        console.open_panel(panel)
        measured.look(f"control, {panel}")
    console.acquire("Kestrel")
    console.take_off("Kestrel", 8)
    measured.look("control, in flight")
    part("view-more").click()
    for opener, panel in (
        ("open-settings", "checks"),
        ("open-keys", "checks"),
        ("rehearse", "checks"),
        ("action-disarm", "commands"),
        ("manual-toggle", "commands"),
    ):
        console.open_panel(panel)
        part(opener).click()
        expect(page.get_by_role("dialog")).to_be_visible()
        measured.look(f"control, {opener}")
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)

    console.open("/#/missions/1")
    expect(part("drone-strip")).to_be_visible()
    part("plan-file").set_input_files(CHECKOUT / "web" / "test" / "plan" / "files" / "survey.plan")
    part("import-open").click()
    measured.look("missions")
    part("plan-item").nth(1).click()
    measured.look("missions, an item")
    for tab in ("fence", "rally", "checks", "settings"):
        part(f"tab-{tab}").click()
        measured.look(f"missions, {tab}")

    console.open("/#/flights")
    expect(part("flight-row").first).to_be_visible()
    measured.look("flights")

    console.open("/#/account")
    expect(part("section-password")).to_be_visible()
    measured.look("account")
    assert not measured.faults, "\n".join(measured.faults)


def test_records_are_cards_within_a_phone(come: Somebody) -> None:
    console = come(has_touch=True)
    measured = Measured(console)
    part = console.part
    console.sign_in("admin")
    for section, rows in (
        ("users", "user-row"),
        ("drones", "drone-row"),
        ("sessions", "session-row"),
        ("audit", "audit-row"),
    ):
        console.open(f"/#/admin/{section}")
        expect(part(rows).first).to_be_visible()
        measured.look(section)
        cells = part(rows).locator("td")
        assert cells.evaluate_all(BEYOND_THE_PAGE) == [], section
    console.open("/#/admin/drones")
    cells = part("drone-row").filter(has_text="Kestrel").locator("td")
    assert ['"Owners"', "alice"] in cells.evaluate_all(HEADINGS_AND_VALUES)
    assert not measured.faults, "\n".join(measured.faults)
