"""Makes the pictures in docs/screenshots/ from the running product: `.venv/bin/python docs/make_screenshots.py`.

It starts a tower with three simulated drones of its own in a temporary folder, flies them through the console, and
looks. `--look FOLDER` also writes every page at three sizes there, for a person who looks through them.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final, Literal

CHECKOUT: Final = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(CHECKOUT / "tests"), str(CHECKOUT / "tests" / "e2e")]

from console_page import FLAGS, TOURED, ConsolePage  # noqa: E402
from furnished import furnish  # noqa: E402
from playwright.sync_api import Browser, ViewportSize, expect, sync_playwright  # noqa: E402
from worlds.processes import Visitor, World  # noqa: E402

PICTURES: Final = CHECKOUT / "docs" / "screenshots"
SIZE: Final[ViewportSize] = {"width": 1280, "height": 800}
TABLET: Final[ViewportSize] = {"width": 1024, "height": 768}
THEMES: Final[tuple[Literal["dark", "light"], ...]] = ("dark", "light")
PHONE: Final[ViewportSize] = {"width": 390, "height": 844}
LOOKED_AT: Final[tuple[ViewportSize, ...]] = ({"width": 1440, "height": 900}, TABLET, PHONE)
ADMIN_PAGES: Final = {"users": "user-row", "drones": "drone-row", "audit": "audit-row", "system": "system"}
"""Each with what has to be there before the picture is taken."""
OTHER_PAGES: Final = {
    "flights": ("flights", "flight-row"),
    "replay": ("flights/1/45", "events"),
    "statistics": ("statistics", "statistics-total"),
    "zones": ("zones", "zone-row"),
    "setup": ("drone/1/setup/sensors", "setup-sensors"),
    "logs": ("drone/1/logs", "list-logs"),
    "alerts": ("account/alerts", "section-alerts"),
    "maps": ("admin/maps", "map-layer-form"),
}
"""Picture: the page's address, and a part that shows that it is there."""
HOME: Final = (47.3977, 8.5456)
CAMERA: Final = "width=640&height=480&rate=15"
FLEET: Final = {"Kestrel": "alice", "Merlin": "alice", "Osprey": "bob"}


def come(browser: Browser, world: World, name: str) -> ConsolePage:
    context = browser.new_context(viewport=SIZE, color_scheme="dark", reduced_motion="reduce")
    context.add_init_script(TOURED)
    context.set_default_timeout(120_000)
    console = ConsolePage(context.new_page(), world.address)
    console.open()
    console.sign_in(name)
    expect(console.part("squad-row").first).to_be_visible()
    return console


def fly(console: ConsolePage, drone: str, height_m: int, click: tuple[float, float]) -> None:
    """Takes control, takes off, and sends the drone towards a point of the map (as shares of its size)."""
    console.open("/#/")
    console.page.get_by_role("link", name=f"Open {drone}").click()
    console.part("control-acquire").click()
    console.wait("a position", lambda: console.number("latitude") > 40)
    console.part("takeoff-height").fill(str(height_m))
    console.hold_take_off(drone)
    console.wait("height", lambda: console.number("altitude") > height_m - 1)
    console.go_here(*click)


def look_at_administration(admin: ConsolePage) -> None:
    """In both themes."""
    for section, row in ADMIN_PAGES.items():
        admin.open(f"/#/admin/{section}")
        expect(admin.part(row).first).to_be_visible()
        for theme in THEMES:
            admin.page.emulate_media(color_scheme=theme, reduced_motion="reduce")
            admin.page.screenshot(path=PICTURES / f"admin-{section}-{theme}.png")


