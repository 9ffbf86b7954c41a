"""The flight bar: Hold works whatever is open, at every size; what is lost or low stands out; deeds counted in clicks.

One world for the module: alice owns four drones, bob one. Kestrel's frames pass through a tap at its simulator's
port. The others are switched on in the tests that need them; Swift's battery is low.
"""

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import pytest
from axe_look import THEMES, Axe
from console_page import SIMULATOR, ConsolePage, Somebody, signed_in, visitors
from playwright.sync_api import Browser, Locator, Route, expect
from worlds.frame_tap import FrameTap, frame_tap
from worlds.free_ports import free_udp_ports
from worlds.processes import CHECKOUT, World, kill_9
from worlds.tiers import is_long

DO_SET_MODE: Final = 176
PRESSES: Final = ("click", "key", "tap")
SIZES: Final = ((1440, 900), (1024, 768), (390, 844))
TARGET_PX: Final = 44
IDS: Final = {"Kestrel": 1, "Merlin": 2, "Osprey": 3, "Swift": 4, "Harrier": 5}
MISSION: Final = [
    [22, 3, [0, 0, 0, None], 473977000, 85456000, 20, 1],
    *([16, 3, [0, 0, 0, None], 473977000 + step * 90000, 85456000, 20, 1] for step in (1, 2)),
]
"""Kilometres long: it is flown for minutes."""
DIALOGS: Final = {
    "open-settings": "checks",
    "open-keys": None,
    "stick-setup": "commands",
    "rehearse": "checks",
    "action-arm": "commands",
}
"""The buttons of the Control page that open one each, and their panel."""
TAKES_TEXT: Final = "input:is([type=text], [type=search], :not([type]))"
ELSEWHERE: Final = {
    "#/": (("user-menu",), ("choose-all", "squad-hold")),
    "#/missions/1": (("plan-menu", "plan-library"),),
    "#/drone/1/parameters": (("parameter-compare",),),
    "#/account/tokens": (("new-token",),),
}
"""What opens dialogs and menus of other pages, one press after the other."""
OPENED: Final = "[role=dialog], [role=menu]"
FIRST_TAKES_TEXT: Final = ("plan-library", "new-token")
"""Those that put the focus into a text field at once, where `h` is a letter."""


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[World, FrameTap]]:
    with World(tmp_path_factory.mktemp("field")) as world:
        world.add_user("alice")
        world.add_user("admin", "admin")
        world.add_user("bob")
        for name in IDS:
            world.add_drone(name, "bob" if name == "Harrier" else "alice")
        world.start_tower()
        (port,) = free_udp_ports(1)
        with frame_tap(port) as tap:
            world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}")
            out = ("--out", f"udp:127.0.0.1:{tap.port}", "--home", "47.3977,8.5456,488,0")
            world.start("tapped", "tower-sim", *out, *SIMULATOR)
            world.wait_until_online(world.visitor("admin"), IDS["Kestrel"])
            yield world, tap


@contextmanager
def switched_on(world: World, drone: str, *options: str) -> Iterator[None]:
    """Starts its agent and its simulator, and ends both afterwards."""
    (port,) = free_udp_ports(1)
    out = ("--out", f"udp:127.0.0.1:{port}", "--home", "47.3979,8.5458,488,0")
    programs = [
        world.start_agent(drone, f"udpin:127.0.0.1:{port}"),
        world.start(f"simulator-{drone}", "tower-sim", *out, *options, *SIMULATOR),
    ]
    world.wait_until_online(world.visitor("admin"), IDS[drone])
    yield
    for program in programs:
        program.terminate()


@pytest.fixture
def merlin(field: tuple[World, FrameTap]) -> Iterator[None]:
    with switched_on(field[0], "Merlin"):
        yield


@pytest.fixture
def osprey(field: tuple[World, FrameTap]) -> Iterator[None]:
    with switched_on(field[0], "Osprey"):
        yield


@pytest.fixture
def swift(field: tuple[World, FrameTap]) -> Iterator[None]:
    with switched_on(field[0], "Swift", "--fail", "battery-low"):
        yield


@pytest.fixture
def harrier(field: tuple[World, FrameTap]) -> Iterator[None]:
    with switched_on(field[0], "Harrier"):
        yield


