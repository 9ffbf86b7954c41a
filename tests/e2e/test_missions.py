"""The Missions page in a real browser: drawn, checked, saved, sent to a simulated drone, and flown."""

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from console_page import ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, FilePayload, expect
from worlds.processes import CHECKOUT, World

SURVEY_PLAN: Final = CHECKOUT / "web" / "test" / "plan" / "files" / "survey.plan"
FAST: Final = ("--boot-s", "2", "--seed", "7", "--speed", "8", "--real-rates")
SQUARE: Final = ((0.35, 0.5), (0.55, 0.5), (0.55, 0.72), (0.35, 0.72))


@pytest.fixture(scope="module")
def field(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """Kestrel (alice's) and Merlin (bob's), simulated at eight times real speed."""
    folder = tmp_path_factory.mktemp("field")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=FAST)
        world.wait_until_online(world.visitor("admin"), 1, 2)
        yield world


@pytest.fixture
def come(chromium: Browser, field: World) -> Iterator[Somebody]:
    with visitors(chromium, field.address, has_map=True) as somebody:
        yield somebody


def planning(come: Somebody, name: str, drone_id: int | None) -> ConsolePage:
    console = come()
    console.page.on("dialog", lambda dialog: dialog.accept())  # "leave the page?"
    console.sign_in(name)
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/missions" if drone_id is None else f"/#/missions/{drone_id}")
    expect(console.part("map")).to_have_attribute("data-zoom", re.compile(r"\d"))
    if drone_id is not None:
        console.wait("the drone's place", lambda: float(console.part("map").get_attribute("data-zoom") or 0) > 10)
    return console


def click(console: ConsolePage, *places: tuple[float, float]) -> None:
    """Clicks on the map, at fractions of its size."""
    box = console.part("map").bounding_box()
    assert box is not None
    for x, y in places:
        console.page.mouse.click(box["x"] + box["width"] * x, box["y"] + box["height"] * y)


def open_file(console: ConsolePage, name: str, content: bytes) -> None:
    file: FilePayload = {"name": name, "mimeType": "application/json", "buffer": content}
    console.part("plan-file").set_input_files(files=[file])


def standing(console: ConsolePage, kind: str, words: str) -> None:
    expect(console.part(f"board-{kind}")).to_have_attribute("data-standing", words)


def flown(console: ConsolePage) -> int:
    """Returns the item being flown, from 1; 0: none."""
    return int(console.part("flown-item").get_attribute("data-value") or -1) + 1


def action(console: ConsolePage, button: str, drone: str | None = None) -> None:
    """Presses a button, confirms where needed, and waits for the autopilot's acceptance."""
    reported = console.part("told")
    before = reported.inner_text() if reported.count() else ""
    console.part(button).click()
    if drone is not None:
        console.confirm(drone)
    console.wait(f"another answer than {before!r}", lambda: reported.count() > 0 and reported.inner_text() != before)
    expect(reported).to_have_attribute("data-good", "true")


