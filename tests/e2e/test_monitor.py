"""The squad on the map and in the list: three drones of two owners."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from console_page import SIMULATOR, ConsolePage, Somebody, signed_in
from playwright.sync_api import Locator, expect
from worlds.processes import World

SQUAD = ("Kestrel", "Merlin", "Plover")


@pytest.fixture
def quiet_world(tmp_path: Path, prepared_folder: Path) -> Iterator[World]:
    """A tower where bob has a second drone, Plover (3), and none is switched on."""
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    with World(tmp_path, prepared=True) as world:
        assert world.add_drone("Plover", "bob") == 3
        world.start_tower()
        yield world


@pytest.fixture
def world(quiet_world: World) -> World:
    quiet_world.start_simulated(*SQUAD, options=SIMULATOR)
    quiet_world.wait_until_online(quiet_world.visitor("admin"), 1, 2, 3)
    return quiet_world


def row_of(console: ConsolePage, drone_id: int) -> Locator:
    return console.part("squad-row").and_(console.page.locator(f"[data-drone-id='{drone_id}']"))


def test_the_map_goes_to_a_squad_that_gets_its_first_position_after_sign_in(
    somebody_early: Somebody, quiet_world: World
) -> None:
    admin = signed_in(somebody_early, "admin", has_map=True)
    quiet_world.start_simulated(*SQUAD, options=("--boot-s", "3", "--seed", "7"))

    def shows_the_squad() -> bool:
        lat, lon, zoom = (admin.part("map").get_attribute(f"data-{name}") or "0" for name in ("lat", "lon", "zoom"))
        return abs(float(lat) - 47.3977) < 0.01 and abs(float(lon) - 8.5456) < 0.01 and float(zoom) > 12

    admin.wait("the map at the squad", shows_the_squad)


def test_a_squad_of_three_is_seen_searched_and_sorted_and_an_alert_of_it_acknowledged(somebody: Somebody) -> None:
    admin = signed_in(somebody, "admin")
    expect(admin.part("squad-row")).to_have_count(3)
    admin.wait_for_frames(3)
    for drone_id, owner in ((1, "alice"), (2, "bob"), (3, "bob")):
        row = row_of(admin, drone_id)
        expect(row).to_contain_text(f"Owner: {owner}")
        expect(row).to_contain_text("Controls: Free")
        expect(row).to_have_attribute("data-state", "idle")

    admin.part("squad-search").fill("merl")
    expect(admin.part("squad-row")).to_have_count(1)
    assert admin.squad() == ["2"]
    admin.part("squad-search").fill("bob")
    expect(admin.part("squad-row")).to_have_count(2)
    assert admin.squad() == ["2", "3"]
    admin.part("squad-search").fill("")

    # Its owner flies one of them. The admin's list shows who flies and finds the drone by its state.
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 8)
    expect(row_of(admin, 1).get_by_test_id("row-holder")).to_have_text("alice")
    admin.part("squad-filter").select_option(label="In the air")
    expect(admin.part("squad-row")).to_have_count(1)
    assert admin.squad() == ["1"]
    # The counts by state are the same filters, a press away.
    expect(admin.part("count-flying")).to_have_attribute("data-count", "1")
    expect(admin.part("count-attention")).to_have_attribute("data-count", "0")
    expect(admin.part("count-flying")).to_have_attribute("aria-pressed", "true")
    admin.part("count-flying").click()
    expect(admin.part("squad-row")).to_have_count(3)
    admin.part("squad-filter").select_option(label="Mine to fly")
    expect(admin.part("squad-row")).to_have_count(0)
    admin.part("squad-filter").select_option(label="All drones")

    admin.part("squad-view").get_by_text("Table").click()
    # In order of attention until somebody sorts it; a second press reverses the order.
    admin.part("sort-name").click()
    assert admin.squad() == ["1", "2", "3"]
    admin.part("sort-name").click()
    expect(admin.page.get_by_role("columnheader", name="Drone")).to_have_attribute("aria-sort", "descending")
    assert admin.squad() == ["3", "2", "1"]
    admin.part("sort-owner").click()
    expect(admin.page.get_by_role("columnheader", name="Owner")).to_have_attribute("aria-sort", "ascending")
    assert admin.squad() == ["1", "2", "3"]
    admin.part("sort-height").click()
    admin.part("sort-height").click()
    expect(admin.page.get_by_role("columnheader", name="Height")).to_have_attribute("aria-sort", "descending")
    assert admin.squad()[0] == "1"

    # Her page, reopened in flight, shows the flight time: the tower reports it.
    alice.wait("five seconds in the air", lambda: alice.number("flight-time") > 5_000)
    before_ms = alice.number("flight-time")
    alice.page.reload()
    alice.wait("the time in the air", lambda: alice.number("flight-time") >= before_ms)

    # A holder who releases it in the air leaves it unattended, and the list highlights that.
    expect(alice.part("bar-alerts")).to_contain_text("No alerts")
    alice.part("control-release").click()
    alice.confirm("Kestrel")
    expect(row_of(admin, 1)).to_have_attribute("data-unattended", "true")
    expect(row_of(admin, 1)).to_contain_text("Returns in")
    admin.part("squad-filter").select_option(label="Unattended")
    expect(admin.part("squad-row")).to_have_count(1)
    expect(admin.part("alert").filter(has_text="Kestrel").first).to_contain_text(
        "Nobody flies Kestrel (alice released the controls). It returns at"
    )
    expect(alice.part("hold-banner")).to_contain_text("Alice released the controls.")
    # One danger, one alert: that nobody has the controls is a second one only when somebody stopped the countdown.
    expect(admin.page.locator("[data-testid=alert][data-rule=unattended]")).to_have_count(0)
    row_of(admin, 1).get_by_test_id("stay").click()

    # Its alert is acknowledged by one for everybody, and outlives a reload.
    admin.part("squad-view").get_by_text("Cards").click()
    alice.part("bar-alerts").click()
    alert = alice.page.locator("[data-testid=alert][data-rule=unattended]")
    expect(alert).to_have_attribute("data-open", "true")
    expect(alert).to_contain_text("Kestrel is in the air, and nobody has the controls.")
    row = row_of(admin, 1)
    expect(row.get_by_test_id("acknowledge")).to_be_visible()
    admin.page.locator("[data-testid=alert][data-rule=unattended]").get_by_test_id("acknowledge").click()
    expect(alert).to_have_attribute("data-open", "false")
    expect(alert).to_contain_text("acknowledged by admin")
    alice.page.reload()
    alice.part("bar-alerts").click()
    expect(alert).to_have_attribute("data-open", "false")
    expect(alert).to_contain_text("acknowledged by admin")


def test_a_hold_of_several_drones_is_asked_once_and_answered_by_each(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    admin = signed_in(somebody, "admin", "Merlin")
    admin.acquire("Merlin")
    admin.wait("the autopilot", lambda: admin.word("mode") != "")
    admin.open("/#/")
    admin.part("choose-all").check()
    expect(admin.part("chosen-count")).to_have_text("3 selected")
    row_of(admin, 3).get_by_test_id("choose-drone").uncheck()
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
    # The refused drone keeps its identity and can be removed from the list of pairs.
    admin.part("tab-pairs").click()
    pair = admin.part("pair").and_(admin.page.locator("[data-drone-id='1']"))
    expect(pair).to_contain_text("alice")
    pair.get_by_test_id("pair-take").click()
    expect(admin.page.get_by_role("dialog")).to_contain_text("on the ground with its motors off")
    admin.confirm("Kestrel")
    expect(pair).to_contain_text("taken from alice")
    expect(alice.part("taken-banner")).to_contain_text("admin took control of Kestrel")
