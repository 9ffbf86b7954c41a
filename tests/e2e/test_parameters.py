"""The parameters of a drone: read, changed, refused with a message, visible to others, saved to files, copied."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from console_page import SIMULATOR, ConsolePage, Somebody, signed_in, visitors
from playwright.sync_api import Browser, ViewportSize, expect
from touch_targets import PHONE
from worlds.processes import World

SIDEWAYS: Final[ViewportSize] = {"width": 844, "height": 390}


@pytest.fixture(scope="module")
def workshop(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """Two drones whose manufacturers have locked the parameters of the board."""
    folder = tmp_path_factory.mktemp("workshop")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=(*SIMULATOR, "--fail", "parameters-locked"))
        world.wait_until_online(world.visitor("admin"), 1, 2)
        yield world


@pytest.fixture
def come(chromium: Browser, workshop: World) -> Iterator[Somebody]:
    with visitors(chromium, workshop.address) as somebody:
        yield somebody


def at_parameters(come: Somebody, name: str, drone: str) -> ConsolePage:
    console = signed_in(come, name, drone)
    console.part("page-parameters").click()
    expect(console.part("parameters-state")).to_contain_text("1390 parameters")
    return console


def searched(console: ConsolePage, words: str) -> None:
    console.part("parameter-search").fill(words)


def test_what_is_written_is_seen_by_others_and_what_is_refused_is_said(come: Somebody) -> None:
    admin = at_parameters(come, "admin", "Kestrel")
    alice = at_parameters(come, "alice", "Kestrel")
    # Search by description. There are 1,390 rows, and only visible ones are rendered.
    assert alice.part("parameter-row").count() < 40
    searched(alice, "before it flies back")
    expect(alice.part("parameter-row")).to_have_count(1)
    alice.part("value-of-RTL_ALT").fill("high")
    expect(alice.page.get_by_text("This is not a number.")).to_be_visible()
    alice.part("value-of-RTL_ALT").fill("3000")
    alice.part("value-of-RTL_ALT").press("Enter")
    searched(alice, "fence_type")
    alice.part("value-of-FENCE_TYPE").focus()
    alice.part("bit-3").check()
    searched(alice, "BRD_VBUS_MIN")
    alice.part("value-of-BRD_VBUS_MIN").fill("4.5")
    alice.part("value-of-BRD_VBUS_MIN").press("Enter")
    expect(alice.part("tray-row")).to_have_count(3)

    # Writing requires the controls.
    expect(alice.part("write-parameters")).to_be_disabled()
    expect(alice.part("write-blocked")).to_contain_text("Take control")
    alice.part("control-acquire").click()
    alice.part("write-parameters").click()
    alice.confirm("Kestrel")
    expect(alice.part("refusal")).to_have_text("The autopilot keeps 4.3.")
    rows = alice.part("tray-row")
    expect(rows).to_have_count(1)
    expect(rows).to_have_attribute("data-name", "BRD_VBUS_MIN")
    expect(alice.part("changed-elsewhere")).to_have_count(0)

    expect(admin.part("changed-elsewhere")).to_contain_text("RTL_ALT")
    searched(admin, "rtl_alt")
    row = admin.page.locator("[data-testid=parameter-row][data-name=RTL_ALT]")
    expect(row).to_have_attribute("data-value", "3000")
    expect(row).to_contain_text("was 1500")
    expect(admin.part("value-of-RTL_ALT")).to_have_value("3000")


def test_names_can_be_read_whole_on_a_phone(come: Somebody, workshop: World) -> None:
    values = workshop.visitor("alice").ask("GET", "/drones/1/parameters").json["values"]
    longest = sorted((one["name"] for one in values), key=len)[-4:]
    assert {len(name) for name in longest} == {16}, "as long as MAVLink allows"
    alice = at_parameters(come, "alice", "Kestrel")
    for size in (PHONE, SIDEWAYS):
        alice.page.set_viewport_size(size)
        for words in ("", *longest):
            searched(alice, words)
            names = alice.part("parameter-name")
            expect(names.filter(has_text=words).first).to_be_visible()
            # Half of a phone's height shows at least these, besides headings of groups.
            assert words or names.count() > (5 if size == PHONE else 0)
            clipped = names.evaluate_all(
                "names => names.filter((one) => one.scrollWidth > one.clientWidth).map((one) => one.textContent)"
            )
            assert clipped == []


def test_values_go_to_a_file_and_back_and_to_another_drone(come: Somebody, tmp_path: Path) -> None:
    admin = at_parameters(come, "admin", "Kestrel")
    searched(admin, "wpnav_speed")
    admin.page.get_by_label("Choose WPNAV_SPEED", exact=True).check()
    admin.page.get_by_label("Choose WPNAV_SPEED_UP", exact=True).check()
    admin.part("parameter-file").click()
    with admin.page.expect_download() as saved:
        admin.part("file-param").click()
    path = tmp_path / "kestrel.param"
    saved.value.save_as(path)
    assert path.read_text().splitlines()[1:] == ["WPNAV_SPEED,1000", "WPNAV_SPEED_UP,250"]

    # A file first shows the differences, then the selected ones, then the confirmation, then writes.
    path.write_text("WPNAV_SPEED,700\nWPNAV_SPEED_UP,250\nRC1_MIN,990\nQ_ENABLE,1\n")
    admin.part("file-input").set_input_files(path)
    dialog = admin.part("compare-dialog")
    expect(admin.part("compare-summary")).to_have_text("2 differ, 1 are the same.")
    expect(dialog).to_contain_text("Kestrel does not have Q_ENABLE.")
    expect(dialog.get_by_role("checkbox", name="RC1_MIN")).not_to_be_checked()
    admin.part("compare-take").click()
    expect(admin.part("tray-row")).to_have_attribute("data-name", "WPNAV_SPEED")
    take = admin.part("control-acquire").or_(admin.part("control-take"))
    asks = take.get_attribute("data-testid") == "control-take"
    take.click()
    if asks:
        admin.confirm("Kestrel")
    admin.part("write-parameters").click()
    admin.confirm("Kestrel")
    expect(admin.part("tray")).to_have_attribute("data-value", "0")

    admin.part("parameter-copy").click()
    merlin = admin.part("copy-drone")
    expect(merlin).to_contain_text("Nobody has the controls")
    merlin.get_by_role("checkbox").check()
    expect(merlin).to_contain_text("1 change, 1 it has already.")
    admin.part("copy-write").click()
    expect(merlin).to_have_attribute("data-value", "done")
    admin.part("copy-close").click()
    admin.open("/#/drone/2/parameters")
    searched(admin, "wpnav_speed")
    expect(admin.part("value-of-WPNAV_SPEED")).to_have_value("700")
    expect(admin.part("holder")).to_have_attribute("data-value", "")
    admin.part("parameter-compare").click()
    admin.part("compare-drone-1").click()
    expect(admin.part("compare-dialog")).to_contain_text("Merlin against Kestrel")
