"""Bytes that a browser fetches until the squad is visible. `npm run bench:load` measures the times."""

from console_page import PASSWORD
from first_load import first_load
from playwright.sync_api import Browser, expect
from worlds.processes import World

BUDGET_BYTES = 1_100_000
SIGN_IN_BUDGET_BYTES = 204_000
BEFORE_MAP_BUDGET_BYTES = 440_000
"""All but the map and its ground, with what loads when the console is idle."""
MAP = "create_map"
"""Substring of the build file that contains the map library."""


def test_the_first_load_keeps_to_its_budget_and_the_map_comes_later(chromium: Browser, quiet_world: World) -> None:
    before = first_load(chromium, quiet_world.address, "[data-testid=sign-in-button]")
    assert before.transferred < SIGN_IN_BUDGET_BYTES, before.bytes_by_path
    assert before.transferred_of(MAP) == 0

    context = chromium.new_context()
    page = context.new_page()
    page.goto(quiet_world.address)
    page.get_by_label("Name").fill("alice")
    page.get_by_label("Password").fill(PASSWORD)
    page.get_by_role("button", name="Sign in", exact=True).click()
    expect(page.get_by_test_id("squad-row")).to_have_count(1)
    somebody = context.storage_state()
    context.close()
    signed_in = first_load(chromium, quiet_world.address, "[data-testid=squad-row]", signed_in=somebody)
    # Everything, including the map and its ground.
    assert signed_in.transferred_of(MAP) > 0
    assert signed_in.transferred_of("basemap") > 0
    assert signed_in.transferred < BUDGET_BYTES, signed_in.bytes_by_path
    of_map = signed_in.transferred_of(MAP) + signed_in.transferred_of("basemap")
    assert signed_in.transferred - of_map < BEFORE_MAP_BUDGET_BYTES, signed_in.bytes_by_path