def test_a_survey_is_drawn_uploaded_flown_paused_jumped_in_and_left(come: Somebody) -> None:
    console = planning(come, "alice", 1)
    for kind in ("mission", "fence", "rally"):
        standing(console, kind, "on the drone")  # empty on both sides
    console.part("strip-acquire").click()
    expect(console.part("mission-start")).to_be_visible()

    console.part("tool-survey").click()
    click(console, *SQUARE, SQUARE[0])
    items = int(console.part("pattern-facts").get_attribute("data-items") or 0)
    assert items > 8
    console.part("pattern-height").fill("20")
    expect(console.part("pattern-facts")).not_to_have_attribute("data-items", str(items))  # lower: more lines
    items = int(console.part("pattern-facts").get_attribute("data-items") or 0)
    console.part("pattern-add").click()
    expect(console.part("plan-item")).to_have_count(items + 1)  # plus the take-off
    console.page.get_by_role("tab", name="Checks").click()
    console.part("add-return").click()
    standing(console, "mission", "changed")

    console.page.evaluate(
        """() => {
          window.parts = [];
          new MutationObserver(() => {
            const bar = document.querySelector('[data-testid=transfer] progress');
            if (bar?.hasAttribute('value')) window.parts.push(Number(bar.getAttribute('value')));
          }).observe(document.body, {subtree: true, childList: true, attributes: true});
        }"""
    )
    console.part("upload").click()  # nothing is overwritten, so there is no confirmation
    expect(console.part("transfer-came")).to_have_attribute("data-as", "done")
    standing(console, "mission", "on the drone")
    progress: list[float] = console.page.evaluate("window.parts")
    assert any(0 < part < 1 for part in progress), progress

    console.page.keyboard.press("v")
    console.part("drone-plan-menu").click()
    console.part("verify").click()
    expect(console.part("transfer-came")).to_have_attribute("data-as", "done")

    action(console, "mission-start", "Kestrel")
    console.wait("item 5", lambda: flown(console) >= 5)
    assert abs(float(console.part("value-altitude").get_attribute("data-value") or 0) - 20) < 3
    current = console.page.locator("[data-testid=plan-item][data-current=true]")
    console.page.get_by_role("tab", name="Mission").click()
    expect(current).to_have_count(1)
    expect(console.page.locator("[data-testid=plan-item][data-reached=true]").first).to_be_visible()

    action(console, "mission-pause")
    console.wait("it to stand", lambda: "0.0 m/s" in console.part("drone-strip").inner_text())
    jump_to = items - 2
    console.part("plan-item").nth(jump_to).click()
    action(console, "jump-here", "Kestrel")
    console.wait("the jump", lambda: flown(console) >= jump_to + 1)
    action(console, "mission-resume", "Kestrel")
    console.wait("it to fly on", lambda: flown(console) > jump_to + 1)
    action(console, "mission-return", "Kestrel")
    expect(console.part("value-mode")).to_have_attribute("data-value", "RTL")
    console.wait("the ground", lambda: console.part("drone-state").get_attribute("data-value") == "idle")
    assert not [said for said in console.complaints if "401" not in said]


def test_a_file_is_opened_with_words_about_what_is_lost_and_a_plan_is_edited_by_keys(come: Somebody) -> None:
    console = planning(come, "bob", 2)
    page = console.page
    broken = json.loads(SURVEY_PLAN.read_text())
    broken["mission"]["items"].append({"type": "SimpleItem", "command": "not a number", "params": []})
    open_file(console, "broken.plan", json.dumps(broken).encode())
    expect(console.part("plan-problem")).to_contain_text("has no command")
    expect(console.part("plan-item")).to_have_count(0)
    open_file(console, "field.plan", SURVEY_PLAN.read_bytes())
    expect(console.part("import-left").locator("li").filter(has_text="structure scan, is left out")).to_be_visible()
    expect(console.part("import-taken")).to_contain_text("m above home")
    expect(console.part("plan-item")).to_have_count(0)
    console.part("import-open").click()
    expect(console.part("plan-name")).to_have_text("field")
    count = console.part("plan-item").count()
    assert count > 3

    # Nothing found replaces nothing; what is found waits for a choice, and for a word about the plan that it replaces.
    way = (
        "<LineString><altitudeMode>{}</altitudeMode><coordinates>8.5, 47.1, 30 8.6, 47.2, 40</coordinates></LineString>"
    )
    modes = ("relativeToGround", "absolute")
    marks = "".join(f"<Placemark>{way.format(mode)}</Placemark>" for mode in modes)
    open_file(console, "none.kml", b"<kml><Document/></kml>")
    expect(console.part("plan-problem")).to_contain_text("nothing to fly")
    open_file(console, "ways.kml", f"<kml><Document>{marks}</Document></kml>".encode())
    expect(console.part("import-open")).to_be_disabled()
    console.part("import-route-0").check()
    expect(console.part("import-taken")).to_contain_text("2 items, places at 30 to 40 m above terrain")
    expect(console.part("import-replaces")).to_contain_text("It replaces “field”")
    console.part("import-cancel").click()
    expect(console.part("plan-item")).to_have_count(count)

    # Arrows select, Alt and arrows move, Delete removes, and all of it can be undone.
    first = page.locator("[data-number]").first
    first.focus()
    page.keyboard.press("ArrowDown")
    chosen = page.locator("[data-number][aria-pressed=true]")
    expect(chosen).to_have_attribute("aria-label", re.compile("^Item 2,"))
    page.keyboard.press("Alt+ArrowDown")
    expect(chosen).to_have_attribute("aria-label", re.compile("^Item 3,"))
    expect(chosen).to_be_focused()
    page.keyboard.press("Delete")
    expect(console.part("plan-item")).to_have_count(count - 1)
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    expect(console.part("plan-item")).to_have_count(count)
    page.keyboard.press("Control+y")
    expect(console.part("undo")).to_have_attribute("aria-label", re.compile("^Undo: Move an item"))

    # Drawn by keys alone: Enter picks the middle of the map, Enter twice finishes.
    page.keyboard.press("f")
    for _ in range(3):
        page.keyboard.press("Enter")
        page.keyboard.press("ArrowRight" if _ == 0 else "ArrowDown")
        page.wait_for_timeout(400)  # the map glides
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    expect(console.part("fence-shape").last).to_contain_text("4 corners")

    # It is restored after a reload.
    shapes = console.part("fence-shape").count()
    expect(console.part("plan-saved")).to_have_attribute("data-value", "unsaved")
    page.reload()
    expect(console.part("plan-name")).to_have_text("field")
    expect(console.part("plan-item")).to_have_count(count)
    page.get_by_role("tab", name="Fence").click()
    expect(console.part("fence-shape")).to_have_count(shapes)

    # A new plan asks before it replaces this one.
    console.part("plan-menu").click()
    console.part("plan-new").click()
    expect(page.get_by_role("dialog")).to_contain_text("field")
    console.part("cancel-button").click()
    expect(console.part("plan-name")).to_have_text("field")


