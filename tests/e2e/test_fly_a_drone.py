"""The whole product as its users see it: an operator flies, a stranger sees nothing, the admin sees all."""

import pytest
from console_page import Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import World, kill_9


def test_an_operator_flies_their_drone_there_and_back(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", has_map=True)
    assert alice.squad() == ["1"]
    alice.open_drone("Kestrel")
    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") != 0)
    # All buttons are disabled before the controls are taken.
    expect(alice.part("action-arm")).to_be_disabled()
    alice.acquire("Kestrel")
    home = (alice.number("latitude"), alice.number("longitude"))

    # A rejected arming is explained.
    alice.part("mode-select").select_option(label="RTL")
    alice.part("action-mode").click()
    alice.wait("RTL", lambda: alice.word("mode") == "RTL")
    alice.part("action-arm").click()
    alice.confirm("Kestrel")
    expect(alice.part("action-report")).to_contain_text("Arm: ")
    expect(alice.part("messages")).to_contain_text("Arm")
    assert alice.word("armed") == "false"

    # Arming by hand in GUIDED, then take-off.
    alice.part("mode-select").select_option(label="GUIDED")
    alice.part("action-mode").click()
    alice.wait("GUIDED", lambda: alice.word("mode") == "GUIDED")
    alice.part("action-arm").click()
    alice.confirm("Kestrel")
    alice.wait("motors armed", lambda: alice.word("armed") == "true")
    alice.part("takeoff-height").fill("10")
    alice.hold_take_off("Kestrel")
    alice.wait("10 m", lambda: abs(alice.number("altitude") - 10) < 0.5)

    # Go-to by a click on the map, away from the middle where the drone is.
    alice.press_map(0.62, 0.35)
    expect(alice.part("map-menu")).to_contain_text("Kestrel")
    expect(alice.part("place-facts")).to_contain_text(" away")
    alice.part("place-more").locator("summary").click()
    lat_deg, lon_deg = map(float, alice.part("goto-place").input_value().split(", "))
    target = (lat_deg, lon_deg)
    assert alice.distance_m(*target) > 10
    alice.part("goto-confirm").click()
    alice.wait("arrival", lambda: alice.distance_m(*target) < 2 and alice.number("speed") < 0.5)
    assert abs(alice.number("altitude") - 10) < 1

    alice.ends_flight("return")
    alice.wait("RTL", lambda: alice.word("mode") == "RTL")
    alice.wait("landing", lambda: alice.word("armed") == "false")
    assert alice.distance_m(*home) < 2
    assert abs(alice.number("altitude")) < 0.5
    assert alice.drones_heard == {1}
    # The only permitted error is the sign-in page's request for the current user, answered with 401.
    assert [said for said in alice.complaints if "401" not in said] == []


@pytest.mark.drones("Merlin")
def test_take_off_and_land_from_one_button_each(somebody: Somebody) -> None:
    bob = signed_in(somebody, "bob")
    bob.open_drone("Merlin")
    bob.acquire("Merlin")
    bob.wait("a position", lambda: bob.number("latitude") > 40)
    bob.part("takeoff-height").fill("6")
    bob.hold_take_off("Merlin")
    bob.wait("6 m", lambda: abs(bob.number("altitude") - 6) < 0.5)
    bob.part("bar-hold").click()
    # Without a pilot at the sticks, only a mode that needs none keeps height.
    bob.wait("BRAKE", lambda: bob.word("mode") == "BRAKE")
    assert abs(bob.number("altitude") - 6) < 0.5
    bob.ends_flight("land")
    bob.wait("landing", lambda: bob.word("armed") == "false")


@pytest.mark.drones("Kestrel", "Merlin")
def test_a_stranger_sees_nothing_of_a_drone_the_admin_all_and_each_that_the_tower_is_gone(
    somebody: Somebody, world: World
) -> None:
    bob = signed_in(somebody, "bob")
    assert bob.squad() == ["2"]
    answers = []
    for path in ("/#/drone/1", "/#/drone/4711"):
        bob.open(path)
        answers.append(bob.part("no-such-drone").inner_text())
    assert answers[0] == answers[1]
    assert "Kestrel" not in bob.page.content()
    open_path = f"{bob.address}/api/v1/drones/"
    theirs, nobodys = (bob.page.request.get(open_path + number) for number in ("1", "4711"))
    assert theirs.status == nobodys.status == 404
    assert {**theirs.json(), "instance": ""} == {**nobodys.json(), "instance": ""}
    bob.open("/#/")
    bob.wait_for_frames()
    assert bob.drones_heard == {2}

    # The admin sees all, and takes and gives.
    alice = signed_in(somebody, "alice")
    alice.open_drone("Kestrel")
    alice.acquire("Kestrel")
    admin = signed_in(somebody, "admin")
    assert admin.squad() == ["1", "2"]
    admin.wait_for_frames(2)
    admin.open_drone("Kestrel")
    admin.takes_from("alice", "Kestrel", reason="airspace closed")
    expect(alice.part("taken-banner")).to_contain_text("airspace closed")
    expect(alice.part("action-arm")).to_be_disabled()
    expect(alice.part("action-takeoff")).to_be_disabled()
    admin.gives_back("Kestrel")
    # The offer alone does not give her the controls; she has to accept.
    alice.part("control-accept").click()
    expect(alice.part("taken-banner")).to_have_count(0)
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")

    # The console says that the tower is gone, and comes back by itself.
    expect(bob.part("connection-state")).to_contain_text("Connected")
    kill_9(world.tower)
    expect(bob.part("connection-state")).not_to_contain_text("Connected")
    world.start_tower()
    expect(bob.part("connection-state")).to_contain_text("Connected", timeout=15_000)
    bob.drones_heard.clear()
    bob.wait_for_frames()


def test_a_wrong_password_says_so_and_not_which_part(somebody_early: Somebody) -> None:
    console = somebody_early()
    texts = []
    for name, password in (("alice", "wrong password"), ("nobody", "wrong password")):
        console.sign_in(name, password)
        expect(console.part("sign-in-problem")).not_to_be_empty()
        texts.append(console.part("sign-in-problem").inner_text())
        console.open()
    assert texts[0] == texts[1]