@pytest.fixture(autouse=True)
def released(field: tuple[World, FrameTap]) -> Iterator[None]:
    """Alice controls nothing when a test begins, whatever became of the one before."""
    alice = field[0].visitor("alice")
    me = alice.ask("GET", "/me").json["id"]
    for drone in alice.ask("GET", "/drones").json:
        if drone["holder"] and drone["holder"]["id"] == me:
            assert alice.ask("POST", f"/drones/{drone['id']}/control/release").status == 200
    yield


@pytest.fixture
def come(chromium: Browser, field: tuple[World, FrameTap]) -> Iterator[Somebody]:
    with visitors(chromium, field[0].address) as somebody:
        yield somebody


def expect_hold(console: ConsolePage, tap: FrameTap, press: str, where: str) -> None:
    """Hold by "click", "key" or "tap" reaches the simulator's port in time."""
    button = console.part("bar-hold")
    box = button.bounding_box()
    assert box is not None and box["height"] >= 48 and box["width"] >= 48, where
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    at_s = time.monotonic()
    if press == "click":
        console.page.mouse.click(*middle)
    elif press == "tap":
        console.page.touchscreen.tap(*middle)
    else:
        console.page.keyboard.press("h")
    console.wait(f"a hold by {press}: {where}", lambda: tap.first_after(at_s, DO_SET_MODE) is not None)
    took_s = tap.first_after(at_s, DO_SET_MODE)
    assert took_s is not None
    print(f"{where}: {press} {took_s * 1000:.0f} ms")


def small(parts: Locator) -> list[str]:
    """Those of these targets that are smaller than a finger."""
    found: list[str] = parts.evaluate_all(
        f"""(all) => all.filter((one) => one.getClientRects().length > 0).filter((one) => {{
          const {{ width, height }} = one.getBoundingClientRect();
          return width < {TARGET_PX} || height < {TARGET_PX};
        }}).map((one) => one.outerHTML.slice(0, 120))"""
    )
    return found


def expect_accessible(console: ConsolePage, width: int) -> None:
    axe = Axe()
    state = f"control at {width}"
    for theme in THEMES if width == SIZES[0][0] or is_long() else THEMES[:1]:
        axe.look_in(console, theme, state)
    assert not axe.faults, "\n".join(axe.faults)


def test_hold_works_with_every_dialog_open_at_three_sizes(come: Somebody, field: tuple[World, FrameTap]) -> None:
    _, tap = field
    alice = signed_in(come, "alice", "Kestrel", has_touch=True)
    alice.acquire("Kestrel")
    alice.wait("the autopilot", lambda: alice.word("mode") != "")
    dialog = alice.page.get_by_role("dialog")
    for number, (width, height) in enumerate(SIZES):
        alice.page.set_viewport_size({"width": width, "height": height})
        for at, (opener, panel) in enumerate(DIALOGS.items()):
            if panel:
                alice.open_panel(panel)
            elif alice.part("view-more").is_visible() and not alice.part(opener).is_visible():
                alice.part("view-more").click()
            alice.part(opener).click()
            expect(dialog).to_be_visible()
            # Each dialog at each size, with each press at one of them; the long tier with each at all.
            for press in PRESSES if is_long() else (PRESSES[(number + at) % len(PRESSES)],):
                expect_hold(alice, tap, press, f"{opener} at {width}")
                expect(dialog).to_be_visible()
            alice.page.keyboard.press("Escape")
            expect(dialog).to_have_count(0)
        expect_accessible(alice, width)
        assert small(alice.part("flight-bar").locator("a, button")) == []
    # With the dialogs and menus of other pages.
    alice.page.set_viewport_size({"width": 1440, "height": 900})
    for page, openers in ELSEWHERE.items():
        alice.page.evaluate(f"window.location.hash = '{page}'")
        for way in openers:
            for opener in way:
                alice.part(opener).click()
            opened = alice.page.locator(OPENED)
            expect(opened.last).to_be_visible()
            # The focus moves in with the frame after the one that shows it: only then does a key have its place.
            # A function: an expression is evaluated anew in the page, where the Content-Security-Policy forbids that.
            alice.page.wait_for_function(f"() => document.activeElement?.closest('{OPENED}')")
            takes_text = alice.page.evaluate(f"document.activeElement.matches('{TAKES_TEXT}')")
            assert takes_text == (way[-1] in FIRST_TAKES_TEXT), way
            for press in ("click", "tap") if takes_text else PRESSES:
                expect_hold(alice, tap, press, " ".join((page, *way)))
            if takes_text:
                opened.last.get_by_role("button").last.focus()
                expect_hold(alice, tap, "key", " ".join((page, *way)))
            alice.page.keyboard.press("Escape")
            expect(opened).to_have_count(0)
    # On other pages, below the alerts, and in a text field, where a letter is a letter.
    for page in ("#/", "#/missions", "#/account"):
        alice.page.evaluate(f"window.location.hash = '{page}'")
        expect(alice.part("bar-own")).to_contain_text("Kestrel")
        alice.part("bar-alerts").click()
        expect_hold(alice, tap, "key", page)
        expect_hold(alice, tap, "tap", page)
        alice.part("bar-alerts").click()
    alice.page.evaluate("window.location.hash = '#/'")
    sent = len(tap.commands)
    alice.part("squad-search").press_sequentially("h")
    expect(alice.part("squad-search")).to_have_value("h")
    assert [which for _, which in tap.commands[sent:] if which == DO_SET_MODE] == []
    alice.page.evaluate("window.location.hash = '#/drone/1'")
    alice.part("control-release").click()
    expect(alice.part("control-acquire")).to_be_visible()


