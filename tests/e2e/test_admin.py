"""The administration in the browser: users, owners, loans, enrolments, the audit trail."""

import shutil
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from console_page import ConsolePage, Somebody, signed_in
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from playwright.sync_api import Route, expect
from worlds.agent_releases import write_release
from worlds.processes import World


@pytest.fixture(scope="module")
def quiet_world(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower for all tests of the module, with all drones switched off."""
    folder = tmp_path_factory.mktemp("office")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        world.start_tower()
        yield world


def test_an_admin_makes_a_user_who_then_signs_in(somebody_early: Somebody) -> None:
    admin = signed_in(somebody_early, "admin")
    admin.part("open-admin").click()
    admin.part("new-user").click()
    admin.part("user-name-field").fill("dave")
    admin.part("user-make").click()
    password = admin.part("first-password-text").inner_text()
    admin.part("user-close").click()
    expect(admin.part("user-row").filter(has_text="dave")).to_contain_text("has not chosen a password yet")

    dave = somebody_early()
    dave.sign_in("dave", password)
    expect(dave.part("first-password")).to_be_visible()

    admin.part("user-menu-dave").click()
    admin.part("user-disable").click()
    admin.confirm("dave")
    expect(admin.part("user-row").filter(has_text="dave")).to_contain_text("disabled")
    dave.page.reload()
    expect(dave.part("sign-in-name")).to_be_visible()


def agree(console: ConsolePage, drone: str) -> None:
    """Confirms in a dialog on top of another one, which stays open."""
    question = console.part("confirm-dialog")
    expect(question).to_contain_text(drone)
    console.part("confirm-button").click()
    expect(question).to_have_count(0)


def test_a_second_owner_sees_the_drone_at_once(somebody_early: Somebody) -> None:
    admin, bob = signed_in(somebody_early, "admin"), signed_in(somebody_early, "bob")
    assert bob.squad() == ["2"]
    admin.open("/#/admin/drones")
    kestrel = admin.part("drone-row").filter(has_text="Kestrel")
    expect(kestrel).to_be_visible()
    read_again: list[str] = []
    admin.page.on("request", lambda sent: read_again.append(sent.url) if sent.method == "GET" else None)
    admin.part("drone-menu-1").click()
    admin.part("drone-owners").click()
    admin.part("owner-choose").click()
    admin.page.get_by_role("option", name="bob").click()
    admin.part("owner-add").click()
    expect(bob.part("squad-row")).to_have_count(2)
    expect(kestrel).to_contain_text("bob")

    # Escape closes the confirmation, not the dialog beneath.
    admin.part("owner-remove-bob").click()
    expect(admin.part("confirm-dialog")).to_contain_text("Kestrel leaves the squad of bob at once.")
    admin.page.keyboard.press("Escape")
    expect(admin.part("confirm-dialog")).to_have_count(0)
    expect(admin.part("owner-remove-bob")).to_be_focused()
    admin.part("owner-remove-bob").press("Enter")
    agree(admin, "Kestrel")
    expect(bob.part("squad-row")).to_have_count(1)
    expect(kestrel).not_to_contain_text("bob")
    assert not read_again, "what the tower says live is not read again"


def test_what_an_admin_takes_away_is_asked_first_with_the_drone_that_is_flown(
    somebody_early: Somebody, quiet_world: World
) -> None:
    admin = signed_in(somebody_early, "admin")
    by_rest = quiet_world.visitor("admin")
    users = {one["name"]: one["id"] for one in by_rest.ask("GET", "/users").json}
    bob = quiet_world.visitor("bob")
    tomorrow = (datetime.now(UTC) + timedelta(days=1)).isoformat()
    lent = by_rest.ask("PUT", f"/drones/1/loans/{users['bob']}", {"until": tomorrow})
    assert lent.status == 200, lent.body
    assert bob.ask("POST", "/drones/1/control/acquire", {}).status == 200

    admin.open("/#/admin/drones")
    admin.part("drone-menu-1").click()
    admin.part("drone-lend").click()
    admin.part("loan-end-bob").click()
    expect(admin.part("confirm-dialog")).to_contain_text("bob is flying it: Kestrel is ordered to hold")
    admin.page.keyboard.press("Escape")
    admin.part("loan-close").click()

    for section, actions in {
        "users": ("user-reset", "user-disable", "user-delete"),
        "sessions": ("end-session",),
    }.items():
        admin.part(f"section-{section}").click()
        for action in actions:
            if section == "users":
                admin.part("user-menu-bob").click()
                admin.part(action).click()
            else:
                admin.part("session-row").filter(has_text="bob").first.get_by_test_id(action).click()
            expect(admin.page.get_by_role("dialog")).to_contain_text("bob is flying Kestrel: ordered to hold")
            admin.page.keyboard.press("Escape")
            expect(admin.page.get_by_role("dialog")).to_have_count(0)

    admin.part("section-drones").click()
    admin.part("drone-menu-1").click()
    admin.part("drone-lend").click()
    admin.part("loan-end-bob").click()
    agree(admin, "Kestrel")
    expect(admin.part("loan-row")).to_have_count(0)
    assert bob.drone(1).get("holder") is None


def test_an_update_of_an_agent_is_refused_in_words(somebody_early: Somebody, quiet_world: World) -> None:
    write_release(quiet_world.folder / "agent_releases", "9.1.0", Ed25519PrivateKey.generate())
    admin = signed_in(somebody_early, "admin")
    admin.open("/#/admin/drones")
    admin.part("drone-menu-1").click()
    admin.part("drone-agent-update").click()
    expect(admin.part("agent-update-version")).to_have_value("9.1.0")
    admin.part("agent-update-begin").click()
    expect(admin.part("agent-update-problem")).to_contain_text("Kestrel is offline")
    admin.part("agent-update-close").click()


def test_a_new_drone_is_enrolled_and_its_enrolment_cancelled(somebody_early: Somebody) -> None:
    admin = signed_in(somebody_early, "admin")
    admin.open("/#/admin/drones")
    admin.part("new-drone").click()
    admin.part("drone-name-field").fill("Bittern")
    admin.part("drone-save").click()
    admin.part("enrol-begin").click()
    expect(admin.part("enrol-command")).to_contain_text("tower-agent) install --tower")
    admin.part("enrol-close").click()
    expect(admin.part("drone-row").filter(has_text="Bittern")).to_contain_text("offline")
    admin.part("section-enrolment").click()
    row = admin.part("enrolment-row").filter(has_text="Bittern")
    expect(row).to_have_attribute("data-state", "waiting")
    row.get_by_test_id("enrolment-cancel").click()
    admin.confirm("Bittern")
    expect(row).to_have_attribute("data-state", "cancelled")


def test_a_tower_that_does_not_answer_is_told_and_asked_again(somebody_early: Somebody) -> None:
    admin = signed_in(somebody_early, "admin")
    answers = [
        (429, "Too many requests. Wait 7 s."),
        (500, "The tower failed. Its log says why."),
        (403, "Only admins may do this."),
        (0, "The tower cannot be reached."),
    ]
    refused: list[tuple[int, str]] = list(answers)

    def answer(route: Route) -> None:
        if not refused:
            route.continue_()
            return
        status, words = refused.pop(0)
        if status:
            route.fulfill(status=status, json={"title": "Refused", "detail": words})
        else:
            route.abort()

    admin.page.route("**/api/v1/audit?*", answer)
    admin.open("/#/admin/audit")
    for _, words in answers:
        expect(admin.part("section-problem")).to_contain_text(words)
        expect(admin.page.get_by_text("Reading…")).to_have_count(0)
        admin.part("retry").click()
    expect(admin.part("audit-row").first).to_be_visible()
    expect(admin.part("section-problem")).to_have_count(0)


def test_the_audit_trail_tells_who_did_it(somebody_early: Somebody, quiet_world: World) -> None:
    admin = signed_in(somebody_early, "admin")
    admin.open("/#/admin/drones")
    admin.part("drone-menu-1").click()
    admin.part("drone-name").click()
    admin.part("drone-name-field").fill("Osprey")
    admin.part("drone-save").click()
    expect(admin.part("drone-row").filter(has_text="Osprey")).to_have_count(1)
    admin.open("/#/admin/audit")
    row = admin.part("audit-row").filter(has_text="renamed the drone Kestrel to Osprey")
    expect(row).to_contain_text("Osprey")
    expect(row).to_contain_text("admin")
    assert quiet_world.visitor("admin").ask("PATCH", "/drones/1", {"name": "Kestrel"}).status == 200


def test_an_operator_has_no_way_into_the_administration(somebody_early: Somebody) -> None:
    alice = signed_in(somebody_early, "alice")
    expect(alice.part("open-admin")).to_have_count(0)
    alice.open("/#/admin/users")
    expect(alice.page.get_by_text("This page is for admins only.")).to_be_visible()


def test_an_admin_changes_a_share(somebody_early: Somebody) -> None:
    admin = signed_in(somebody_early, "admin")
    admin.open("/#/admin/system")
    zones = admin.part("share-zones")
    expect(zones).to_contain_text("50 for each team")
    expect(admin.part("share-request-time")).to_contain_text("admin")
    admin.part("share-limit-zones").fill("20")
    admin.part("share-change-zones").click()
    expect(zones).to_contain_text("20 for each team")
    admin.part("share-change-zones").click()
    expect(zones).to_contain_text("50 for each team")
