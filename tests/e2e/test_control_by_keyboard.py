"""Every action of the Control page with the keyboard alone: not one click after the page is open."""

from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect


def press(console: ConsolePage, key: str) -> None:
    """A key for the page, not for a field that has the focus."""
    console.page.evaluate("document.activeElement?.blur()")
    console.page.keyboard.press(key)


def agree(console: ConsolePage, words: str = "Kestrel") -> None:
    """Enter on what the dialog offers to be confirmed, reached by Tab."""
    dialog = console.page.get_by_role("dialog")
    expect(dialog).to_contain_text(words)
    confirm = dialog.get_by_test_id("confirm-button")
    for _ in range(8):
        if confirm.evaluate("(button) => button === document.activeElement"):
            break
        console.page.keyboard.press("Tab")
    console.page.keyboard.press("Enter")
    expect(dialog).to_have_count(0)


def type_into(console: ConsolePage, key: str, testid: str, number: str) -> None:
    press(console, key)
    expect(console.part(testid)).to_be_focused()
    console.page.keyboard.press("ControlOrMeta+a")
    console.page.keyboard.type(number)
    console.page.keyboard.press("Enter")
    agree(console)


def test_a_whole_flight_without_a_pointer(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    keyboard = alice.page.keyboard
    press(alice, "?")
    expect(alice.part("shortcut-sheet")).to_contain_text("Hold: stop and stay here")
    keyboard.press("Escape")
    expect(alice.part("shortcut-sheet")).to_have_count(0)

    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") > 40)
    press(alice, "h")  # nothing: the controls are nobody's yet
    press(alice, "c")
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")

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

    type_into(alice, "t", "takeoff-height", "8")
    alice.wait("8 m", lambda: abs(alice.number("altitude") - 8) < 0.5)
    type_into(alice, "e", "change-height", "14")
    alice.wait("14 m", lambda: abs(alice.number("altitude") - 14) < 0.5)
    type_into(alice, "n", "change-heading", "90")
    alice.wait("looking east", lambda: abs(alice.number("heading") - 90) < 3)
    type_into(alice, "p", "change-speed", "3")
    expect(alice.part("action-report")).to_contain_text("Speed 3 m/s: Kestrel accepted it")

    # Go to: the arrows move the map, Enter picks its middle.
    here = (alice.number("latitude"), alice.number("longitude"))
    press(alice, "g")
    keyboard.press("ArrowRight")
    alice.wait("the map has moved", lambda: alice.part("follow").get_attribute("aria-pressed") == "false")
    keyboard.press("Enter")
    expect(alice.part("goto-dialog")).to_contain_text("Fly Kestrel to")
    alice.part("goto-height").focus()
    keyboard.press("Enter")
    alice.wait("on its way", lambda: alice.distance_m(*here) > 4)
    press(alice, "h")
    alice.wait("BRAKE", lambda: alice.word("mode") == "BRAKE")
    press(alice, "f")
    expect(alice.part("follow")).to_have_attribute("aria-pressed", "true")
    press(alice, "v")
    expect(alice.part("video-view")).to_have_attribute("data-large", "true")
    expect(alice.part("video-place")).to_contain_text("no camera")
    press(alice, "v")

    press(alice, "o")
    agree(alice)
    alice.wait("home here", lambda: alice.number("distance-to-home") < 1)

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
    expect(alice.part("holder")).to_have_attribute("data-value", "")


def test_single_keys_can_be_switched_off(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    press(alice, "?")
    alice.part("shortcuts-on").uncheck()
    alice.page.keyboard.press("Escape")
    press(alice, "f")
    expect(alice.part("follow")).to_have_attribute("aria-pressed", "true")
    press(alice, "?")
    expect(alice.part("shortcut-sheet")).to_be_visible()