def test_hold_works_over_a_place_an_upload_and_a_proof(come: Somebody, field: tuple[World, FrameTap]) -> None:
    """The dialogs that need a drone in flight, a plan, or a session whose proof is old."""
    _, tap = field
    alice = signed_in(come, "alice", "Kestrel", has_touch=True, has_map=True)
    page, dialog = alice.page, alice.page.get_by_role("dialog")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 8)
    page.keyboard.press("g")
    page.keyboard.press("Enter")
    expect(alice.part("map-menu")).to_be_visible()
    for press in PRESSES:
        expect_hold(alice, tap, press, "go to")
        expect(alice.part("map-menu")).to_be_visible()
    page.keyboard.press("Escape")
    expect(alice.part("map-menu")).to_have_count(0)

    page.evaluate("window.location.hash = '#/missions/1'")
    alice.part("plan-file").set_input_files(CHECKOUT / "web" / "test" / "plan" / "files" / "survey.plan")
    alice.part("import-open").click()
    alice.part("upload").click()
    expect(alice.part("upload-dialog")).to_be_visible()
    for press in PRESSES:
        expect_hold(alice, tap, press, "upload")
        expect(alice.part("upload-dialog")).to_be_visible()
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)

    page.evaluate("window.location.hash = '#/account/tokens'")
    alice.part("new-token").click()
    alice.part("token-name").fill("with a proof")
    problem = {"type": "/problems/proof-needed", "title": "Confirm that it is you", "status": 403}

    def too_old(route: Route) -> None:
        if route.request.method == "POST":
            route.fulfill(status=403, content_type="application/problem+json", body=json.dumps(problem))
        else:
            route.continue_()

    page.route("**/api/v1/tokens", too_old)
    alice.part("token-make").click()
    expect(alice.part("proof-password")).to_be_visible()
    alice.part("proof-password").fill("")
    for press in ("click", "tap"):
        expect_hold(alice, tap, press, "proof")
        expect(alice.part("proof-dialog")).to_be_visible()
    sent = len(tap.commands)
    alice.part("proof-password").press_sequentially("h")  # a letter of the password
    expect(alice.part("proof-password")).to_have_value("h")
    assert [which for _, which in tap.commands[sent:] if which == DO_SET_MODE] == []
    alice.part("proof-close").focus()
    expect_hold(alice, tap, "key", "proof")


