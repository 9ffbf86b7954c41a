"""Before the first flight: the vehicle's set-up by its page, and the checklist that a pilot signs."""

import re

from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import World

POSES = ("level", "left side", "right side", "nose down", "nose up", "on its back")


def _chooses_values(alice: ConsolePage) -> None:
    """The tower keeps them: another browser would show the same."""
    alice.part("choose-values").click()
    for name in ("Vibration, worst axis", "GPS_RAW_INT.eph"):
        alice.part("add-value-name").fill(name)
        alice.part("add-value").click()
    row = alice.page.locator('[data-testid="value-row"][data-id="vibration"]')
    row.get_by_label("Display of Vibration, worst axis").select_option("gauge")
    row.get_by_label("red above, metric").fill("0.001")
    row.get_by_role("button", name="Move Vibration, worst axis: arrow up, arrow down", exact=True).focus()
    for _ in range(alice.part("value-row").count()):  # to the top, with the keyboard alone
        alice.page.keyboard.press("ArrowUp")
    expect(alice.part("value-row").first).to_have_attribute("data-id", "vibration")
    rows = alice.part("value-row")
    rows.nth(1).locator(".name").drag_to(rows.nth(3).locator(".name"))
    expect(rows.nth(3)).to_have_attribute("data-id", "mode")
    with alice.page.expect_response("**/api/v1/me/preferences/values"):
        alice.part("layout-name").fill("night")
        alice.part("save-layout").click()
    alice.part("values-close").click()
    alice.page.evaluate("localStorage.clear()")
    alice.page.reload()
    expect(alice.part("value-vibration")).to_have_class(re.compile("danger"))
    expect(alice.part("value-GPS_RAW_INT.eph")).to_be_visible()


def test_a_vehicle_is_set_up_on_the_ground_and_signed_for(somebody: Somebody, world: World) -> None:
    alice = signed_in(somebody, "alice")
    page = alice.page
    alice.open_drone("Kestrel")
    page.evaluate("window.location.hash = '#/drone/1/setup'")
    expect(alice.part("setup-blocked")).to_contain_text("Take control")
    expect(alice.part("calibrate-level")).to_be_disabled()
    alice.part("control-acquire").click()
    expect(alice.part("setup-blocked")).to_be_empty()

    alice.part("calibrate-level").click()
    expect(alice.part("calibration-ended")).to_contain_text("Level of Kestrel: calibrated.")

    alice.part("calibrate-accelerometer").click()
    for number, words in enumerate(POSES, 1):
        expect(alice.part("accel-guide")).to_have_attribute("data-pose", str(number))
        expect(alice.part("accel-pose")).to_contain_text(words)
        alice.part("accel-pose").click()
    expect(alice.part("accel-guide")).to_contain_text("The accelerometer of Kestrel is calibrated.")

    alice.part("calibrate-compass").click()
    expect(alice.part("compass")).to_have_count(3)
    expect(alice.part("compass-keep")).to_be_disabled()
    expect(alice.part("compass-keep")).to_be_enabled()
    alice.part("compass-keep").click()
    expect(alice.part("calibration-ended")).to_contain_text("Reboot Kestrel before it flies")

    # The autopilot says why it does not arm, in the checklist too.
    page.evaluate("window.location.hash = '#/drone/1'")
    alice.part("preflight-summary").click()
    arming = page.locator('[data-testid="preflight-line"][data-key="arming"]')
    expect(arming).to_have_attribute("data-state", "bad")

    page.evaluate("window.location.hash = '#/drone/1/setup/reboot'")
    alice.part("reboot").click()
    alice.confirm("Kestrel")
    expect(alice.part("action-report")).to_contain_text("rebooting")

    page.evaluate("window.location.hash = '#/drone/1/setup/motors'")
    expect(alice.part("setup-blocked")).to_be_empty()
    expect(alice.part("motor-2")).to_be_disabled()
    alice.part("propellers-off").fill("Merlin")
    expect(alice.part("motor-2")).to_be_disabled()
    alice.part("propellers-off").fill("Kestrel")
    alice.part("motor-2").click()
    expect(alice.part("motor-2-hint")).to_have_text("Hold for 1 second.")
    alice.hold("motor-2")
    expect(alice.part("action-report")).to_contain_text("turning motor 2 at 5 % for 1 s")

    page.evaluate("window.location.hash = '#/drone/1/setup/failsafes'")
    field = alice.part("value-of-FS_GCS_ENABLE")
    expect(field).to_be_visible()
    field.select_option("1")
    alice.part("write-parameters").click()
    alice.confirm("Kestrel")
    expect(alice.part("operation")).to_have_attribute("data-state", "done")
    page.evaluate("window.location.hash = '#/drone/1/setup/signing'")
    for opener, signing in (("signing-new-key", "on"), ("signing-remove", "off")):
        alice.part(opener).click()
        alice.confirm("Kestrel")
        expect(alice.part("signing-state")).to_have_attribute("data-signing", signing)
        expect(alice.part("operation")).to_have_attribute("data-state", "done")
    page.evaluate("window.location.hash = '#/drone/1/setup/radio'")
    expect(alice.part("radio-channel").first).to_be_visible()
    alice.part("radio-begin").click()
    alice.part("radio-end").click()
    expect(alice.part("radio-write")).to_be_disabled()  # no stick was moved

    page.evaluate("window.location.hash = '#/drone/1'")
    alice.wait("a position", lambda: alice.number("latitude") > 40)
    alice.part("preflight-summary").click()
    expect(arming).to_have_attribute("data-state", "good")
    alice.part("edit-drone-lines").click()
    alice.part("preflight-lines").fill("Propellers tight\nBattery latched")
    alice.part("preflight-lines-keep").click()
    expect(alice.part("preflight-own")).to_have_count(2)
    expect(alice.part("preflight-sign")).to_be_disabled()
    for line in alice.part("preflight-own").all():
        line.check()
    alice.part("preflight-sign").click()
    expect(alice.part("preflight-summary")).to_have_text("signed by alice")

    _chooses_values(alice)
    alice.hold_take_off("Kestrel")
    alice.wait("the take-off", lambda: alice.number("altitude") > 2)
    page.evaluate("window.location.hash = '#/drone/1/setup/motors'")
    expect(alice.part("setup-blocked")).to_contain_text("Kestrel is armed")
    alice.part("propellers-off").fill("Kestrel")
    expect(alice.part("motor-2")).to_be_disabled()
    answer = page.request.post(
        f"{alice.address}/api/v1/drones/1/commands",
        data={"command": "calibrate", "sensor": "level"},
        headers={"Origin": alice.address},
    )
    assert answer.json()["type"] == "/problems/not-on-the-ground"
