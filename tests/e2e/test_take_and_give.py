"""Who may fly, on the screens of those concerned: losing the controls, regaining them, sharing them."""

import pytest
from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import World

ACTIONS = (
    "action-arm",
    "action-disarm",
    "action-takeoff",
    "action-goto",
)
OF_THE_BAR = ("bar-hold", "bar-return", "bar-land")


def expect_grey(console: ConsolePage) -> None:
    for action in (*ACTIONS, "manual-toggle"):
        expect(console.part(action)).to_be_disabled()
    for action in OF_THE_BAR:
        expect(console.part(action)).to_have_count(0)


def alice_and_admin(somebody: Somebody) -> tuple[ConsolePage, ConsolePage]:
    """alice has the controls of Kestrel, on the ground; both watch it."""
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    return alice, signed_in(somebody, "admin", "Kestrel")


def test_who_loses_the_controls_in_flight_sees_who_why_and_the_confirmed_hold(somebody: Somebody) -> None:
    alice, admin = alice_and_admin(somebody)
    alice.take_off("Kestrel", 8)
    admin.takes_from("alice", "Kestrel", reason="airspace closed")

    banner = alice.part("taken-banner")
    expect(banner).to_contain_text("admin took control of Kestrel from you")
    expect(banner).to_contain_text("UTC")
    expect(banner).to_contain_text("airspace closed")
    expect(banner).to_contain_text("You can still watch")
    expect(banner).to_have_attribute("role", "alert")
    expect_grey(alice)
    expect(alice.part("blocked-reason")).to_contain_text("taken from you")

    for console in (alice, admin):
        expect(console.part("hold-strip")).to_have_attribute("data-phase", "confirmed")
        expect(console.part("hold-strip")).to_contain_text("Hold confirmed in")
        expect(console.part("hold-cause")).to_contain_text("ordered by the tower: airspace closed")
        # In guided flight it already stays by itself, so the page must not report drift.
        expect(console.part("hold-drift")).to_have_count(0)
        expect(console.part("hold-banner")).to_contain_text("Kestrel holds: BRAKE, stays by itself.")
    assert abs(admin.number("altitude") - 8) < 2

    # She still watches and receives new frames.
    alice.frames_heard.clear()
    alice.wait("frames", lambda: alice.frames_heard[1] > 20)
    # On Missions the tools of the map do not lie over what she is told, nor it over them.
    alice.page.evaluate("window.location.hash = '#/missions/1'")
    expect(banner).to_be_visible()
    expect(alice.part("tool-item")).to_be_visible()
    covered = alice.part("tray").evaluate(
        """(tray) => [...tray.children].filter((one) => one.checkVisibility()).flatMap((one) => {
          const { left, top, right, bottom, width } = one.getBoundingClientRect();
          if (width < 10) return [];  // for screen readers
          return [[left + 4, top + 4], [right - 4, bottom - 4]].filter(([x, y]) => {
            const found = document.elementFromPoint(x, y);
            return !one.contains(found);
          }).map(() => one.textContent);
        })"""
    )
    assert covered == []
    assert [said for said in alice.complaints if "401" not in said] == []


def test_given_back_is_hers_only_once_she_has_accepted_with_centred_sticks(somebody: Somebody) -> None:
    alice, admin = alice_and_admin(somebody)
    admin.takes_from("alice", "Kestrel", reason="airspace closed")
    admin.gives_back("Kestrel")
    expect(alice.part("control-accept")).to_be_enabled()

    # An offer can be withdrawn.
    admin.part("control-keep").click()
    expect(alice.part("offer")).to_have_count(0)
    expect(alice.part("taken-banner")).to_be_visible()
    expect(admin.part("control-give")).to_be_enabled()
    expect_grey(alice)

    alice.page.evaluate(
        "window.pad = {id: 'A pad', mapping: 'standard', index: 0, connected: true, axes: [0, 1, 0, 0]};"
        "navigator.getGamepads = () => [window.pad]"
    )
    admin.gives_back("Kestrel")
    expect(alice.part("offer")).to_contain_text("admin gives you Kestrel back")
    expect(admin.part("offer-waiting")).to_contain_text("Waiting for alice to accept")
    expect_grey(alice)
    assert admin.part("holder").get_attribute("data-value") == "admin"
    expect(alice.part("offer-sticks")).to_contain_text("Centre the sticks: throttle")
    expect(alice.part("axis-throttle")).to_have_attribute("data-value", "-1.00")
    expect(alice.part("control-accept")).to_be_disabled()
    alice.page.evaluate("window.pad.axes[1] = 0.02")
    expect(alice.part("control-accept")).to_be_enabled()

    alice.part("control-accept").click()
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
    expect(alice.part("offer")).to_have_count(0)
    expect(alice.part("taken-banner")).to_have_count(0)
    expect(alice.part("action-arm")).to_be_enabled()
    expect(admin.part("holder")).to_have_attribute("data-value", "alice")
    expect(admin.part("action-arm")).to_be_disabled()


