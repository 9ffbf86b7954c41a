"""Flying by hand: with a gamepad, on a touch screen, and when the pilot's hands or eyes leave the page."""

import pytest
from console_page import SIMULATOR, ConsolePage, Somebody, signed_in
from fake_pad import FakePad
from playwright.sync_api import expect
from worlds.processes import World

pytestmark = pytest.mark.usefixtures("patient_drones")
HEIGHT_M = 12.0


def in_the_air(somebody: Somebody, *, has_touch: bool = False) -> ConsolePage:
    alice = signed_in(somebody, "alice", "Kestrel", has_touch=has_touch)
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", HEIGHT_M)
    return alice


def plugged_in(console: ConsolePage) -> FakePad:
    pad = FakePad(console)
    expect(console.part("manual-means")).to_contain_text("Test pad")
    expect(console.part("manual-toggle")).to_be_disabled()
    pad.show_sticks()
    expect(console.part("manual-lack")).to_have_count(0)
    return pad


def begin(console: ConsolePage) -> None:
    expect(console.part("manual-toggle")).to_be_enabled()
    console.part("manual-toggle").click()
    console.confirm("Kestrel")


SCROLL_ALL = """() => {
  for (const one of [document.documentElement, document.body, document.querySelector('.page')]) {
    one.scrollTop = 400;
    one.scrollLeft = 400;
  }
  window.scrollTo(0, 400);
  return -document.querySelector('.page').getBoundingClientRect().top;
}"""


def expect_in_reach(console: ConsolePage, part: str) -> None:
    """The whole part is on the screen, without scrolling, and what is pressed in its middle is the part itself."""
    reach = console.part(part).evaluate(
        """(part) => {
          const { left, top, right, bottom } = part.getBoundingClientRect();
          const found = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
          const isOnScreen = left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight;
          return { isOnScreen, isFree: part.contains(found), at: [left, top, right, bottom].map(Math.round) };
        }"""
    )
    assert reach["isOnScreen"] and reach["isFree"], f"{part} at {console.page.viewport_size}: {reach}"


def expect_hold(console: ConsolePage, why: str) -> None:
    expect(console.part("manual-ended")).to_contain_text(why)
    expect(console.part("manual-bars")).to_have_count(0)
    console.wait("BRAKE", lambda: console.word("mode") == "BRAKE")
    console.wait("standing still", lambda: abs(console.number("climb")) < 0.2 and console.number("speed") < 0.3)


def test_a_gamepad_flies_and_whatever_ends_it_means_hold(somebody: Somebody) -> None:
    alice = in_the_air(somebody)
    pad = plugged_in(alice)

    # No sticks are sent before a start with centred throttle.
    pad.move(left=(0, 1))
    begin(alice)
    expect(alice.part("manual-status")).to_contain_text("Centre the sticks to begin: throttle")
    expect(alice.part("manual-bars")).to_have_attribute("data-sent", "0")
    assert alice.word("mode") == "GUIDED"
    pad.move()
    expect(alice.part("manual-bars")).to_have_attribute("data-phase", "flying")
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")

    pad.move(left=(0, 0.8))
    alice.wait("climbing", lambda: alice.number("altitude") > HEIGHT_M + 4)
    expect(alice.part("axis-throttle")).to_contain_text("1891")  # 500 * (0.8 - 0.08) / 0.92 + 1500
    pad.move(left=(0, -0.8))
    alice.wait("sinking", lambda: alice.number("altitude") < HEIGHT_M)
    pad.move()
    alice.wait("height held", lambda: abs(alice.number("climb")) < 0.2)
    height_m, place = alice.number("altitude"), (alice.number("latitude"), alice.number("longitude"))

    pad.move(right=(1, 0))
    alice.wait("moved east", lambda: alice.distance_m(*place) > 8)
    assert alice.number("longitude") > place[1]
    pad.move()
    alice.wait("place held", lambda: alice.number("speed") < 0.3)
    assert abs(alice.number("altitude") - height_m) < 1
    assert alice.word("mode") == "LOITER"
    alice.part("manual-toggle").click()
    expect_hold(alice, "you switched it off")

    # A pad that is unplugged or flaps: it never resumes by itself.
    begin(alice)
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    pad.move(left=(0, 1))
    alice.wait("climbing", lambda: alice.number("climb") > 0.5)
    pad.unplug()
    expect_hold(alice, "Test pad is gone")
    pad.move(left=(0, 1))
    expect(alice.part("manual-means")).to_contain_text("Test pad")
    expect(alice.part("holder")).to_have_attribute("data-value", "alice")
    # Reconnected, she has to move its sticks and start again herself, with centred sticks.
    expect(alice.part("manual-lack")).to_contain_text("right stick, sideways")
    pad.show_sticks()
    pad.move(left=(0, 1))
    begin(alice)
    expect(alice.part("manual-bars")).to_have_attribute("data-phase", "centring")
    pad.move()
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    pad.flap()
    expect_hold(alice, "Test pad was unplugged")
    expect(alice.part("holder")).to_have_attribute("data-value", "alice")

    # A button of the pad.
    pad.show_sticks()
    alice.part("stick-setup").click()
    alice.page.get_by_role("tab", name="Buttons").click()
    alice.part("pad-button-2").select_option("stop")
    expect(alice.part("sticks-state")).to_have_attribute("data-phase", "kept")
    alice.part("sticks-close").click()
    begin(alice)
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    pad.move(down=2)
    expect_hold(alice, "a button of the pad")
    pad.move()

    # A hidden tab.
    begin(alice)
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    pad.move(right=(0, 1))
    alice.wait("moving", lambda: alice.number("speed") > 1)
    alice.page.evaluate("""() => {
      Object.defineProperty(document, 'visibilityState', { value: 'hidden', configurable: true });
      document.dispatchEvent(new Event('visibilitychange'));
    }""")
    expect_hold(alice, "the page was hidden")


