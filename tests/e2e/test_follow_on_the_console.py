"""A drone that follows another one, and a formation, from the browser: configured, flown, ended with messages."""

import math
import shutil
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Final

import pytest
from console_page import METRES_PER_DEGREE, ConsolePage, Somebody, signed_in
from playwright.sync_api import TimeoutError as Unclickable
from playwright.sync_api import expect
from worlds.processes import Visitor, World, wait_for

SQUAD: Final = {1: "Kestrel", 2: "Merlin", 3: "Osprey"}


@pytest.fixture
def quiet_world(tmp_path: Path, prepared_folder: Path) -> Iterator[World]:
    """A tower with a third drone, Osprey, that alice and bob share."""
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    with World(tmp_path, prepared=True) as world:
        assert world.add_drone("Osprey", "alice", "bob") == 3
        world.start_tower()
        yield world


def seen_from(leader: ConsolePage, follower: ConsolePage) -> tuple[float, float, float]:
    """Returns metres north, east and above, as the two pages show them. The homes are equally high."""
    lat = leader.number("latitude")
    north = (follower.number("latitude") - lat) * METRES_PER_DEGREE
    east = (follower.number("longitude") - leader.number("longitude")) * METRES_PER_DEGREE
    return north, east * math.cos(math.radians(lat)), follower.number("altitude") - leader.number("altitude")


@pytest.mark.drones("Kestrel", "Osprey")
def test_it_follows_keeps_its_place_and_holds_when_stopped_or_when_the_leader_lands(somebody: Somebody) -> None:
    bob = signed_in(somebody, "bob", "Osprey", has_map=True)
    alice = signed_in(somebody, "alice", "Kestrel")
    bob.acquire("Osprey")
    alice.acquire("Kestrel")
    alice.part("in-flight").locator("summary").click()
    expect(alice.part("follow-leader")).to_be_disabled()
    bob.take_off("Osprey", 12)
    alice.take_off("Kestrel", 12)

    alice.part("follow-leader").select_option(label="Osprey")
    alice.part("follow-side").select_option("metres")
    alice.part("follow-north").fill("-3")
    alice.part("follow-up").fill("5")
    expect(alice.part("follow-place")).to_contain_text("Too near")
    expect(alice.part("action-follow")).to_be_disabled()
    alice.part("follow-north").fill("-15")
    expect(alice.part("follow-place")).to_contain_text("15 m south of Osprey and 5 m above it")
    alice.part("action-follow").click()
    expect(alice.page.get_by_role("dialog")).to_contain_text("Have Kestrel follow Osprey?")
    expect(alice.page.get_by_role("dialog")).to_contain_text("It holds where it is when Osprey lands or is lost")
    alice.confirm("Kestrel")
    expect(alice.part("action-report")).to_contain_text("Kestrel flies to 15 m south of Osprey")
    expect(alice.part("follow-phase")).to_contain_text("Kestrel: following Osprey")

    def in_place() -> bool:
        north, east, up = seen_from(bob, alice)
        return abs(north + 15) < 2 and abs(east) < 2 and abs(up - 5) < 1

    alice.wait("its place", in_place)
    begins = bob.number("latitude")
    bob.press_map()
    bob.part("place-more").locator("summary").click()
    bob.part("goto-place").fill(f"{begins + 40 / METRES_PER_DEGREE:.7f}, {bob.number('longitude'):.7f}")
    bob.part("goto-confirm").click()
    bob.wait("40 m further on", lambda: (bob.number("latitude") - begins) * METRES_PER_DEGREE > 38)
    alice.wait("its place, 40 m further on", in_place)

    # It is stopped by a button and holds, and follows again, now from above.
    alice.part("follow-stop").click()
    expect(alice.part("follow-end")).to_contain_text(
        "Kestrel: It was ordered to stop following Osprey. It holds in BRAKE"
    )
    alice.wait("BRAKE", lambda: alice.word("mode") == "BRAKE")
    alice.part("follow-side").select_option("above")
    alice.part("follow-up").fill("12")
    alice.part("action-follow").click()
    alice.confirm("Osprey")
    expect(alice.part("follow-phase")).to_contain_text("following Osprey")

    # A page opened meanwhile shows it too.
    alice.page.reload()
    expect(alice.part("follow-phase")).to_contain_text("Kestrel: following Osprey")
    bob.ends_flight("land")
    expect(alice.part("follow-end")).to_contain_text("Osprey is not in the air", timeout=60_000)
    expect(alice.part("follow-end")).to_contain_text("Kestrel")
    expect(alice.part("follow-end")).to_contain_text("It holds in BRAKE")
    alice.wait("a stop", lambda: alice.number("speed") < 0.5 and alice.word("mode") == "BRAKE")
    assert alice.number("altitude") > 3