@pytest.mark.usefixtures("patient_drones")
def test_while_an_admin_assists_the_operator_waits_and_goes_on_by_herself(somebody: Somebody) -> None:
    alice, admin = alice_and_admin(somebody)
    admin.part("control-assist").click()
    admin.confirm("Kestrel")
    expect(alice.part("assist-banner")).to_contain_text("admin assists you with Kestrel")
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel, admin assists")
    expect(admin.part("bar-hold")).to_be_enabled()

    # Both move the sticks; the admin's pass.
    fly_by_hand(alice)
    fly_by_hand(admin)
    expect(alice.part("assist-banner")).to_contain_text("admin assists: your commands wait")
    expect(alice.part("blocked-reason")).to_contain_text("admin assists: your commands wait")
    for action in (*ACTIONS, "bar-return", "bar-land"):
        expect(alice.part(action)).to_be_disabled()
    refusal = alice.part("messages").get_by_test_id("message").filter(has_text="admin")
    expect(refusal.filter(has_text="assist").last).to_be_visible()

    # One second after the admin's last command her sticks pass again.
    admin.part("manual-toggle").click()
    expect(admin.part("manual-ended")).to_be_visible()
    expect(alice.part("assist-banner")).to_have_attribute("data-waits", "false")
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
    expect(alice.part("manual-bars")).to_have_attribute("data-phase", "flying")
    expect(alice.part("action-arm")).to_be_enabled()

    admin.part("control-unassist").click()
    expect(alice.part("assist-banner")).to_have_count(0)
    expect(admin.part("bar-hold")).to_have_count(0)


def fly_by_hand(console: ConsolePage) -> None:
    console.wait("the autopilot", lambda: console.word("mode") != "")
    console.part("manual-toggle").click()
    console.confirm("Kestrel")
    expect(console.part("manual-bars")).to_have_attribute("data-phase", "flying")


def test_who_is_no_longer_an_owner_or_is_disabled_is_told_so_at_once(somebody: Somebody, world: World) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    admin = world.visitor("admin")
    [owner] = admin.drone(1)["owners"]
    assert admin.ask("DELETE", f"/drones/1/owners/{owner['id']}").status == 200
    banner = alice.part("taken-banner")
    expect(banner).to_contain_text("Your controls of Kestrel were revoked by admin")
    expect(banner).to_contain_text("no longer an owner of this drone")
    expect(banner).to_contain_text("You can no longer see it")
    expect(alice.part("action-arm")).to_have_count(0)
    assert admin.drone(1)["holder"] is None

    assert admin.ask("PUT", f"/drones/1/owners/{owner['id']}").status == 200
    alice.page.reload()
    expect(alice.part("value-armed")).to_be_visible()
    alice.acquire("Kestrel")
    assert admin.ask("PATCH", f"/users/{owner['id']}", {"disabled": True}).status == 200
    farewell = alice.part("sign-in-problem")
    expect(farewell).to_contain_text("You were signed out: the account was disabled.")
    expect(farewell).to_contain_text("You have lost the controls of Kestrel")
    assert admin.drone(1)["holder"] is None


def test_taken_without_watching_freezes_and_covers_the_view(somebody: Somebody) -> None:
    alice, admin = alice_and_admin(somebody)
    alice.wait_for_frames()
    admin.takes_from("alice", "Kestrel", reason="inquiry", may_watch=False)
    expect(alice.part("view-cover")).to_contain_text("The view of Kestrel was taken too")
    expect(alice.part("taken-banner")).to_contain_text("The view was taken too")
    alice.frames_heard.clear()
    admin.frames_heard.clear()
    admin.wait("frames at the admin's", lambda: admin.frames_heard[1] > 100)
    assert alice.frames_heard[1] == 0

    # A person who is offered the controls sees the drone before accepting.
    admin.gives_back("Kestrel")
    expect(alice.part("offer")).to_be_visible()
    expect(alice.part("view-cover")).to_have_count(0)
    alice.wait("frames again", lambda: alice.frames_heard[1] > 20)
    admin.part("control-keep").click()
    expect(alice.part("view-cover")).to_be_visible()
    admin.gives_back("Kestrel")
    alice.part("control-accept").click()
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
    expect(alice.part("view-cover")).to_have_count(0)