def test_a_full_screen_keeps_the_figures_and_hold(come: Somebody, field: tuple[World, FrameTap]) -> None:
    _, tap = field
    alice = signed_in(come, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.page.keyboard.press("v")
    alice.page.evaluate("document.documentElement.requestFullscreen()")
    alice.page.wait_for_function("() => document.fullscreenElement")
    for part in ("height", "speed", "battery", "state", "alerts", "hold"):
        expect(alice.part(f"bar-{part}")).to_be_visible()
    for press in ("click", "key"):
        expect_hold(alice, tap, press, "full screen")
    alice.page.evaluate("document.exitFullscreen()")
    alice.part("control-release").click()
    dialog = alice.page.get_by_role("dialog")  # in flight it asks
    expect(dialog.or_(alice.part("control-acquire"))).to_be_visible()
    if dialog.count():
        alice.confirm("Kestrel")
    expect(alice.part("control-acquire")).to_be_visible()


@pytest.mark.usefixtures("osprey", "swift")
def test_a_lost_drone_stands_out_everywhere(come: Somebody, field: tuple[World, FrameTap]) -> None:
    world, _ = field
    admin = signed_in(come, "admin")
    admin.wait_for_frames(3)
    alice = signed_in(come, "alice", "Osprey")
    alice.acquire("Osprey")
    alice.take_off("Osprey", 8)
    alice.part("manual-toggle").click()
    alice.confirm("Osprey")
    expect(alice.part("manual-bars")).to_have_attribute("data-phase", "flying")
    alice.wait("LOITER", lambda: alice.word("mode") == "LOITER")
    kill_9(world.running("agent-Osprey"))
    state = alice.part("bar-state")
    expect(state).to_contain_text("LINK LOST")
    expect(state).to_contain_text("flown by hand: holds; returns in")
    expect(state).to_have_attribute("data-tone", "danger")
    expect(alice.part("countdown")).to_contain_text("was flown by hand (LOITER); it holds")
    alice.page.evaluate("window.location.hash = '#/'")
    alice.part("squad-sort").select_option(label="attention first")
    first = alice.part("squad-row").first
    expect(first).to_have_attribute("data-drone-id", "3")
    expect(first).to_have_attribute("data-trouble", "link-lost")
    expect(first.get_by_test_id("row-does")).to_contain_text("flown by hand: holds")
    troubles = [row.get_attribute("data-trouble") for row in alice.part("squad-row").all()]
    found = [kind for kind in troubles if kind]  # tests before this one may have left Kestrel in the air nearby
    assert (found[0], found[-1]) == ("link-lost", "battery-on-ground"), "on the ground it endangers nobody"
    assert "4" in alice.squad()[2:]
    alice.page.get_by_role("button", name="Show Osprey on the map").click()
    expect(alice.part("card-trouble")).to_have_text("Lost in the air")
    # Whoever comes to the page after the loss learns the same from the tower.
    alice.open("/#/drone/3")
    alice.page.reload()
    expect(alice.part("bar-state")).to_contain_text("LINK LOST")
    expect(alice.part("bar-state")).to_contain_text("flown by hand: holds; return")
    # Somebody else finds it without a click.
    expect(admin.part("bar-trouble")).to_have_attribute("data-drone-id", "3")
    expect(admin.part("bar-trouble")).to_contain_text("Lost in the air")
    # One click in the bar, and everybody knows that somebody has seen to it.
    admin.part("flight-bar").get_by_test_id("acknowledge").click()
    alice.part("bar-alerts").click()
    alert = alice.page.locator("[data-testid=alert][data-rule=link-lost][data-drone-id='3']")
    expect(alert).to_contain_text("Osprey lost its link in the air at")
    expect(alert).to_contain_text("It was flown by hand; it holds, then it returns after")
    expect(alert).to_contain_text("acknowledged by admin")
    expect(admin.part("flight-bar").get_by_test_id("acknowledge")).to_have_count(0)
    expect(admin.part("bar-trouble")).to_have_attribute("data-drone-id", "3")


@pytest.mark.usefixtures("harrier")
def test_a_drone_lost_in_its_mission_is_known_to_whoever_opens_the_console_later(
    come: Somebody, field: tuple[World, FrameTap]
) -> None:
    world, _ = field
    bob = signed_in(come, "bob", "Harrier")
    bob.acquire("Harrier")
    bob.take_off("Harrier", 20)
    by_rest = world.visitor("bob")
    put = by_rest.ask("PUT", "/drones/5/mission", {"items": MISSION, "while_flying": True})
    assert put.json["state"] == "done", put.body
    started = by_rest.ask("POST", "/drones/5/commands", {"command": "start"})
    assert started.json["state"] == "done", started.body
    expect(bob.part("bar-state")).to_contain_text("AUTO")
    expect(bob.part("bar-state")).to_contain_text("flies its mission")
    kill_9(world.running("agent-Harrier"))
    expect(bob.part("bar-state")).to_contain_text("goes on with its mission; returns in")
    expect(bob.part("countdown")).to_contain_text("it goes on with it until its agent returns it in about")

    admin = signed_in(come, "admin")
    admin.part("squad-sort").select_option(label="attention first")
    row = admin.page.locator("[data-testid=squad-row][data-drone-id='5']")
    expect(row).to_have_attribute("data-trouble", "link-lost")
    expect(row.get_by_test_id("row-does")).to_contain_text("goes on with its mission; return")
    expect(row).to_have_class(re.compile("critical"))
    troubles = [one.get_attribute("data-trouble") for one in admin.part("squad-row").all()]
    assert troubles == sorted(troubles, key=lambda kind: kind != "link-lost"), "whatever was lost comes first"
    expect(admin.part("bar-trouble")).to_contain_text("Lost in the air")
    admin.page.get_by_role("button", name="Show Harrier on the map").click()
    expect(admin.part("card-trouble")).to_have_text("Lost in the air")
    expect(admin.part("card-loss")).to_contain_text("Harrier was flying its mission; it ")


@contextmanager
def clicks(console: ConsolePage, deed: str, count: int) -> Iterator[None]:
    """The deed within takes this many presses of a pointer or of a key, as the page counts them."""
    console.page.evaluate(
        """() => {
          window.presses = 0;
          window.countPress ??= () => (window.presses += 1);
          for (const kind of ['pointerdown', 'keydown']) window.addEventListener(kind, window.countPress, true);
        }"""
    )
    yield
    pressed = console.page.evaluate("window.presses")
    assert pressed == count, f"{deed}: {pressed} clicks"


@pytest.mark.usefixtures("merlin")
def test_the_commonest_deeds_counted_in_clicks(come: Somebody, field: tuple[World, FrameTap]) -> None:
    """Besides finding the drone in trouble, which takes none: see the tests of lost drones."""
    alice = signed_in(come, "alice", has_map=True)
    with clicks(alice, "open a drone", 1):
        alice.open_drone("Kestrel")
    with clicks(alice, "take control", 1):
        alice.part("control-acquire").click()
        expect(alice.part("bar-own")).to_contain_text("Kestrel")
    with clicks(alice, "look at another drone", 2):
        alice.part("bar-switch").click()
        alice.page.locator("[data-testid=switch-drone][data-drone-id='2']").click()
        expect(alice.part("bar-other")).to_contain_text("Merlin")
    with clicks(alice, "take it in place of one's own", 2):
        alice.part("bar-take").click()
        expect(alice.page.get_by_role("dialog")).to_contain_text(
            "You control Kestrel. Release it and take control of Merlin?"
        )
        alice.part("confirm-button").click()
        expect(alice.part("bar-own")).to_contain_text("Merlin")
    expect(alice.part("bar-other")).to_have_count(0)
    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") > 40)
    alice.read_loss_check("Merlin")
    with clicks(alice, "arm and take off", 1):  # held for a second
        alice.hold_take_off("Merlin")
        alice.wait("the take-off", lambda: alice.number("altitude") > 9)
    with clicks(alice, "go to a place", 2):
        alice.go_here(0.6, 0.6)
        alice.wait("the way there", lambda: alice.number("speed") > 1)
    for deed, mode in (("return", "RTL"), ("land", "LAND")):
        with clicks(alice, deed, 1):  # held for a second
            alice.ends_flight(deed)
            alice.wait(mode, lambda mode=mode: alice.word("mode") == mode)  # type: ignore[misc]
        with clicks(alice, "hold", 1):
            alice.part("bar-hold").click()
            alice.wait("BRAKE", lambda: alice.word("mode") == "BRAKE")
    with clicks(alice, "enlarge the video", 1):
        alice.part("swap").click()
    with clicks(alice, "release the controls in flight", 2):
        alice.part("control-release").click()
        alice.part("confirm-button").click()
        expect(alice.part("control-acquire")).to_be_visible()