@pytest.mark.drones("Kestrel", "Merlin", "Osprey")
def test_an_admin_forms_a_line_and_lets_all_hold(somebody: Somebody, world: World) -> None:
    admin = somebody()
    admin.sign_in("admin")
    expect(admin.part("squad-row")).to_have_count(3)
    visitor = world.visitor("admin")
    for number, drone_id in enumerate(SQUAD):
        wait_for(f"drone {drone_id} to know its place and home", partial(may_take_off, visitor, drone_id))
        assert visitor.ask("POST", f"/drones/{drone_id}/control/acquire").status == 200
        visitor.accept_loss_check(drone_id)
        command = {"command": "takeoff", "height_m": 12 + 10 * (number % 2)}
        answer = visitor.ask("POST", f"/drones/{drone_id}/commands", command)
        assert answer.json.get("state") == "done", answer.body
    admin.part("choose-all").check()
    admin.part("squad-mission-link").click()
    admin.part("squad-job").get_by_text("Formation").click()
    expect(admin.part("formation-cannot")).to_contain_text("Choose the leader")
    admin.part("formation-leader").select_option(label="Osprey")
    admin.part("formation-shape").get_by_text("Line").click()
    admin.part("formation-heading").fill("0")
    admin.part("formation-step").fill("10")
    admin.wait("all in the air", lambda: formed(admin))
    for name in SQUAD.values():
        expect(admin.page.get_by_role("dialog")).to_contain_text(name)
    admin.confirm("Kestrel")
    expect(admin.part("formation-answer")).to_have_count(2)
    admin.wait("both in place", lambda: in_place(admin))
    expect(admin.part("formation-answer").first).to_contain_text("following Osprey")

    admin.part("formation-stop").click()
    admin.wait("both hold", lambda: states(admin) == ["ended"] * 2)
    for answer in admin.part("formation-answer").all():
        expect(answer).to_contain_text("It holds in BRAKE")


def may_take_off(visitor: Visitor, drone_id: int) -> bool:
    """An autopilot that is still starting refuses it."""
    lines = {line["key"]: line["state"] for line in visitor.ask("GET", f"/drones/{drone_id}/preflight").json["lines"]}
    return {lines["position"], lines["home"]} == {"good"}


def formed(console: ConsolePage) -> bool:
    """Requests it until the page knows that all of them fly."""
    with suppress(Unclickable):  # the dialog came after the last look, and covers the button
        console.part("formation-form").click(timeout=2_000)
    return console.page.get_by_role("dialog").count() > 0


def in_place(console: ConsolePage) -> bool:
    found = states(console)
    assert "ended" not in found, [answer.inner_text() for answer in console.part("formation-answer").all()]
    return found == ["following"] * 2


def states(console: ConsolePage) -> list[str]:
    return [part.get_attribute("data-state") or "" for part in console.part("formation-answer").all()]


RECEIVER: Final = """() => {
  const getCurrentPosition = (found) => {
    const [latitude, longitude] = window.person;
    const coords = { latitude, longitude, accuracy: 4, speed: null, heading: null };
    setTimeout(() => found({ timestamp: Date.now(), coords }), 50);
  };
  Object.defineProperty(navigator, 'geolocation', { value: { getCurrentPosition } });
}"""
"""Evaluated on every call, because Playwright keeps the time at which it set a position."""


def stands_at(console: ConsolePage, place: tuple[float, float]) -> None:
    """Moves the person at this browser to this place."""
    console.page.evaluate("(place) => { window.person = place }", list(place))


def away_from(console: ConsolePage, person: tuple[float, float]) -> tuple[float, float]:
    """Returns the drone's metres north and east of the person."""
    lat, lon = person
    east = (console.number("longitude") - lon) * METRES_PER_DEGREE * math.cos(math.radians(lat))
    return (console.number("latitude") - lat) * METRES_PER_DEGREE, east


def test_it_follows_the_person_at_the_browser_and_holds_when_that_is_closed(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 12)
    lat, lon = alice.number("latitude"), alice.number("longitude")
    person = (lat - 30 / METRES_PER_DEGREE, lon)
    alice.part("in-flight").locator("summary").click()

    # Following requires permission to read the position.
    alice.part("action-follow-me").click()
    expect(alice.part("action-report")).to_contain_text("may not share its position")
    alice.page.context.grant_permissions(["geolocation"])
    alice.page.context.set_geolocation({"latitude": person[0], "longitude": person[1], "accuracy": 30.0})
    alice.part("action-follow-me").click()
    expect(alice.page.get_by_role("dialog")).to_contain_text("Your position is accurate to 30 m")
    alice.confirm("Kestrel")
    expect(alice.part("action-report")).to_contain_text("accurate to 30 m only: Kestrel needs 15 m to follow you")

    alice.page.evaluate(RECEIVER)
    stands_at(alice, person)
    alice.part("action-follow-me").click()
    expect(alice.page.get_by_role("dialog")).to_contain_text("Have Kestrel follow you?")
    expect(alice.page.get_by_role("dialog")).to_contain_text("15 m away over ground and 12 m above home")
    alice.confirm("Kestrel")
    expect(alice.part("action-report")).to_contain_text("Kestrel follows you")
    expect(alice.part("follow-phase")).to_contain_text("Kestrel: following alice")

    def in_place() -> bool:
        north, east = away_from(alice, person)
        return abs(north - 15) < 2 and abs(east) < 2 and abs(alice.number("altitude") - 12) < 1

    alice.wait("its place", in_place)
    person = (person[0] - 8 / METRES_PER_DEGREE, lon)
    stands_at(alice, person)
    alice.wait("its place, 8 m further on", in_place)
    # Works on every page.
    alice.page.evaluate("location.hash = '#/'")
    expect(alice.part("squad-row").first).to_be_visible()
    person = (person[0] - 6 / METRES_PER_DEGREE, lon)
    stands_at(alice, person)
    alice.open_drone("Kestrel")
    alice.wait("its place, 6 m further on", in_place)

    alice.page.reload()
    expect(alice.part("follow-end").or_(alice.part("value-armed")).first).to_be_visible()
    alice.wait("BRAKE", lambda: alice.word("mode") == "BRAKE")
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
