"""The flight screen at every size: how much of it the map has, panels, the menu of a pressed place, bar, switcher."""

from collections.abc import Iterator
from typing import Final

import pytest
from console_page import SIMULATOR, ConsolePage, Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import World

SIZES: Final = ((1440, 900), (1024, 768), (390, 844))
PHONE_HEAD_PX: Final = 120
AT_TOP: Final = """(part) => {
  const { left, top, width, height } = part.getBoundingClientRect();
  const above = document.elementFromPoint(left + width / 2, top + height / 2);
  return above !== null && (part === above || part.contains(above));
}"""
"""Whether nothing covers the middle of it."""
SCREENS: Final = ((2560, 1440), (1440, 900), (1024, 768), (844, 390), (390, 844))
LEAST_SHARE: Final = 0.85
LEAST_TYPE_PX: Final = 14
PANELS: Final = ("values", "link", "messages", "commands", "checks")
WIDE_PX: Final = 1100
"""From this width on all panels are open until they are closed; below, one at a time."""
SMALL_TEXTS: Final = """(least) => {
  const all = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const small = [];
  for (let text = all.nextNode(); text !== null; text = all.nextNode()) {
    const of = text.parentElement;
    const range = document.createRange();
    range.selectNodeContents(text);
    const { width, height } = range.getBoundingClientRect();
    if (text.textContent.trim() === '' || width * height === 0 || of.closest('.visually-hidden, option')) continue;
    if (!of.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
    const drawing = of.closest('svg[viewBox]');
    const scale = drawing ? drawing.getBoundingClientRect().width / drawing.viewBox.baseVal.width : 1;
    const px = parseFloat(getComputedStyle(of).fontSize) * scale;
    if (px < least - 0.05) small.push(`${px.toFixed(1)} px: ${text.textContent.trim()}`);
  }
  return small;
}"""
"""Every visible text of the page, those of drawings as large as they are drawn."""
IN_SIGHT: Final = """(part) => {
  const { left, top, right, bottom } = part.getBoundingClientRect();
  return left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight;
}"""
SHARE: Final = r"""() => {
  const VIEWS = '[data-testid=map], [data-testid=video-view]';
  const STEPS = 60;
  const alpha = (one) => {
    const colour = getComputedStyle(one).backgroundColor;
    return /rgba|\//.test(colour) ? Number(/([\d.]+)\)$/.exec(colour)[1]) : 1;
  };
  // A button or an instrument floats; what is wider is a bar or a panel.
  const hides = (one) => one.clientWidth > Math.max(180, innerWidth / 5) && alpha(one) > 0.7;
  let seen = 0;
  for (let x = 0.5; x < STEPS; x++)
    for (let y = 0.5; y < STEPS; y++) {
      const there = document.elementsFromPoint((x * innerWidth) / STEPS, (y * innerHeight) / STEPS);
      seen += there.find((one) => one.closest(VIEWS) || hides(one))?.closest(VIEWS) ? 1 : 0;
    }
  return seen / STEPS ** 2;
}"""
"""The share of the window in which map or video is seen, buttons and instruments on it included."""
STAY: Final = ("open-restrain", "open-settings", "rehearse", "control-acquire", "action-arm", "takeoff-height")
PLACE_BUTTONS: Final = (
    *("goto-confirm", "orbit-confirm", "land-at-confirm"),
    *("roi-confirm", "home-confirm", "place-measure"),
)
SETTLED_MS: Final = 6_000
HAS_PX4: Final = ("--flavour", "px4")


@pytest.fixture
def px4_world(quiet_world: World) -> Iterator[World]:
    quiet_world.start_simulated("Kestrel", options=(*SIMULATOR, *HAS_PX4))
    quiet_world.wait_until_online(quiet_world.visitor("admin"), 1)
    yield quiet_world


@pytest.fixture
def px4(px4_world: World, somebody_early: Somebody) -> ConsolePage:
    alice = signed_in(somebody_early, "alice", "Kestrel", has_map=True)
    alice.acquire("Kestrel")
    alice.wait("its home", lambda: alice.word("distance-to-home") != "")
    alice.take_off("Kestrel", 10)
    return alice


