"""What a pilot sees of losses: hands off in manual flight, the tower lost, the check before flight, a rehearsal."""

import pytest
from console_page import Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import World, kill_9


@pytest.mark.usefixtures("patient_drones")
def test_flying_by_hand_ends_with_a_hold_when_the_window_is_left(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 8)
    alice.part("manual-toggle").click()
    # From GUIDED, which ignores sticks: the dialog names the mode it changes to.
    expect(alice.page.get_by_role("dialog")).to_contain_text("LOITER")
    alice.confirm("Kestrel")
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    alice.page.keyboard.down("KeyW")
    alice.wait("climbing", lambda: alice.number("altitude") > 10)
    expect(alice.part("axis-throttle")).to_have_attribute("data-value", "1.00")
    alice.page.evaluate("window.dispatchEvent(new Event('blur'))")
    expect(alice.part("manual-ended")).to_contain_text("the window lost the focus")
    expect(alice.part("manual-bars")).to_have_count(0)
    alice.wait("BRAKE", lambda: alice.word("mode") == "BRAKE")
    alice.wait("no more climbing", lambda: abs(alice.number("climb")) < 0.2)


def test_what_a_loss_would_do_is_said_before_and_counted_down_in_the_air(somebody: Somebody, world: World) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    expect(alice.part("loss-check-summary")).not_to_contain_text("reading")
    alice.part("loss-check").locator("summary").click()
    for about in ("loss-operator", "loss-tower"):
        expect(alice.part("loss-check").get_by_test_id(about).locator("li").first).to_be_visible()
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 8)
    expect(alice.part("countdown")).to_have_count(0)
    kill_9(world.tower)
    expect(alice.part("countdown")).to_contain_text("At the last contact, Kestrel was in GUIDED.")
    expect(alice.part("countdown")).to_contain_text("its agent will return it in about")
    expect(alice.part("countdown")).to_contain_text("if its agent is alive")
    expect(alice.part("bar-land")).to_be_disabled()
    before = int(alice.part("countdown").get_attribute("data-seconds") or 0)
    assert 0 < before <= 30
    alice.wait("counting", lambda: int(alice.part("countdown").get_attribute("data-seconds") or 0) < before)


@pytest.mark.usefixtures("patient_drones")
def test_an_admin_rehearses_on_the_ground_and_the_settings_decide_the_hold(somebody: Somebody) -> None:
    admin = signed_in(somebody, "admin", "Kestrel")
    admin.wait("the autopilot", lambda: admin.word("mode") != "")
    admin.part("rehearse").click()
    dialog = admin.page.get_by_role("dialog")
    expect(dialog).to_contain_text("on the ground, disarmed")
    expect(dialog).to_contain_text("For 4 s the tower is silent")
    admin.part("rehearse-tower").check()
    admin.part("rehearse-confirm").click()
    expect(admin.part("rehearsal")).to_have_attribute("data-phase", "not_needed")
    expect(admin.part("rehearsal")).to_contain_text("no hold was needed")
    expect(admin.part("rehearse")).to_be_enabled()

    admin.part("open-settings").click()
    admin.part("setting-lost_action_s").fill("0")
    admin.part("settings-save").click()
    expect(admin.part("fault-lost_action_s")).not_to_be_empty()
    admin.part("setting-lost_action_s").fill("45")
    admin.part("add-LOITER").click()
    admin.part("setting-stream_profile").select_option("thin")
    admin.part("settings-save").click()
    expect(admin.part("settings-done")).to_contain_text("Saved")
    admin.part("settings-close").click()
    expect(admin.part("thin-stream")).to_have_text("Thin stream: set by an admin")

    alice = signed_in(somebody, "alice", "Kestrel")
    alice.part("open-settings").click()
    expect(alice.part("setting-lost_action_s")).to_have_value("45")
    expect(alice.part("setting-lost_action_s")).to_be_disabled()
    expect(alice.part("hold-ladder")).to_contain_text("1. LOITER")
    expect(alice.part("settings-save")).to_have_count(0)
    alice.part("settings-close").click()

    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 8)
    # In guided flight it would stay as it is. By hand the loss ladder decides: without it, altitude hold.
    alice.part("manual-toggle").click()
    alice.confirm("Kestrel")
    expect(alice.part("manual-bars")).to_have_attribute("data-phase", "flying")
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    admin.takes_from("alice", "Kestrel")
    expect(alice.part("hold-strip")).to_contain_text("Hold confirmed in")
    expect(alice.part("hold-strip")).to_contain_text("LOITER")
    expect(alice.part("hold-drift")).to_have_count(0)


def test_a_rehearsal_shows_the_measured_time_to_the_hold(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 8)
    alice.part("rehearse").click()
    dialog = alice.page.get_by_role("dialog")
    expect(dialog).to_contain_text("Kestrel is in the air (in a simulator)")
    alice.part("rehearse-operator").check()
    alice.part("rehearse-confirm").click()
    expect(alice.part("rehearsal")).to_have_attribute("data-phase", "held")
    expect(alice.part("rehearsal")).to_contain_text("held after")
    expect(alice.part("hold-strip")).to_have_attribute("data-phase", "confirmed")
    expect(alice.part("rehearsal")).to_have_attribute("data-phase", "ended")
    expect(alice.part("rehearsal")).to_contain_text("ms")
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")


def test_a_drone_that_sends_too_much_is_limited_and_quarantined(somebody: Somebody) -> None:
    admin = signed_in(somebody, "admin", "Kestrel")
    admin.wait("the autopilot", lambda: admin.word("mode") != "")
    admin.part("open-restrain").click()
    dialog = admin.page.get_by_role("dialog")
    expect(dialog).to_contain_text("Texts of Kestrel, and its alerts that are not critical")
    admin.part("restrain-limited").check()
    admin.part("restrain-reason").fill("floods")
    expect(admin.part("restrain-take")).to_have_text("Limit Kestrel")
    admin.part("restrain-take").click()
    expect(admin.part("restraint")).to_have_text("The telemetry of Kestrel is limited. By admin: floods")

    admin.part("open-restrain").click()
    admin.part("restrain-quarantined").check()
    expect(admin.part("restrain-confirm")).to_have_count(0)
    admin.part("restrain-take").click()
    expect(admin.part("drone-state")).to_have_attribute("data-value", "lost")
    admin.part("open-restrain").click()
    admin.part("restraint-lift").click()
    expect(admin.part("restraint")).to_have_count(0)
    admin.wait("the autopilot again", lambda: admin.word("mode") != "")

    alice = signed_in(somebody, "alice", "Kestrel")
    expect(alice.part("open-settings")).to_be_visible()
    expect(alice.part("open-restrain")).to_have_count(0)