def look_at_missions(console: ConsolePage) -> None:
    """A survey inside of a fence, drawn for the first drone: on a desk and on a tablet, in both themes."""
    page = console.page
    page.on("dialog", lambda dialog: dialog.accept())
    console.open("/#/missions/1")
    console.wait("the drone's place", lambda: float(console.part("map").get_attribute("data-zoom") or 0) > 10)

    def click(*places: tuple[float, float]) -> None:
        box = console.part("map").bounding_box()
        assert box is not None
        for x, y in places:
            page.mouse.click(box["x"] + box["width"] * x, box["y"] + box["height"] * y)

    console.part("tool-item").click()
    click((0.45, 0.3), (0.6, 0.2), (0.75, 0.35))
    console.part("tool-survey").click()
    field = ((0.3, 0.55), (0.5, 0.52), (0.55, 0.85), (0.3, 0.85))
    click(*field, field[0])
    page.screenshot(path=PICTURES / "missions-survey.png")
    console.part("pattern-add").click()
    page.keyboard.press("f")
    click((0.2, 0.1), (0.9, 0.08), (0.92, 0.55), (0.62, 0.95), (0.2, 0.95))
    page.keyboard.press("Enter")
    page.keyboard.press("r")
    click((0.8, 0.62), (0.27, 0.3))
    page.keyboard.press("v")
    console.part("tab-checks").click()
    console.part("add-return").click()
    console.part("plan-item").nth(2).click()
    for size, name in ((SIZE, "missions"), (TABLET, "missions-tablet")):
        page.set_viewport_size(size)
        for theme in THEMES:
            page.emulate_media(color_scheme=theme, reduced_motion="reduce")
            page.wait_for_timeout(500)
            page.screenshot(path=PICTURES / f"{name}-{theme}.png")


def look_at_video(alice: ConsolePage, admin: ConsolePage) -> None:
    """The drone's picture large, with the map as the inset; and those of the squad beside each other."""
    alice.open("/#/")
    alice.open_drone("Kestrel")
    alice.page.keyboard.press("v")
    expect(alice.part("video")).to_have_attribute("data-state", "live")
    alice.page.wait_for_timeout(6000)
    alice.page.screenshot(path=PICTURES / "control-video.png")
    alice.page.keyboard.press("v")
    admin.open("/#/videos")
    expect(admin.part("video-tile")).to_have_count(len(FLEET))
    for video in admin.part("video").all():
        expect(video).to_have_attribute("data-state", "live")
    admin.page.wait_for_timeout(5000)
    admin.page.screenshot(path=PICTURES / "videos.png")
    admin.open("/#/")


def look_at_parameters(console: ConsolePage) -> None:
    """Of the first drone."""
    console.open("/#/drone/1/parameters")
    expect(console.part("parameter-row").first).to_be_visible()
    console.page.wait_for_timeout(1000)
    console.page.screenshot(path=PICTURES / "parameters.png")


def draw_land(folder: Path) -> None:
    """Writes the land that the cameras see as the tower's maps, as `make run` does."""
    place = ",".join(map(str, HOME))
    words = ("--home", f"{place},488,0", "--hills", "--out", str(folder / "maps"))
    subprocess.run([sys.executable, "-m", "simulator.land_map", *words], check=True, cwd=CHECKOUT)  # noqa: S603 - our own module


def draw_zone(admin: Visitor) -> None:
    """A hospital north-east of home."""
    north, east = HOME[0] + 0.004, HOME[1] + 0.004
    points = [(north, east), (north + 0.001, east), (north + 0.001, east + 0.002), (north, east + 0.002)]
    answer = admin.ask("POST", "/zones", {"name": "Hospital", "kind": "no-fly", "points": points})
    assert answer.status == 201, answer.body


def wait_for_map(console: ConsolePage) -> None:
    """Until the map is at the drones, and time for its tiles to be drawn."""
    expect(console.part("map").locator("canvas.maplibregl-canvas")).to_be_visible()
    console.wait("the drones on the map", lambda: float(console.part("map").get_attribute("data-zoom") or 0) > 10)
    console.page.wait_for_timeout(6000)


def land(console: ConsolePage, drone: str, admin: Visitor) -> None:
    """Ends the flight, so that it can be replayed."""
    console.open("/#/")
    console.open_drone(drone)
    console.ends_flight("land")
    console.wait("the end of the flight", lambda: console.word("armed") == "false")
    kept = lambda: admin.ask("GET", "/flights/1").json["state"] != "recording"  # noqa: E731
    console.wait("the whole record of it", kept)


