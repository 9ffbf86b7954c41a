"""axe-core finds no serious or critical fault on any page of the console, with its dialogs and menus open.

Each state of a page is checked once, and twice in the long tier (axe_look.py).
"""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pyotp
import pytest
from axe_look import Axe
from console_page import SIMULATOR, ConsolePage, Somebody, visitors
from fake_pad import FakePad
from furnished import FIRST_PASSWORD, NEWCOMER, furnish
from playwright.sync_api import Browser, expect
from worlds.processes import CHECKOUT, World


@pytest.fixture(scope="module")
def office(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower with Kestrel and Merlin switched on and the other drones off."""
    folder = tmp_path_factory.mktemp("office")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=SIMULATOR)
        admin = world.visitor("admin")
        furnish(world, admin)
        # Holds stay open while they are looked at.
        assert admin.ask("PATCH", "/drones/1/settings", {"lost_action_s": 900.0}).status == 200
        world.wait_until_online(admin, 1, 2)
        yield world


@pytest.fixture
def come(chromium: Browser, office: World) -> Iterator[Somebody]:
    with visitors(chromium, office.address) as somebody:
        yield somebody


def entered(come: Somebody, name: str, address: str = "/", *, has_map: bool = False) -> ConsolePage:
    console = come(has_map=has_map)
    console.sign_in(name)
    expect(console.part("squad-row").first).to_be_visible()
    if address != "/":
        console.open(address)
    return console


def test_the_way_in(come: Somebody, axe: Axe) -> None:
    console = come()
    axe.look(console, "sign-in")
    console.sign_in("alice", "not the password")
    expect(console.part("sign-in-problem")).to_contain_text("wrong")
    axe.look(console, "sign-in-wrong")
    console.sign_in(NEWCOMER, FIRST_PASSWORD)
    expect(console.part("first-password")).to_be_visible()
    console.part("new-password").fill("short")
    console.part("new-password-again").fill("shorter")
    axe.look(console, "first-password")


@pytest.mark.long("further states of pages that test_every_page.py looks at")
def test_ones_own_account(come: Somebody, axe: Axe) -> None:
    console = entered(come, "bob", "/#/account")
    expect(console.part("section-tokens")).to_be_visible()
    sections = [
        link.get_attribute("data-testid") for link in console.page.locator("nav a[data-testid^=section-]").all()
    ]
    named = ("password", "passkeys", "second-factor", "sessions", "tokens", "alerts", "teams")
    assert sections == [f"section-{one}" for one in named]
    axe.look(console, "account-password")

    console.part("section-second-factor").click()
    console.part("begin-factor").click()
    secret = console.part("factor-secret").inner_text()
    axe.look(console, "account-factor-secret")
    console.part("factor-code").fill(pyotp.TOTP(secret).now())
    console.part("factor-submit").click()
    expect(console.part("recovery-codes")).to_be_visible()
    axe.look(console, "account-recovery-codes")
    console.part("remove-factor").click()
    axe.look(console, "account-factor-remove")

    there = come()
    there.sign_in("bob")
    expect(there.part("sign-in-code")).to_be_visible()
    axe.look(there, "sign-in-code")
    there.part("sign-in-code").fill(pyotp.TOTP(secret).at(0))
    there.part("sign-in-button").click()
    expect(there.part("sign-in-problem")).to_contain_text("wrong")
    axe.look(there, "sign-in-wrong-code")

    console.part("section-sessions").click()
    expect(console.part("session-row")).to_have_count(1)
    axe.look(console, "account-sessions")
    console.part("section-alerts").click()
    expect(console.page.get_by_text("You have no channel.")).to_be_visible()
    axe.look(console, "account-alerts")
    console.part("new-channel").click()
    expect(console.part("channel-dialog")).to_be_visible()
    axe.look(console, "account-new-channel")
    console.part("channel-close").click()
    console.part("section-tokens").click()
    expect(console.part("tokens").or_(console.page.get_by_text("There is no token"))).to_be_visible()
    axe.look(console, "account-no-tokens")
    axe.look_beneath(console, "new-token", "account-new-token")
    console.part("new-token").click()
    console.part("token-name").fill("QGroundControl in the van")
    console.part("token-make").click()
    expect(console.part("token-secret")).to_be_visible()
    axe.look(console, "account-token-secret")
    console.part("token-close").click()
    axe.look_beneath(console, "revoke-token", "account-revoke-token")
    axe.look_beneath(console, "user-menu", "user-menu")


@pytest.mark.long("further states of pages that test_every_page.py looks at")
def test_the_administration(come: Somebody, axe: Axe) -> None:
    console = entered(come, "admin", "/#/admin")
    entered(come, "alice")  # another user is signed in
    sections = {
        "users": "user-row",
        "drones": "drone-row",
        "enrolment": "enrolment-row",
        "sessions": "session-row",
        "tokens": "token-row",
        "teams": "new-team",
        "audit": "audit-row",
        "maps": "map-layer-form",
        "system": "system",
    }
    links = console.page.locator("nav a[data-testid^=section-]")
    expect(links).to_have_count(len(sections))
    for section, row in sections.items():
        console.part(f"section-{section}").click()
        expect(console.part(row).first).to_be_visible()
        axe.look(console, f"admin-{section}")

    console.part("section-users").click()
    axe.look_beneath(console, "new-user", "admin-new-user")
    axe.look_beneath(console, "user-menu-alice", "admin-user-menu")
    for action in ("user-reset", "user-role-admin", "user-disable", "user-delete"):
        console.part("user-menu-alice").click()
        console.part(action).click()
        axe.look(console, f"admin-{action}")
        console.page.keyboard.press("Escape")

    console.part("section-drones").click()
    axe.look_beneath(console, "new-drone", "admin-new-drone")
    menu = console.part("drone-row").filter(has_text="Swift").get_by_role("button")
    menu.click()
    axe.look(console, "admin-drone-menu")
    console.page.keyboard.press("Escape")
    for action in ("owners", "lend", "settings", "enrol", "name", "delete"):
        menu.click()
        console.part(f"drone-{action}").click()
        expect(console.page.get_by_role("dialog")).to_contain_text("Swift")
        if action == "owners":
            console.part("owner-choose").click()
            expect(console.page.get_by_role("option", name="alice")).to_be_visible()
            axe.look(console, "admin-drone-owner-choose")
            console.page.keyboard.press("Escape")
        expect(console.page.get_by_text("Reading…")).to_have_count(0)
        axe.look(console, f"admin-drone-{action}")
        console.page.keyboard.press("Escape")
        expect(console.page.get_by_role("dialog")).to_have_count(0)
        expect(menu).to_be_focused()
    menu.click()
    console.part("drone-enrol").click()
    console.part("enrol-begin").click()
    expect(console.part("enrol-command")).to_be_visible()
    axe.look(console, "admin-enrol-command")


def test_a_drone_that_sends_too_much_and_the_shares(come: Somebody, axe: Axe) -> None:
    console = entered(come, "admin", "/#/admin")
    console.part("section-system").click()
    expect(console.part("share-zones")).to_be_visible()
    axe.look(console, "admin-shares")
    console.part("section-drones").click()
    console.part("drone-row").filter(has_text="Swift").get_by_role("button").click()
    console.part("drone-restrain").click()
    expect(console.part("restrain-dialog")).to_contain_text("Swift")
    axe.look(console, "admin-restrain")
    console.part("restrain-quarantined").check()
    axe.look(console, "admin-restrain-quarantined")
    console.part("restrain-take").click()
    expect(console.page.get_by_role("dialog")).to_have_count(0)
    console.part("drone-row").filter(has_text="Swift").get_by_role("button").click()
    console.part("drone-restrain").click()
    expect(console.part("restraint-now")).to_be_visible()
    axe.look(console, "admin-restraint")
    console.part("restraint-lift").click()
    expect(console.page.get_by_role("dialog")).to_have_count(0)


def test_an_operator_who_comes_to_the_administration(come: Somebody, axe: Axe) -> None:
    console = entered(come, "alice", "/#/admin")
    expect(console.page.get_by_text("This page is for admins only.")).to_be_visible()
    axe.look(console, "admin-not-for-you")
    console.open("/#/drone/99")
    expect(console.part("no-such-drone")).to_be_visible()
    axe.look(console, "no-such-drone")


@pytest.mark.long("further states of pages that test_every_page.py looks at")
def test_the_monitor(come: Somebody, axe: Axe) -> None:
    console = entered(come, "admin")
    axe.look(console, "monitor")
    for tab in ("Messages", "Who flies what"):
        console.page.get_by_role("tab", name=tab).click()
        axe.look(console, f"monitor-{tab.split()[0].lower()}")
    console.part("squad-view").get_by_text("Table").click()
    axe.look(console, "monitor-table")
    console.part("choose-all").check()
    axe.look_beneath(console, "squad-hold", "monitor-squad-hold")
    console.part("bar-alerts").click()
    axe.look(console, "monitor-alerts")
    console.page.keyboard.press("Escape")
    console.part("squad-mission-link").click()
    expect(console.part("squad-mission")).to_be_visible()
    axe.look(console, "squad-mission")


@pytest.mark.long("further states of pages that test_every_page.py looks at")
def test_the_missions_page(come: Somebody, axe: Axe) -> None:
    console = entered(come, "alice", "/#/missions/1", has_map=True)
    expect(console.part("drone-strip")).to_be_visible()
    axe.look(console, "missions-empty")
    plan = CHECKOUT / "web" / "test" / "plan" / "files" / "survey.plan"
    console.part("plan-file").set_input_files(plan)
    expect(console.part("import-dialog")).to_be_visible()
    axe.look(console, "missions-import")
    console.part("import-open").click()
    axe.look(console, "missions-table")
    console.part("plan-item").nth(1).click()
    expect(console.part("item-editor")).to_be_visible()
    axe.look(console, "missions-item")
    for tab in ("fence", "rally", "checks", "settings"):
        console.part(f"tab-{tab}").click()
        axe.look(console, f"missions-{tab}")
    for pattern in ("survey", "corridor", "orbit"):
        console.part(f"tool-{pattern}").click()
        axe.look(console, f"missions-{pattern}")
        console.part("pattern-cancel").click()
    for menu in ("plan-menu", "add-item", "drone-plan-menu"):
        console.part("tab-mission").click()
        axe.look_beneath(console, menu, f"missions-{menu}")
    for item in ("plan-library", "plan-save-as"):
        console.part("plan-menu").click()
        console.part(item).click()
        expect(console.page.get_by_role("dialog")).to_be_visible()
        axe.look(console, f"missions-{item}")
        console.page.keyboard.press("Escape")
    console.part("item-height").fill("500")  # higher than the checks allow, so the upload asks for confirmation
    console.part("strip-acquire").click()
    expect(console.part("upload")).to_be_enabled()
    console.part("upload").click()
    expect(console.part("upload-dialog")).to_be_visible()
    axe.look(console, "missions-upload")
    console.page.keyboard.press("Escape")
    console.page.evaluate("window.location.hash = '#/drone/1'")
    console.part("control-release").click()
    expect(console.part("control-acquire")).to_be_visible()  # otherwise the page may close before the tower is asked


@pytest.mark.long("further states of pages that test_every_page.py looks at")
def test_the_parameters_and_the_logs_of_a_drone(come: Somebody, axe: Axe) -> None:
    console = entered(come, "admin", "/#/drone/2/parameters")
    expect(console.part("parameters-state")).to_contain_text("1390 parameters")
    axe.look(console, "parameters")
    console.part("parameter-search").fill("fence")
    console.part("value-of-FENCE_TYPE").focus()
    console.part("bit-3").check()
    console.part("value-of-FENCE_ALT_MAX").fill("5000")
    console.part("value-of-FENCE_ALT_MAX").press("Enter")
    console.part("value-of-FENCE_RADIUS").fill("far")
    axe.look(console, "parameters-changed")
    for opener in ("parameter-file", "parameter-compare"):
        axe.look_beneath(console, opener, opener)
    console.part("parameter-compare").click()
    console.part("compare-defaults").click()
    expect(console.part("compare-summary")).to_contain_text("differ")
    axe.look(console, "parameters-compared")
    console.page.keyboard.press("Escape")
    console.page.get_by_label("Choose FENCE_RADIUS").check()
    axe.look_beneath(console, "parameter-copy", "parameters-copy")
    console.part("page-logs").click()
    console.part("list-logs").click()
    expect(console.part("operation")).to_have_attribute("data-state", "done")
    axe.look(console, "logs")


def test_the_control_page_in_flight_for_its_pilot_and_for_a_watcher(come: Somebody, axe: Axe) -> None:
    pilot = entered(come, "alice", has_map=True)
    pilot.open_drone("Kestrel")
    axe.look(pilot, "control-free")
    pilot.acquire("Kestrel")
    pilot.take_off("Kestrel", 8)
    pilot.part("in-flight").locator("summary").click()
    axe.look(pilot, "control-pilot")
    pilot.part("swap").click()
    axe.look(pilot, "control-video")
    pilot.part("swap").click()
    for opener in ("open-keys", "open-settings", "rehearse", "action-disarm", "manual-toggle"):
        axe.look_beneath(pilot, opener, f"control-{opener}")
    pilot.page.keyboard.press("g")
    pilot.page.keyboard.press("Enter")
    expect(pilot.part("map-menu")).to_be_visible()
    axe.look(pilot, "control-goto")
    pilot.part("place-more").locator("summary").click()
    axe.look(pilot, "control-goto-more")
    pilot.page.keyboard.press("Escape")
    pilot.page.keyboard.press("x")
    expect(pilot.part("switch-drone").first).to_be_visible()
    axe.look(pilot, "control-switch")
    pilot.page.keyboard.press("Escape")
    pad = FakePad(pilot)
    expect(pilot.part("manual-means")).to_contain_text("Test pad")
    pilot.part("stick-setup").click()
    tabs = pilot.part("stick-setup-dialog").get_by_role("tab")
    for at in range(tabs.count()):
        tabs.nth(at).click()
        axe.look(pilot, f"control-sticks-{at}")
    pilot.page.keyboard.press("Escape")
    axe.look(pilot, "control-sticks-unmoved")
    pad.show_sticks()
    pilot.part("manual-toggle").click()
    pilot.confirm("Kestrel")
    expect(pilot.part("manual-bars")).to_have_attribute("data-phase", "flying")
    axe.look(pilot, "control-by-hand")

    admin = entered(come, "admin")
    admin.open_drone("Kestrel")
    expect(admin.part("blocked-reason")).to_contain_text("alice")
    axe.look(admin, "control-watcher")
    axe.look_beneath(admin, "control-take", "control-take")
    axe.look_beneath(admin, "control-take-emergency", "control-take-emergency")
    admin.takes_from("alice", "Kestrel", reason="weather", may_watch=False)
    expect(pilot.part("view-cover")).to_be_visible()
    expect(admin.part("hold-banner")).to_have_attribute("data-phase", "counting")
    axe.look(admin, "control-taker")
    axe.look(pilot, "control-taken")
    admin.open("/#/")
    expect(admin.part("row-hold")).to_be_visible()
    axe.look(admin, "monitor-hold")
