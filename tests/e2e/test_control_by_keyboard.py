"""Every action of the Control page by keyboard alone, without a click after the page is open."""

from typing import Any, Final

import pytest
from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect

TABBABLE: Final = """() => {
  const all = [...document.querySelectorAll('a[href], button, input, select, textarea, summary, [tabindex]')];
  const shown = all.filter((one) => one.checkVisibility({ visibilityProperty: true }) && !one.closest('[inert]'));
  const free = shown.filter((one) => !one.disabled && one.tabIndex >= 0);
  free.forEach((one, at) => (one.dataset.walk = String(at)));
  free.at(-1).focus();
  return { free: free.length, buttons: shown.filter((one) => one.matches('main button')).map((one) =>
    one.dataset.testid ?? one.getAttribute('aria-label') ?? one.textContent.trim()) };
}"""
"""All elements that Tab should reach, numbered in page order, and the names of the buttons, including disabled ones."""

FOCUSED: Final = """() => {
  const one = document.activeElement;
  const { outlineStyle, outlineWidth, boxShadow } = getComputedStyle(one);
  return {
    at: Number(one.dataset.walk ?? -1),
    name: one.dataset.testid ?? one.getAttribute('aria-label') ?? one.textContent.trim(),
    isSeen: (outlineStyle !== 'none' && parseFloat(outlineWidth) > 0) || boxShadow !== 'none',
  };
}"""

pressed: set[str] = set()
"""Every key that `press` pressed."""


def press(console: ConsolePage, key: str) -> None:
    """Presses a key for the page, not for a field with the focus."""
    pressed.add(key)
    console.page.evaluate("document.activeElement?.blur()")
    console.page.keyboard.press(key)


def keys_of_the_sheet(console: ConsolePage) -> set[str]:
    """Returns the keys that the page itself lists, without sticks, which are held, and the search (Ctrl k)."""
    shown = console.part("shortcut-sheet").locator("kbd").all_inner_texts()
    names = {"Esc": "Escape"}
    keys = [names.get(key, key) for key in shown if not key.startswith(("W S A D", "Ctrl"))]
    return {key.removeprefix("Shift ").upper() if key.startswith("Shift ") else key for key in keys}


def walk(console: ConsolePage) -> tuple[set[str], set[str]]:
    """Tabs from the top of the page to its end, in order, with each focus visible. Returns the elements reached and all
    buttons."""
    keyboard = console.page.keyboard
    there: dict[str, Any] = console.page.evaluate(TABBABLE)
    reached: list[dict[str, Any]] = []
    keyboard.press("Tab")
    # The browser's own toolbar may come between the last and the first.
    while len(reached) < there["free"] + 2:
        one = console.page.evaluate(FOCUSED)
        if one["at"] >= 0:
            reached.append(one)
        if one["at"] == there["free"] - 1:
            break
        keyboard.press("Tab")
    assert [one["at"] for one in reached] == list(range(there["free"])), [one["name"] for one in reached]
    unseen = [one["name"] for one in reached if not one["isSeen"]]
    assert not unseen, f"the focus is not to be seen on {unseen}"
    return {one["name"] for one in reached}, set(there["buttons"])


def expect_a_trap(console: ConsolePage, opener: str) -> None:
    """The dialog behind a button traps the focus, together with the flight bar, and Escape returns it."""
    console.part(opener).focus()
    console.page.keyboard.press("Enter")
    dialog = console.page.get_by_role("dialog")
    expect(dialog).to_be_visible()
    for key in ("Shift+Tab", "Shift+Tab", *["Tab"] * 8):
        console.page.keyboard.press(key)
        inside = (
            "(dialog) => dialog.contains(document.activeElement) || document.activeElement.closest('#beside-dialogs')"
        )
        assert dialog.evaluate(f"(dialog) => Boolean(({inside})(dialog))"), f"{opener}: {key} led out"
    console.page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    expect(console.part(opener)).to_be_focused()


def agree(console: ConsolePage, words: str = "Kestrel") -> None:
    """Confirms the dialog with Enter on a button reached by Tab, held where a press is not enough."""
    dialog = console.page.get_by_role("dialog")
    expect(dialog).to_contain_text(words)
    confirm = dialog.get_by_test_id("confirm-button")
    for _ in range(8):
        if confirm.evaluate("(button) => button === document.activeElement"):
            break
        console.page.keyboard.press("Tab")
    if confirm.get_attribute("data-held-s") is None:
        console.page.keyboard.press("Enter")
    else:
        console.page.keyboard.down("Enter")
        console.wait("the key to be held long enough", lambda: dialog.count() == 0)
        console.page.keyboard.up("Enter")
    expect(dialog).to_have_count(0)


def type_into(console: ConsolePage, key: str, testid: str, number: str) -> None:
    """The key, the number, Enter: nothing is asked, and what will happen stands beside the number."""
    press(console, key)
    expect(console.part(testid)).to_be_focused()
    console.page.keyboard.type(number)
    expect(console.part(f"{testid}-preview")).to_contain_text("Enter: Kestrel")
    expect(console.part(f"{testid}-preview")).to_contain_text(number)
    console.page.keyboard.press("Enter")
    expect(console.page.get_by_role("dialog")).to_have_count(0)


