"""What people see of a hold that nobody ends: the countdown, "stay", and the final action of the drone."""

import time

from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect

LOST_ACTION_S = 12


def taken_in_flight(somebody: Somebody) -> tuple[ConsolePage, ConsolePage]:
    """alice flew Kestrel; an admin took control and does nothing. Both watch it."""
    alice = signed_in(somebody, "alice", "Kestrel")
    admin = signed_in(somebody, "admin", "Kestrel")
    admin.part("open-settings").click()
    admin.part("setting-lost_action_s").fill(str(LOST_ACTION_S))
    admin.part("settings-save").click()
    expect(admin.part("settings-done")).to_contain_text("Saved")
    admin.part("settings-close").click()
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 8)
    admin.takes_from("alice", "Kestrel")
    return alice, admin


def seconds(console: ConsolePage) -> int:
    return int(console.part("hold-banner").get_attribute("data-seconds") or -1)


def test_an_idle_admin_reads_the_countdown_and_stay_ends_it(somebody: Somebody) -> None:
    alice, admin = taken_in_flight(somebody)
    for console in (alice, admin):
        banner = console.part("hold-banner")
        expect(banner).to_have_attribute("data-phase", "counting")
        expect(banner).to_contain_text("Kestrel returns in")
        expect(banner).to_contain_text("nobody flies it")
    first = seconds(admin)
    over_s = time.monotonic() + LOST_ACTION_S + 1
    assert 0 < first <= LOST_ACTION_S + 1, "whole seconds, rounded up, by a clock that is a little behind"
    admin.wait("counting down", lambda: 0 <= seconds(admin) < first)
    admin.part("bar-alerts").click()
    alert = admin.part("alert").filter(
        has_text="Nobody flies Kestrel (admin has the controls and does not fly it). It returns at"
    )
    expect(alert).to_have_attribute("data-severity", "warning")
    admin.page.keyboard.press("Escape")

    # A person who was locked out cannot use "stay"; the admin can, also by keyboard.
    expect(alice.part("stay")).to_have_count(0)
    stay = admin.page.get_by_role("button", name="Stay: Kestrel stays where it is")
    stay.focus()
    admin.page.keyboard.press("Enter")
    for console in (alice, admin):
        expect(console.part("hold-banner")).to_have_attribute("data-phase", "stayed")
        expect(console.part("hold-banner")).to_contain_text(
            "Kestrel stays for ten minutes, or until the battery is needed for the way home"
        )
    expect(admin.part("stay")).to_have_count(0)
    admin.wait("the time to be over", lambda: time.monotonic() > over_s)
    expect(admin.part("hold-banner")).to_have_attribute("data-phase", "stayed")
    assert admin.word("mode") not in ("RTL", "LAND")
    assert abs(admin.number("altitude") - 8) < 2


def test_a_drone_that_nobody_flies_returns_and_everybody_was_told(somebody: Somebody) -> None:
    alice, admin = taken_in_flight(somebody)
    expect(alice.part("hold-banner")).to_have_attribute("data-phase", "counting")
    admin.page.goto(f"{admin.address}/#/")
    row = admin.part("row-hold").first
    expect(row).to_contain_text("Returns in")
    expect(admin.part("squad").get_by_test_id("stay")).to_be_visible()
    alice.wait("the return", lambda: alice.word("mode") == "RTL")
    expect(alice.part("hold-banner")).to_contain_text(f"Kestrel returns: nobody flew it for {LOST_ACTION_S} s")
    expect(row).to_contain_text("Returns, by itself")
    expect(
        admin.part("alert").filter(has_text="It returns: nobody flew it (admin has the controls and does not fly it).")
    ).to_be_visible()


def test_a_take_during_a_return_asks_first_and_lets_it_finish(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    admin = signed_in(somebody, "admin", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 30)
    alice.ends_flight("return")
    admin.wait("RTL", lambda: admin.word("mode") == "RTL")
    admin.part("control-take").click()
    dialog = admin.page.get_by_role("dialog")
    expect(dialog).to_contain_text("Kestrel is returning by itself (RTL)")
    expect(dialog.get_by_test_id("confirm-button")).to_have_text("Take control and let it finish")
    expect(dialog.get_by_test_id("confirm-button")).to_be_focused()
    admin.page.keyboard.press("Enter")
    expect(admin.part("holder")).to_have_attribute("data-value", "admin")
    expect(admin.part("hold-strip")).to_contain_text("No hold was needed")
    assert admin.word("mode") == "RTL"


def test_an_emergency_take_stops_a_return(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    admin = signed_in(somebody, "admin", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 30)
    alice.ends_flight("return")
    admin.wait("RTL", lambda: admin.word("mode") == "RTL")
    admin.part("control-take-emergency").click()
    expect(admin.page.get_by_role("dialog")).to_contain_text("even during a return or a landing")
    admin.confirm("Kestrel")
    expect(admin.part("hold-strip")).to_have_attribute("data-phase", "confirmed")
    expect(admin.part("hold-banner")).to_contain_text("nobody flies it")
    admin.wait("a hold in place of the return", lambda: admin.word("mode") not in ("RTL", ""))
