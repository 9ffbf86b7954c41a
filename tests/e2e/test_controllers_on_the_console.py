"""A controller on board, started and watched on the Control page, and ended by a hold."""

from typing import Any, Final

from console_page import Somebody, signed_in
from playwright.sync_api import expect

IS_DRAWN_ON: Final = """(canvas) =>
  canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((byte) => byte > 0)"""


def finding(number: int, letter: str) -> dict[str, Any]:
    """As the tower reports it, near the home of the simulator."""
    place = {"lat_deg": 47.3977 + number * 2e-4, "lon_deg": 8.5456}
    at = f"2026-01-01T12:00:0{number}Z"
    return {"number": number, "at": at, "letter": letter, "confidence": 0.9, "thumbnail": "", **place}


def test_what_was_found_is_listed_and_on_the_map(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel", has_map=True)
    expect(alice.part("findings-canvas")).to_have_count(0)
    found = [finding(2, "K"), finding(1, "")]
    alice.page.route("**/controller/findings", lambda route: route.fulfill(json=found))
    alice.page.reload()
    canvas = alice.part("findings-canvas")
    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") > 40)
    alice.wait("the letters on the map", lambda: canvas.evaluate(IS_DRAWN_ON) is True)
    alice.part("controllers").locator("summary").click()
    expect(alice.part("finding")).to_contain_text(["Target K, confidence 90 %", "Target without a letter"])


def test_the_holder_starts_a_controller_and_a_hold_ends_it(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") > 40)
    panel = alice.part("controllers")
    panel.locator("summary").click()
    name = alice.part("controller-name")
    expect(name.locator("option")).to_have_text(["Choose…", "challenge", "scripted"])
    name.select_option("scripted")
    start = alice.part("controller-start")
    expect(start).to_be_disabled()
    alice.acquire("Kestrel")
    alice.part("controller-maxSpeedMS").fill("99")
    expect(start).to_be_disabled()
    alice.part("controller-maxSpeedMS").fill("2")
    alice.part("controller-take-off").check()

    def flies() -> bool:
        """Starts it again while the autopilot is not ready to arm."""
        if alice.part("controller-running").count() == 0:
            start.click()
            alice.confirm("Kestrel")
            expect(alice.part("controller-running")).to_be_visible()
        phase = alice.part("controller-phase")
        return phase.count() == 1 and "set-points" in phase.inner_text()

    alice.wait("the controller to fly", flies)
    expect(alice.part("controller-running")).to_contain_text("left, started by alice")
    alice.part("bar-hold").click()
    expect(alice.part("controller-running")).to_have_count(0)
    expect(alice.part("controller-end")).to_contain_text("The last one:")
    expect(alice.part("controller-name")).to_be_visible()


def test_the_settings_are_a_form_that_names_the_wrong_field(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.part("controllers").locator("summary").first.click()
    alice.part("controller-name").select_option("scripted")
    expect(alice.part("controller-settings")).to_have_count(0)
    expect(alice.page.locator("[data-setting]")).to_have_count(0)
    alice.part("controller-name").select_option("challenge")
    height, letter = alice.part("setting-search_height_m"), alice.part("setting-letter")
    expect(height).to_have_value("10")
    expect(alice.page.locator("[data-setting=search_height_m]")).to_contain_text("From 2 m to 60 m. Default: 10 m.")
    fault = alice.part("controller-fault")
    height.fill("99")
    expect(fault).to_have_text("Search height: From 2 m to 60 m.")
    expect(height).to_have_attribute("aria-invalid", "true")
    height.fill("12")
    expect(fault).to_have_count(0)
    letter.fill("k!")
    expect(letter).to_have_value("K!")
    expect(fault).to_contain_text("Characters sought: “!” cannot be in it.")
    letter.fill("k")
    expect(fault).to_have_count(0)
    alice.part("settings-rare").locator("summary").click()
    expect(alice.part("setting-camera").locator("option")).to_have_text(["The first"])
    alice.acquire("Kestrel")
    alice.part("controller-start").click()
    alice.confirm("Kestrel")
    expect(alice.part("controller-end")).to_contain_text("not in the air")
