"""The administration in the browser: users, owners, sessions, the audit trail."""

from console_page import Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import World


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


def test_a_second_owner_sees_the_drone_at_once(somebody_early: Somebody, quiet_world: World) -> None:
    admin, bob = signed_in(somebody_early, "admin"), signed_in(somebody_early, "bob")
    assert bob.squad() == ["2"]
    admin.open("/#/admin/drones")
    admin.part("drone-menu-1").click()
    admin.part("drone-owners").click()
    admin.part("owner-choose").click()
    admin.page.get_by_role("option", name="bob").click()
    admin.part("owner-add").click()
    expect(bob.part("squad-row")).to_have_count(2)
    admin.part("owner-remove-bob").click()
    expect(bob.part("squad-row")).to_have_count(1)


def test_the_audit_trail_tells_who_did_it(somebody_early: Somebody) -> None:
    admin = signed_in(somebody_early, "admin")
    admin.open("/#/admin/drones")
    admin.part("drone-menu-1").click()
    admin.part("drone-name").click()
    admin.part("drone-name-field").fill("Osprey")
    admin.part("drone-save").click()
    expect(admin.part("drone-row").filter(has_text="Osprey")).to_have_count(1)
    admin.open("/#/admin/audit")
    row = admin.part("audit-row").filter(has_text="Osprey")
    expect(row).to_contain_text("drone.renamed")
    expect(row).to_contain_text("admin")


def test_an_operator_has_no_way_into_the_administration(somebody_early: Somebody) -> None:
    alice = signed_in(somebody_early, "alice")
    expect(alice.part("open-admin")).to_have_count(0)
    alice.open("/#/admin/users")
    expect(alice.page.get_by_text("Only an admin may see this page.")).to_be_visible()