def test_a_pressed_place_stays_in_sight_and_offers_what_the_vehicle_can(px4: ConsolePage) -> None:
    for width, height in SIZES:
        px4.page.set_viewport_size({"width": width, "height": height})
        box = px4.part("map").bounding_box()
        assert box is not None
        px4.press_map(0.6, 0.6)
        menu = px4.part("map-menu")
        panel = menu.bounding_box()
        assert panel is not None
        assert panel["y"] - box["y"] >= 60 or panel["x"] - box["x"] >= 60, f"{width}: no room for the place"
        if width > 600:  # on a phone the map moves up to make room (beside_target.test.ts)
            x, y = box["x"] + box["width"] * 0.6, box["y"] + box["height"] * 0.6
            inside = panel["x"] < x < panel["x"] + panel["width"] and panel["y"] < y < panel["y"] + panel["height"]
            assert not inside, f"{width}: the menu covers the place"
        for part in (
            "goto-confirm",
            "orbit-confirm",
            "land-at-confirm",
            "roi-confirm",
            "home-confirm",
            "place-measure",
        ):
            assert px4.part(part).evaluate(AT_TOP), f"{width}: {part} is covered"
        px4.page.keyboard.press("Escape")
        expect(menu).to_have_count(0)

    # Two presses circle; the height is typed while the place is in sight, and Enter goes there.
    px4.page.set_viewport_size({"width": 1440, "height": 900})
    px4.press_map(0.6, 0.6)
    px4.part("orbit-confirm").click()
    px4.wait("ORBIT", lambda: "ORBIT" in px4.word("mode"))
    px4.press_map(0.4, 0.6)
    expect(px4.part("goto-height")).to_be_focused()
    px4.page.keyboard.type("14")
    px4.page.keyboard.press("Enter")
    expect(px4.part("map-menu")).to_have_count(0)
    expect(px4.part("bar-answer")).to_contain_text("Go to")
    px4.wait("14 m", lambda: abs(px4.number("altitude") - 14) < 0.5)
    # The distance is measured from the place on.
    px4.press_map(0.45, 0.8)
    px4.part("place-measure").click()
    box = px4.part("map").bounding_box()
    assert box is not None
    px4.page.mouse.click(box["x"] + box["width"] * 0.6, box["y"] + box["height"] * 0.7)
    px4.wait("a distance", lambda: float(px4.part("map-measured").get_attribute("data-metres") or 0) > 10)
    expect(px4.part("map-menu")).to_have_count(0)
    px4.page.keyboard.press("Escape")
    expect(px4.part("map-measured")).to_have_count(0)


def test_land_here_is_held_flies_there_and_lands(px4: ConsolePage) -> None:
    px4.press_map(0.55, 0.6)
    lat, lon = (float(px4.part("map-menu").get_attribute(f"data-{axis}") or 0) for axis in ("lat", "lon"))
    px4.part("land-at-confirm").click()  # a short press only says so
    expect(px4.part("land-at-confirm-hint")).to_contain_text("Hold for 1 second")
    expect(px4.part("land-at")).to_have_count(0)
    px4.part("land-at-confirm").hover()
    px4.page.mouse.down()
    expect(px4.part("map-menu")).to_have_count(0)  # it closes when the button has acted
    px4.page.mouse.up()
    expect(px4.part("land-at-phase")).to_contain_text("then it lands")
    px4.wait("LAND", lambda: px4.word("mode") == "LAND", timeout_s=90)
    assert px4.distance_m(lat, lon) < 4
    expect(px4.part("land-at")).to_have_count(0)