def test_touch_sticks_fly_and_spring_back(somebody: Somebody) -> None:
    alice = in_the_air(somebody, has_touch=True)
    alice.page.set_viewport_size({"width": 390, "height": 844})
    alice.open_panel("commands")
    alice.part("manual-means").select_option("touch")
    begin(alice)
    expect(alice.part("bar-state")).to_contain_text("LOITER")
    for width, height in ((390, 844), (768, 1024), (844, 390), (1180, 820)):
        alice.page.set_viewport_size({"width": width, "height": height})
        for part in ("touch-left", "touch-right", "touch-hold", "touch-end", "bar-hold", "bar-name", "bar-state"):
            expect_in_reach(alice, part)
        # Nothing scrolls the shell, and a focus far below does not either.
        moved = alice.page.evaluate(SCROLL_ALL)
        assert moved == 0, f"{width}x{height}: the page moved by {moved}"
        expect_in_reach(alice, "bar-hold")
    box = alice.part("touch-left").bounding_box()
    assert box is not None
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    alice.page.mouse.move(*middle)
    alice.page.mouse.down()
    alice.page.mouse.move(middle[0], middle[1] - 80)
    alice.wait("climbing", lambda: alice.number("altitude") > HEIGHT_M + 3)
    expect(alice.part("axis-throttle")).to_have_attribute("data-value", "1.00")
    alice.page.mouse.up()
    expect(alice.part("axis-throttle")).to_have_attribute("data-value", "0.00")
    alice.wait("height held", lambda: abs(alice.number("climb")) < 0.2)


