"""On a phone, 390 px wide: every target of the pages that a pilot needs is 44 px wide and high; no page is wider."""

from collections.abc import Iterator
from typing import Final

import pytest
from console_page import SIMULATOR, ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, ViewportSize, expect
from worlds.processes import CHECKOUT, World

PHONE: Final[ViewportSize] = {"width": 390, "height": 844}
TARGET_PX: Final = 44

SMALL: Final = """(least) => {
  const TARGETS = 'a[href], button, input, select, textarea, summary, [role=tab], [role=menuitem], [role=option]';
  // Rows of half pixels are rounded.
  const small = ({ width, height }) => width < least - 0.5 || height < least - 0.5;
  return [...document.querySelectorAll(TARGETS)]
    .filter((one) => one.getClientRects().length > 0 && getComputedStyle(one).visibility !== 'hidden')
    // The label of a field is part of its target; a link within a sentence is read, and is as high as its line.
    .filter((one) => !one.matches('p a'))
    // Nobody sees it, and its label or a button stands for it.
    .filter((one) => !one.matches('.visually-hidden') || one.closest('label'))
    .filter((one) => {
      const label = one.matches('input[type=checkbox], input[type=radio], input[type=file]') && one.closest('label');
      return small((label || one).getBoundingClientRect());
    })
    .map((one) => {
      const { width, height } = one.getBoundingClientRect();
      const words = one.dataset.testid ?? one.getAttribute('aria-label') ?? one.textContent.trim().slice(0, 30);
      return `${one.tagName.toLowerCase()} ${words}: ${Math.round(width)} x ${Math.round(height)}`;
    });
}"""


@pytest.fixture(scope="module")
def yard(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """alice owns Kestrel and Merlin, both switched on."""
    with World(tmp_path_factory.mktemp("yard")) as world:
        world.add_user("alice")
        ids = [world.add_drone(name, "alice") for name in ("Kestrel", "Merlin")]
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=SIMULATOR)
        world.wait_until_online(world.visitor("alice"), *ids)
        yield world


@pytest.fixture
def come(chromium: Browser, yard: World) -> Iterator[Somebody]:
    with visitors(chromium, yard.address) as somebody:
        yield somebody


class Measured:
    """Measures one state of a page after another and collects what is too small."""

    def __init__(self, console: ConsolePage) -> None:
        self._page = console.page
        self.faults: list[str] = []
        self._page.set_viewport_size(PHONE)

    def look(self, state: str) -> None:
        self.faults += [f"{state}: {one}" for one in self._page.evaluate(SMALL, TARGET_PX)]
        wide = self._page.evaluate("document.documentElement.scrollWidth")
        if wide > PHONE["width"]:
            self.faults.append(f"{state}: the page is {wide} px wide")


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
    part("alert-bell").click()
    measured.look("alerts")
    page.keyboard.press("Escape")
    part("user-menu").click()
    measured.look("menu")
    page.keyboard.press("Escape")

    console.open("/#/drone/1")
    expect(part("value-mode")).to_be_visible()
    measured.look("control, free")
    console.acquire("Kestrel")
    console.take_off("Kestrel", 8)
    measured.look("control, in flight")
    for opener in ("open-settings", "open-keys", "rehearse", "action-land", "manual-toggle"):
        part(opener).click()
        expect(page.get_by_role("dialog")).to_be_visible()
        measured.look(f"control, {opener}")
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)

    console.open("/#/missions/1")
    expect(part("drone-strip")).to_be_visible()
    part("plan-file").set_input_files(CHECKOUT / "web" / "test" / "plan" / "files" / "survey.plan")
    part("dropped-close").click()
    measured.look("missions")
    part("plan-item").nth(1).click()
    measured.look("missions, an item")
    for tab in ("fence", "rally", "checks", "settings"):
        part(f"tab-{tab}").click()
        measured.look(f"missions, {tab}")

    console.open("/#/account")
    expect(part("section-password")).to_be_visible()
    measured.look("account")
    assert not measured.faults, "\n".join(measured.faults)