@pytest.mark.usefixtures("patient_drones")
def test_a_whole_flight_without_a_pointer(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel", has_map=True)
    keyboard = alice.page.keyboard
    press(alice, "?")
    expect(alice.part("shortcut-sheet")).to_contain_text("Hold the drone that you control")
    offered = keys_of_the_sheet(alice)
    keyboard.press("Escape")
    expect(alice.part("shortcut-sheet")).to_have_count(0)

    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") > 40)
    press(alice, "h")  # no effect: nobody has the controls yet
    press(alice, "c")
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")

    reached, buttons = walk(alice)
    for opener in ("open-keys", "open-settings", "rehearse", "stick-setup", "action-arm"):
        expect_a_trap(alice, opener)
    press(alice, "k")
    expect(alice.part("stick-setup-dialog")).to_be_visible()
    keyboard.press("Escape")
    press(alice, "j")
    expect(alice.part("messages")).to_be_focused()

    alice.read_loss_check("Kestrel")
    # Arm and disarm on the ground, in a mode chosen by typing its first letters.
    press(alice, "m")
    expect(alice.part("mode-select")).to_be_focused()
    keyboard.type("GUI")
    keyboard.press("Tab")
    keyboard.press("Enter")
    alice.wait("GUIDED", lambda: alice.word("mode") == "GUIDED")
    press(alice, "i")
    agree(alice)
    alice.wait("armed", lambda: alice.word("armed") == "true")
    press(alice, "I")
    agree(alice)
    alice.wait("disarmed", lambda: alice.word("armed") == "false")

    press(alice, "t")
    keyboard.press("ControlOrMeta+a")
    keyboard.type("8")
    keyboard.down("Enter")
    for _ in range(12):  # a key that stays down repeats: it must not take off
        keyboard.down("Enter")
    expect(alice.part("action-takeoff")).to_be_focused()
    keyboard.up("Enter")
    keyboard.press("Enter")
    expect(alice.part("action-takeoff-hint")).to_have_text("Hold for 1 second.")
    assert alice.word("armed") == "false"
    keyboard.down("Enter")
    alice.wait("the take-off", lambda: alice.word("armed") == "true")
    keyboard.up("Enter")
    alice.wait("8 m", lambda: abs(alice.number("altitude") - 8) < 0.5)
    type_into(alice, "e", "change-height", "14")
    alice.wait("14 m", lambda: abs(alice.number("altitude") - 14) < 0.5)
    type_into(alice, "n", "change-heading", "90")
    alice.wait("looking east", lambda: abs(alice.number("heading") - 90) < 3)
    type_into(alice, "p", "change-speed", "3")
    expect(alice.part("action-report")).to_contain_text("Kestrel, flying at 3 m/s: Accepted")

    # Every button that is disabled on the ground is enabled in the air or the reverse: Tab reaches each in one of them.
    reached_now, buttons_now = walk(alice)
    unreached = (buttons | buttons_now) - reached - reached_now
    assert unreached <= {"action-mode"}, unreached  # enabled once a mode is chosen: pressed above
    admin = signed_in(somebody, "admin", "Kestrel")
    assert {"control-take", "control-assist"} <= walk(admin)[0]
    admin.page.close()

    # Go to: the arrows move the map, Enter picks its middle.
    here = (alice.number("latitude"), alice.number("longitude"))
    press(alice, "g")
    keyboard.press("ArrowRight")
    alice.wait("the map has moved", lambda: alice.part("follow").get_attribute("aria-pressed") == "false")
    keyboard.down("Enter")
    expect(alice.part("map-menu")).to_contain_text("Kestrel")
    expect(alice.part("goto-height")).to_be_focused()
    for _ in range(3):  # a key that stays down repeats: it must not send the drone there
        keyboard.down("Enter")
    expect(alice.part("map-menu")).to_be_visible()
    keyboard.up("Enter")
    keyboard.press("Enter")
    alice.wait("on its way", lambda: alice.distance_m(*here) > 4)
    press(alice, "h")
    alice.wait("BRAKE", lambda: alice.word("mode") == "BRAKE")
    press(alice, "f")
    expect(alice.part("follow")).to_have_attribute("aria-pressed", "true")
    press(alice, "v")
    expect(alice.part("video-view")).to_have_attribute("data-large", "true")
    expect(alice.part("video-words")).to_contain_text("no camera")
    press(alice, "v")

    press(alice, "g")
    keyboard.press("Enter")
    alice.part("home-confirm").press("Enter")
    agree(alice)
    alice.wait("it to stand", lambda: alice.number("speed") < 0.1)
    press(alice, "o")
    agree(alice)
    alice.wait("home here", lambda: alice.number("distance-to-home") < 1)

    press(alice, "x")
    expect(alice.part("switch-drone")).to_be_focused()
    keyboard.press("Escape")
    expect(alice.part("switch-drone")).to_have_count(0)

    press(alice, "b")
    agree(alice)
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    press(alice, "Escape")
    expect(alice.part("manual-ended")).to_contain_text("you pressed Escape")
    alice.wait("BRAKE", lambda: alice.word("mode") == "BRAKE")

    press(alice, "r")
    agree(alice)
    alice.wait("RTL", lambda: alice.word("mode") == "RTL")
    press(alice, "l")
    agree(alice)
    alice.wait("LAND", lambda: alice.word("mode") == "LAND")
    alice.wait("landing", lambda: alice.word("armed") == "false")
    press(alice, "c")
    holder, dialog = alice.part("holder"), alice.page.get_by_role("dialog")
    alice.wait("an answer", lambda: holder.get_attribute("data-value") == "" or dialog.count() > 0)
    if dialog.count() > 0:  # its agent has not said yet that it stands on the ground
        agree(alice)
    expect(holder).to_have_attribute("data-value", "")
    assert offered <= pressed, f"no flight was flown with {offered - pressed}"


def test_single_keys_can_be_switched_off(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel", has_map=True)
    press(alice, "?")
    alice.part("shortcuts-on").uncheck()
    alice.page.keyboard.press("Escape")
    press(alice, "f")
    expect(alice.part("follow")).to_have_attribute("aria-pressed", "true")
    press(alice, "?")
    expect(alice.part("shortcut-sheet")).to_be_visible()