def test_settings_of_sticks_are_kept_for_their_pilot_and_an_unknown_pad_is_set_up_first(
    somebody: Somebody, world: World
) -> None:
    here = signed_in(somebody, "alice", "Kestrel")
    pad = plugged_in(here)
    here.part("stick-setup").click()
    here.part("stick-mode").get_by_text("Mode 1").click()
    here.part("pad-invert-roll").check()
    here.part("pad-expo-pitch").fill("50")
    expect(here.part("sticks-state")).to_have_attribute("data-phase", "kept")

    there = signed_in(somebody, "alice", "Kestrel")
    pad = plugged_in(there)
    there.part("stick-setup").click()
    expect(there.part("stick-mode-words")).to_contain_text("left: pitch, yaw; right: throttle, roll")
    pad.move(left=(0, 1), right=(1, -1))
    for axis, value in (("pitch", "1.00"), ("throttle", "-1.00"), ("roll", "-1.00"), ("yaw", "0.00")):
        expect(there.part("setup-bars").get_by_test_id(f"axis-{axis}")).to_have_attribute("data-value", value)
    pad.move(left=(0, 0.54))  # half of the range beyond the dead zone: 0.5 * 0.5 + 0.5 * 0.5 ** 3
    expect(there.part("setup-bars").get_by_test_id("axis-pitch")).to_have_attribute("data-value", "0.31")

    world.start_simulated("Merlin", options=SIMULATOR)
    world.wait_until_online(world.visitor("admin"), 2)
    bob = signed_in(somebody, "bob", "Merlin")
    bob.acquire("Merlin")
    pad = FakePad(bob, mapping="")
    expect(bob.part("manual-lack")).to_have_attribute("data-lack", "unknown-layout")
    expect(bob.part("manual-toggle")).to_be_disabled()
    bob.part("stick-setup").click()
    expect(bob.part("stick-mode-words")).to_contain_text("left: throttle, yaw; right: pitch, roll")

    # A device of unknown layout is set up by moving it; a trigger that is pressed meanwhile is no stick.
    bob.part("calibration-start").click()
    words = bob.part("calibration-words")
    expect(words).to_contain_text("left stick all the way to the right")
    pad.trigger = -1
    pad.move()
    expect(bob.part("calibration-complaint")).to_contain_text("Axis 2 jumps, as a switch does")
    # Its sticks are swapped, and the right stick, now the left one, moves only half its range.
    moves = (
        ("left stick all the way to the right", {"right": (0.6, 0)}),
        ("left stick all the way up", {"right": (0, 0.6)}),
        ("right stick all the way to the right", {"left": (1, 0)}),
        ("right stick all the way up", {"left": (0, 1)}),
    )
    for sentence, sticks in moves:
        expect(words).to_contain_text(sentence)
        pad.sweep(**sticks)
        expect(words).not_to_contain_text(sentence)
        pad.move()
    for end in (1, -1):
        pad.sweep(left=(end, end), right=(0.6 * end, 0.6 * end))
    pad.move()
    bob.part("calibration-finish").click()
    picture = bob.part("setup-picture").get_by_test_id("picture-left").locator("svg")
    expect(picture).to_have_attribute("data-y", "0.00")
    pad.move(right=(0.3, 0.6))
    expect(picture).to_have_attribute("data-x", "0.50")
    expect(picture).to_have_attribute("data-y", "1.00")
    expect(bob.part("setup-bars").get_by_test_id("axis-throttle")).to_have_attribute("data-value", "1.00")
    expect(bob.part("sticks-state")).to_have_attribute("data-phase", "kept")
    pad.move()
    bob.part("sticks-close").click()
    expect(bob.part("manual-lack")).to_have_attribute("data-lack", "unmoved")
    pad.show_sticks()
    expect(bob.part("manual-lack")).to_have_count(0)
    expect(bob.part("manual-toggle")).to_be_enabled()


def test_a_question_goes_with_its_page_and_keys_are_sticks_in_any_layout(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice")
    alice.open_drone("Kestrel")
    alice.acquire("Kestrel")
    alice.part("manual-means").select_option("keyboard")
    dialog = alice.page.get_by_role("dialog")
    alice.part("manual-toggle").click()
    expect(dialog).to_contain_text("Fly Kestrel by hand?")
    alice.page.go_back()
    expect(alice.part("squad-row").first).to_be_visible()
    expect(dialog).to_have_count(0)

    alice.open_drone("Kestrel")
    begin(alice)
    expect(alice.part("manual-bars")).to_have_attribute("data-phase", "flying")
    # On Colemak, R is in the place of S. It must not request a return.
    alice.page.evaluate("window.dispatchEvent(new KeyboardEvent('keydown', { code: 'KeyS', key: 'r' }))")
    expect(alice.part("axis-throttle")).to_have_attribute("data-value", "-1.00")
    expect(dialog).to_have_count(0)
    # While Command is held, macOS never reports the key-up.
    alice.page.evaluate("window.dispatchEvent(new KeyboardEvent('keydown', { code: 'MetaLeft', key: 'Meta' }))")
    expect(alice.part("axis-throttle")).to_have_attribute("data-value", "0.00")
