"""A new person and a new drone, from an empty tower to the map: the admin's steps, and the one pasted command."""

from console_page import Somebody, signed_in
from playwright.sync_api import expect
from test_accounts import NEW_PASSWORD, choose_password
from worlds.processes import World, free_udp_ports

from onboard_agent import VERSION as AGENT_VERSION

HAS_MAP = True

HOME = (46.9481, 7.4474)
"""Position of this drone, far from those of the other tests."""


def test_a_pasted_command_puts_a_new_drone_on_its_owners_map(somebody_early: Somebody, quiet_world: World) -> None:
    admin = signed_in(somebody_early, "admin")
    admin.part("open-admin").click()
    admin.part("new-user").click()
    admin.part("user-name-field").fill("erin")
    admin.part("user-make").click()
    password = admin.part("first-password-text").inner_text()
    admin.part("user-close").click()

    # Making a drone leads straight to its enrolment.
    [port] = free_udp_ports(1)
    admin.open("/#/admin/drones")
    admin.part("new-drone").click()
    admin.part("drone-name-field").fill("Harrier")
    admin.part("drone-save").click()
    expect(admin.part("enrol-dialog")).to_contain_text("Enrol Harrier")
    admin.part("enrol-autopilot").fill(f"udpin:127.0.0.1:{port}")
    admin.part("enrol-begin").click()
    command = admin.part("enrol-command").inner_text()
    expect(admin.part("enrol-state")).to_have_attribute("data-value", "waiting")
    admin.part("enrol-close").click()

    row = admin.part("drone-row").and_(admin.page.locator("[data-name='Harrier']"))
    row.get_by_role("button", name="What to do with Harrier").click()
    admin.part("drone-owners").click()
    admin.part("owner-choose").click()
    admin.page.get_by_role("option", name="erin").click()
    admin.part("owner-add").click()
    expect(admin.part("owner-remove-erin")).to_be_visible()
    admin.part("owners-close").click()

    erin = somebody_early()
    erin.sign_in("erin", password)
    choose_password(erin, password, NEW_PASSWORD)
    expect(erin.part("squad-row")).to_have_count(1)
    expect(erin.part("squad-row")).to_contain_text("Harrier")
    expect(erin.part("squad-row")).to_have_attribute("data-state", "lost")

    admin.open("/#/admin/enrolment")
    enrolment = admin.part("enrolment-row").filter(has_text="Harrier")
    expect(enrolment).to_have_attribute("data-state", "waiting")
    quiet_world.install_agent("enrolled", command, quiet_world.folder / "harriers-computer")
    # Without a reload.
    expect(enrolment).to_have_attribute("data-state", "seen")
    expect(enrolment).to_contain_text("Harrier is enrolled")
    expect(erin.part("squad-row")).to_contain_text("Autopilot not heard")

    home = f"{HOME[0]},{HOME[1]},540,0"
    quiet_world.start("simulator", "tower-sim", "--home", home, "--out", f"udp:127.0.0.1:{port}", "--boot-s", "1")

    def shows_its_place() -> bool:
        lat, lon, zoom = (erin.part("map").get_attribute(f"data-{name}") or "0" for name in ("lat", "lon", "zoom"))
        return abs(float(lat) - HOME[0]) < 0.001 and abs(float(lon) - HOME[1]) < 0.001 and float(zoom) > 12

    erin.wait("the map at the new drone", shows_its_place)
    expect(erin.part("squad-row")).to_have_attribute("data-state", "idle")
    expect(erin.part("squad-row")).to_contain_text("Owner: erin")
    # The map draws it there: a click on that position selects it.
    box = erin.part("map").bounding_box()
    assert box is not None
    erin.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(erin.part("drone-card")).to_contain_text("Harrier")

    # The drone has its own key; without the key nobody flies it.
    admin.open("/#/admin/drones")
    expect(row.get_by_test_id("drone-key")).to_contain_text("SHA256:")
    expect(row.get_by_test_id("drone-agent")).to_have_text(AGENT_VERSION)
    row.get_by_role("button", name="What to do with Harrier").click()
    admin.part("drone-revoke").click()
    admin.confirm("Harrier")
    expect(row.get_by_test_id("drone-key")).to_have_text("not enrolled")
    expect(erin.part("squad-row")).to_have_attribute("data-state", "lost")