def test_a_plan_in_the_library_is_shared_and_nobodys_change_is_lost(come: Somebody) -> None:
    alice = planning(come, "alice", None)
    alice.part("tool-item").click()
    click(alice, (0.4, 0.4), (0.6, 0.4), (0.6, 0.6))
    alice.page.keyboard.press("Control+s")
    alice.part("save-name").fill("North field")
    alice.part("save-shared").check()
    alice.part("save-confirm").click()
    expect(alice.part("plan-saved")).to_have_text("in the library")

    admin = planning(come, "admin", None)
    admin.part("plan-menu").click()
    admin.part("plan-library").click()
    admin.page.get_by_role("button", name="Open North field").click()
    expect(admin.part("plan-item")).to_have_count(4)
    admin.part("tool-item").click()
    click(admin, (0.3, 0.7))
    admin.page.keyboard.press("Control+s")
    expect(admin.part("plan-saved")).to_have_text("in the library")

    click(alice, (0.5, 0.8))
    alice.page.keyboard.press("Control+s")
    expect(alice.page.get_by_role("dialog")).to_contain_text("North field")
    alice.part("cancel-button").click()
    expect(alice.part("plan-problem")).to_contain_text("Not saved")
    alice.page.keyboard.press("Control+s")
    alice.part("confirm-button").click()
    expect(alice.part("plan-saved")).to_have_text("in the library")


def test_what_another_drone_has_is_overwritten_only_by_a_name_and_by_its_holder(come: Somebody) -> None:
    console = planning(come, "bob", 2)
    expect(console.part("upload")).to_be_disabled()
    console.part("strip-acquire").click()
    console.part("tool-item").click()
    click(console, (0.4, 0.4), (0.6, 0.4))
    console.part("upload").click()
    expect(console.part("transfer-came")).to_have_attribute("data-as", "done")
    console.page.keyboard.press("w")
    click(console, (0.6, 0.6))
    console.part("upload").click()
    dialog = console.part("upload-dialog")
    expect(dialog).to_contain_text("in place of 3 on Merlin")
    console.part("upload-confirm").click()
    expect(console.part("transfer-came")).to_have_attribute("data-as", "done")
    standing(console, "mission", "on the drone")

    console.part("plan-menu").click()
    console.part("plan-new").click()
    console.part("confirm-button").click()
    standing(console, "mission", "changed")
    console.part("drone-plan-menu").click()
    console.part("download").click()
    expect(console.part("plan-item")).to_have_count(4)
    standing(console, "mission", "on the drone")
    console.part("drone-plan-menu").click()
    console.part("clear-mission").click()
    console.confirm("Merlin")
    standing(console, "mission", "changed")