def look_at_other_pages(console: ConsolePage) -> None:
    """Flights and what comes of them, zones, setup, and what a user chooses."""
    console.page.set_viewport_size(SIZE)
    console.page.emulate_media(color_scheme="dark", reduced_motion="reduce")
    for name, (address, part) in OTHER_PAGES.items():
        console.open(f"/#/{address}")
        expect(console.part(part).first).to_be_visible()
        console.page.wait_for_timeout(8000)  # maps are drawn late without a graphics card
        console.page.screenshot(path=PICTURES / f"{name}.png")


def look_at_every_page(console: ConsolePage, folder: Path) -> None:
    """Each page of the tests at three sizes."""
    from test_every_page import PAGES

    folder.mkdir(parents=True, exist_ok=True)
    for address in PAGES:
        console.open(f"/#/{address}")
        console.page.wait_for_timeout(3000)
        for size in LOOKED_AT:
            console.page.set_viewport_size(size)
            console.page.wait_for_timeout(700)
            console.page.screenshot(path=folder / f"{address.replace('/', '-') or 'monitor'}-{size['width']}.png")


def main() -> None:
    parser = argparse.ArgumentParser(description="Makes the pictures of the documentation.")
    parser.add_argument("--look", type=Path, metavar="FOLDER", help="also write every page at three sizes there")
    options = parser.parse_args()
    shutil.rmtree(PICTURES, ignore_errors=True)
    PICTURES.mkdir(parents=True)
    expect.set_options(timeout=30_000)
    with tempfile.TemporaryDirectory() as folder, World(Path(folder)) as world, sync_playwright() as playwright:
        for operator in ("alice", "bob"):
            world.add_user(operator)
        world.add_user("admin", "admin")
        numbers = [world.add_drone(name, owner) for name, owner in FLEET.items()]
        draw_land(Path(folder))
        world.start_tower()
        flown = ("--boot-s", "2", "--seed", "7", "--wind", "3,250", "--hills")
        world.start_simulated(*FLEET, options=flown, camera=CAMERA)
        world.wait_until_online(world.visitor("admin"), *numbers)
        path = shutil.which("chromium") or shutil.which("google-chrome")
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))

        console = ConsolePage(browser.new_context(viewport=SIZE, color_scheme="dark").new_page(), world.address)
        console.open()
        expect(console.part("sign-in-button")).to_be_visible()
        console.page.screenshot(path=PICTURES / "sign-in.png")

        draw_zone(world.visitor("admin"))
        alice, bob = come(browser, world, "alice"), come(browser, world, "bob")
        fly(alice, "Kestrel", 30, (0.7, 0.3))
        fly(bob, "Osprey", 20, (0.3, 0.65))
        wait_for_map(alice)
        alice.page.screenshot(path=PICTURES / "control.png")
        admin = come(browser, world, "admin")
        wait_for_map(admin)
        admin.page.screenshot(path=PICTURES / "monitor.png")
        look_at_video(alice, admin)
        look_at_parameters(alice)
        alice.open("/#/")
        alice.open_drone("Kestrel")
        alice.page.set_viewport_size(TABLET)
        for theme in THEMES:
            alice.page.emulate_media(color_scheme=theme, reduced_motion="reduce")
            alice.page.wait_for_timeout(1000)
            alice.page.screenshot(path=PICTURES / f"control-tablet-{theme}.png")
        alice.page.set_viewport_size(PHONE)
        alice.page.wait_for_timeout(1000)
        alice.page.screenshot(path=PICTURES / "control-phone.png")
        alice.page.set_viewport_size(SIZE)
        look_at_missions(come(browser, world, "alice"))
        land(alice, "Kestrel", world.visitor("admin"))
        look_at_other_pages(admin)
        furnish(world, world.visitor("admin"))
        look_at_administration(admin)
        if options.look is not None:
            look_at_every_page(admin, options.look)
        browser.close()
    print(f"{len(list(PICTURES.iterdir()))} pictures in {PICTURES.relative_to(CHECKOUT)}")


if __name__ == "__main__":
    main()
