"""The squad on the map and in the list."""

from console_page import Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import World


def test_the_map_goes_to_a_squad_that_gets_its_first_position_after_sign_in(
    somebody_early: Somebody, quiet_world: World
) -> None:
    admin = signed_in(somebody_early, "admin")
    quiet_world.start_simulated("Kestrel", "Merlin", options=("--boot-s", "3", "--seed", "7"))

    def shows_the_squad() -> bool:
        lat, lon, zoom = (admin.part("map").get_attribute(f"data-{name}") or "0" for name in ("lat", "lon", "zoom"))
        return abs(float(lat) - 47.3977) < 0.01 and abs(float(lon) - 8.5456) < 0.01 and float(zoom) > 12

    admin.wait("the map at the squad", shows_the_squad)


def test_the_squad_is_searched_filtered_and_sorted(somebody: Somebody) -> None:
    admin = signed_in(somebody, "admin")
    expect(admin.part("squad-row")).to_have_count(2)
    admin.part("squad-search").fill("merl")
    expect(admin.part("squad-row")).to_have_count(1)
    assert admin.squad() == ["2"]
    admin.part("squad-search").fill("")
    admin.part("squad-filter").select_option(label="In the air")
    expect(admin.part("squad-row")).to_have_count(0)
    admin.part("squad-filter").select_option(label="All drones")
    admin.part("squad-view").get_by_text("Table").click()
    # By name already: pressed again it is the other way round.
    admin.part("sort-name").click()
    expect(admin.page.get_by_role("columnheader", name="Drone")).to_have_attribute("aria-sort", "descending")
    assert admin.squad() == ["2", "1"]


def test_a_hold_of_several_drones_is_asked_once_and_answered_by_each(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    admin = signed_in(somebody, "admin", "Merlin")
    admin.acquire("Merlin")
    admin.wait("the autopilot", lambda: admin.word("mode") != "")
    admin.open("/#/")
    admin.part("choose-all").check()
    admin.part("squad-hold").click()
    dialog = admin.page.get_by_role("dialog", name="Hold 2 drones?")
    expect(dialog).to_contain_text("Merlin")
    expect(dialog).to_contain_text("alice has the controls")
    admin.part("confirm-button").click()
    kestrel, merlin = (dialog.locator(f"[data-drone-id='{number}']") for number in (1, 2))
    expect(kestrel).to_have_attribute("data-value", "refused")
    expect(kestrel).to_contain_text("alice has the controls")
    expect(merlin).to_have_attribute("data-value", "done")
    expect(admin.part("squad-action-state")).to_contain_text("1 of 2 done")
    admin.part("cancel-button").click()
    expect(dialog).to_have_count(0)
    # The refused one still is who it was, and can be taken from the list of pairs.
    admin.part("tab-pairs").click()
    pair = admin.part("pair").and_(admin.page.locator("[data-drone-id='1']"))
    expect(pair).to_contain_text("alice")
    pair.get_by_test_id("pair-take").click()
    expect(admin.page.get_by_role("dialog")).to_contain_text("on the ground with its motors off")
    admin.confirm("Kestrel")
    expect(pair).to_contain_text("taken from alice")
    expect(alice.part("taken-banner")).to_contain_text("admin took the controls of Kestrel")


def test_an_alert_stays_until_it_is_acknowledged(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.part("mode-select").select_option(label="RTL")
    alice.part("action-mode").click()
    alice.wait("RTL", lambda: alice.word("mode") == "RTL")
    alice.part("action-arm").click()
    alice.confirm("Kestrel")
    # Said by the autopilot, on whatever page one is.
    expect(alice.part("alert-bell")).to_contain_text("alert")
    alice.part("alert-bell").click()
    alert = alice.part("alert").filter(has_text="Arm")
    expect(alert.first).to_have_attribute("data-open", "true")
    alice.part("acknowledge-all").click()
    expect(alert.first).to_have_attribute("data-open", "false")
    expect(alice.part("alert-bell")).to_contain_text("No alerts")