@pytest.mark.drones("Kestrel", "Merlin")
def test_the_bar_has_what_is_needed_on_a_phone_and_changes_the_drone_only_when_told(somebody: Somebody) -> None:
    admin = signed_in(somebody, "admin", "Kestrel")
    admin.acquire("Kestrel")
    admin.take_off("Kestrel", 6)
    admin.page.set_viewport_size({"width": 390, "height": 844})
    main = admin.page.locator("main").bounding_box()
    assert main is not None and main["y"] <= PHONE_HEAD_PX
    for part in ("name", "state", "battery", "hold", "return", "land", "switch", "alerts"):
        expect(admin.part(f"bar-{part}")).to_be_visible()
        assert admin.part(f"bar-{part}").evaluate(AT_TOP), part
    # The pages are one press away.
    expect(admin.part("open-search")).not_to_be_visible()
    admin.part("bar-pages").click()
    expect(admin.part("open-search")).to_be_visible()
    expect(admin.part("user-menu")).to_be_visible()

    # By keyboard, from another page: one's own first, then the others with what they do.
    admin.page.evaluate("window.location.hash = '#/'")
    expect(admin.part("open-search")).not_to_be_visible()
    admin.page.evaluate("document.activeElement?.blur()")
    admin.page.keyboard.press("x")
    listed = admin.part("switch-drone")
    expect(listed).to_have_count(2)
    expect(listed.first).to_contain_text("Kestrel")
    expect(listed.first).to_contain_text("You control it")
    expect(listed.last).to_contain_text("Controls: Free")
    admin.page.keyboard.press("ArrowDown")
    admin.page.keyboard.press("Enter")
    expect(admin.part("bar-other")).to_contain_text("Merlin")
    # What ends a flight is still for the drone that is flown.
    expect(admin.part("flight-bar")).to_have_attribute("data-drone-id", "1")
    admin.ends_flight("land")
    expect(admin.part("bar-answer")).to_contain_text("Land")
    admin.page.evaluate("window.location.hash = '#/drone/1'")
    admin.wait("LAND", lambda: admin.word("mode") == "LAND")


def test_the_map_fills_the_screen_and_panels_lie_over_it(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 6)
    for width, height in SCREENS:
        alice.page.set_viewport_size({"width": width, "height": height})
        where = f"{width}x{height}"
        is_wide = width >= WIDE_PX
        for name in PANELS:
            panel, switch = alice.part(f"sheet-{name}"), alice.part(f"panel-{name}")
            if switch.get_attribute("aria-expanded") == "false":
                switch.click()
            expect(panel).to_be_visible()
            for part in ("bar-name", "bar-state", "bar-hold", "bar-return", "bar-land"):
                shown = alice.part(part)
                assert shown.evaluate(IN_SIGHT) and shown.evaluate(AT_TOP), f"{where}, {name}: {part} is covered"
            assert alice.page.evaluate(SMALL_TEXTS, LEAST_TYPE_PX) == [], f"{where}, {name}"
            if is_wide:
                continue
            # One at a time: Escape within it closes it, and the focus is where it opens again.
            alice.part(f"close-{name}").focus()
            alice.page.keyboard.press("Escape")
            expect(panel).to_be_hidden()
            expect(switch).to_be_focused()
        if is_wide:
            for name in PANELS:
                expect(alice.part(f"sheet-{name}")).to_be_visible()
                alice.part(f"close-{name}").click()
        assert alice.page.evaluate(SMALL_TEXTS, LEAST_TYPE_PX) == [], where
        share = alice.page.evaluate(SHARE)
        assert share >= LEAST_SHARE, f"{where}: the map has {share:.3f}"
        print(f"{where}: {share:.3f}")
    # As they were left.
    alice.page.set_viewport_size({"width": 1440, "height": 900})
    alice.part("panel-checks").click()
    alice.page.reload()
    expect(alice.part("sheet-checks")).to_be_visible()
    expect(alice.part("sheet-commands")).to_be_hidden()
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
    # A key for a field opens the panel of the field.
    alice.page.keyboard.press("t")
    expect(alice.part("takeoff-height")).to_be_focused()
    expect(alice.part("sheet-commands")).to_be_visible()


def test_nothing_moves_under_the_pointer_once_the_page_is_open(somebody: Somebody) -> None:
    admin = signed_in(somebody, "admin", "Kestrel")
    admin.page.reload()
    places = lambda: {part: admin.part(part).bounding_box() for part in STAY}  # noqa: E731
    for part in STAY:
        expect(admin.part(part)).to_be_visible()
    first = places()
    admin.wait("the checks", lambda: "reading" not in admin.part("loss-check-summary").inner_text())
    admin.page.wait_for_timeout(SETTLED_MS)
    assert places() == first
    # Nor when the connection goes: the reason has room for two lines.
    admin.page.context.set_offline(True)
    expect(admin.part("blocked-reason")).to_contain_text("The connection to the tower is down")
    assert places() == first
