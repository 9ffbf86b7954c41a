"""Maps that an admin chooses, and plans over the hills, in a real browser. No request leaves the tower."""

import json
import math
import re
import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import pytest
from console_page import ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, FilePayload, FloatRect, expect
from worlds.flight_files import position, write_flight
from worlds.processes import World
from worlds.tile_server import TileServer, tile_server

from simulator.geodesy import LocalFrame, Place
from simulator.land_map import elevation
from simulator.land_map.pmtiles import TileType, write_pmtiles
from simulator.land_map.tile_grid import TileGrid
from simulator.terrain import hills_m

HOME: Final = Place(47.3977, 8.5456, 488.0)
FRAME: Final = LocalFrame(HOME)
FAST: Final = ("--boot-s", "2", "--seed", "7", "--speed", "8", "--real-rates", "--hills")
GROUND: Final = re.compile(r"ground -?\d+ m$")


@pytest.fixture(scope="module")
def server() -> Iterator[TileServer]:
    with tile_server() as running:
        yield running


@pytest.fixture(scope="module")
def hills(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """Kestrel (alice's) among the hills, whose heights the tower has, with a recorded flight."""
    folder = tmp_path_factory.mktemp("hills")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        maps = Path(world.environment.get("TOWER_VAR", folder)) / "maps"
        maps.mkdir(parents=True, exist_ok=True)
        grid = TileGrid(FRAME)
        tiles = {tile: elevation.encoded(elevation.heights(grid, tile)) for tile in grid.around_home(14, 2)}
        bounds, about = elevation.bounds(grid), elevation.METADATA
        write_pmtiles(maps / "hills.pmtiles", tiles, TileType.PNG, bounds, about)
        people = {"pilot": "alice", "admin": "admin", "drone": "Kestrel"}
        write_flight(folder / "files" / "flights", drone_id=1, began_at=datetime.now(UTC), lasts_s=60.0, **people)
        world.start_tower()
        world.start_simulated("Kestrel", options=FAST)
        world.wait_until_online(world.visitor("admin"), 1)
        yield world


@pytest.fixture
def come(chromium: Browser, hills: World) -> Iterator[Somebody]:
    with visitors(chromium, hills.address, has_map=True) as somebody:
        yield somebody


def plan_file(*points: tuple[float, float, float]) -> FilePayload:
    """A plan of QGroundControl: north and east of home, and height above it."""
    items: list[dict[str, object]] = [
        {"type": "SimpleItem", "command": 22, "frame": 3, "autoContinue": True, "params": [0, 0, 0, None, 0, 0, 30]}
    ]
    for north_m, east_m, height_m in points:
        place = FRAME.to_place(north_m, east_m, 0.0)
        where = [0, 0, 0, None, place.lat_deg, place.lon_deg, height_m]
        items.append({"type": "SimpleItem", "command": 16, "frame": 3, "autoContinue": True, "params": where})
    mission = {
        "version": 2, "firmwareType": 3, "vehicleType": 2, "cruiseSpeed": 5, "hoverSpeed": 5, "items": items,
        "plannedHomePosition": [HOME.lat_deg, HOME.lon_deg, HOME.alt_amsl_m],
    }  # fmt: skip
    empty = {"version": 2, "circles": [], "polygons": []}
    whole = {
        "fileType": "Plan", "version": 1, "groundStation": "QGroundControl", "mission": mission, "geoFence": empty,
        "rallyPoints": {"version": 2, "points": []},
    }  # fmt: skip
    return {"name": "hill.plan", "mimeType": "application/json", "buffer": json.dumps(whole).encode()}


def planning(come: Somebody) -> ConsolePage:
    console = come()
    console.page.on("dialog", lambda dialog: dialog.accept())
    console.sign_in("alice")
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/missions/1")
    console.wait("the drone's place", lambda: float(console.part("map").get_attribute("data-zoom") or 0) > 10)
    return console


def test_a_layer_is_added_in_the_console_and_no_request_leaves_the_tower(
    come: Somebody, hills: World, server: TileServer
) -> None:
    asked: list[str] = []
    admin = come()
    admin.page.context.on("request", lambda request: asked.append(request.url))
    admin.sign_in("admin")
    admin.open("/#/admin/maps")
    form = admin.part("map-layer-form")
    admin.part("map-preset").select_option("osm")
    expect(admin.part("map-terms")).to_contain_text("not allowed")
    admin.part("map-preset").select_option("")
    admin.part("map-name").fill("Field map")
    form.get_by_label("Credit, shown on the map").fill("© The surveyors")
    admin.part("map-template").fill(server.template)
    admin.part("map-private").check()
    admin.part("map-add").click()
    expect(admin.part("map-layer-list")).to_contain_text("Field map")
    expect(admin.part("map-file-list")).to_contain_text("hills")
    admin.open("/#/")
    expect(admin.part("map-attribution")).to_have_text("© The surveyors · Simulated land")
    admin.wait("tiles", lambda: sum(server.asked.values()) > 4)
    # A coordinate in the search.
    admin.page.keyboard.press("Control+k")
    admin.part("search-text").fill("47°23'52\"N 8°32'44\"E")
    admin.page.keyboard.press("Enter")
    expect(admin.part("map-sought")).to_contain_text("47.39778, 8.54556")
    admin.part("map").hover()
    expect(admin.part("map-readout")).to_have_text(GROUND)
    # A measured way.
    admin.part("map-measure").click()
    box = admin.part("map").bounding_box()
    assert box is not None
    for share in (0.4, 0.6):
        admin.page.mouse.click(box["x"] + box["width"] * share, box["y"] + box["height"] * 0.5)
    admin.wait("a length", lambda: float(admin.part("map-measured").get_attribute("data-metres") or 0) > 10)
    expect(admin.part("map-measured")).to_contain_text("ground")
    assert asked
    ours = (hills.address + "/", "data:", f"blob:{hills.address}/")
    assert [url for url in asked if not url.startswith(ours)] == []


def test_a_plan_into_a_hill_is_refused_with_words(come: Somebody) -> None:
    north_m, east_m = 330.0, 0.0
    hill_m = hills_m(north_m, east_m)
    assert hill_m > 25
    console = planning(come)
    console.part("plan-file").set_input_files(files=[plan_file((north_m, east_m, hill_m - 12), (0.0, 30.0, 40.0))])
    expect(console.part("profile-ground")).to_be_visible()
    console.page.get_by_role("tab", name=re.compile("Checks")).click()
    expect(
        console.page.get_by_text(re.compile(r"The way to item 2 \(Waypoint\) is 1\d m below the ground"))
    ).to_be_visible()
    console.part("strip-acquire").click()
    console.part("upload").click()
    console.part("upload-confirm").click()
    expect(console.part("drone-strip")).to_contain_text(
        re.compile(r"the way of Kestrel to item 2 is 1\d m below the ground; 5 m is the least")
    )
    expect(console.part("board-mission")).not_to_have_attribute("data-standing", "on the drone")


def test_a_survey_above_the_ground_has_more_waypoints_and_no_fault(come: Somebody) -> None:
    console = planning(come)
    box = console.part("map").bounding_box()
    assert box is not None
    console.part("tool-survey").click()
    for x, y in ((0.45, 0.1), (0.6, 0.1), (0.6, 0.45), (0.45, 0.45)):
        console.page.mouse.click(box["x"] + box["width"] * x, box["y"] + box["height"] * y)
    console.part("pattern-finish").click()
    facts = console.part("pattern-facts")
    before = int(facts.get_attribute("data-items") or 0)
    console.part("pattern-over-ground").check()
    console.part("pattern-tolerance").fill("1")
    console.page.keyboard.press("Tab")
    console.wait("more waypoints", lambda: int(facts.get_attribute("data-items") or 0) > before + 4)
    console.part("pattern-add").click()
    console.page.get_by_role("tab", name=re.compile("Checks")).click()
    expect(console.page.get_by_text("above the ground")).to_have_count(0)
    expect(console.page.get_by_text("below the ground")).to_have_count(0)


def drawn_at(console: ConsolePage, box: FloatRect, step: int = 5) -> tuple[float, float]:
    """The pixel in the middle of where the map says that a drone can be pressed."""
    canvas = console.page.locator(".maplibregl-canvas")

    def is_drone(x: float, y: float) -> bool:
        console.page.mouse.move(x, y)
        return bool(canvas.evaluate("canvas => canvas.style.cursor === 'pointer'"))

    left, top = int(box["x"] + box["width"] / 2) - 240, int(box["y"] + box["height"] / 2) - 180
    x, y = next((x, y) for y in range(top, top + 200, 24) for x in range(left, left + 240, 24) if is_drone(x, y))
    inside = [(x + i, y + j) for i in range(-45, 50, step) for j in range(-5, 50, step) if is_drone(x + i, y + j)]
    return sum(x for x, _ in inside) / len(inside), sum(y for _, y in inside) / len(inside)


def place_at(console: ConsolePage, pixel: tuple[float, float]) -> tuple[float, float]:
    """North and east of home, metres: MapLibre's own answer, as the read-out gives it."""
    console.page.mouse.move(*pixel)
    lat, lon = re.findall(r"-?\d+\.\d+", console.part("map-readout").inner_text())[:2]
    return FRAME.to_local(float(lat), float(lon))


@pytest.mark.long("the look of a tilted map")
def test_a_tilted_map_shows_a_drone_where_it_is(come: Somebody) -> None:
    console = come()
    console.sign_in("alice")
    console.wait("the drone's place", lambda: float(console.part("map").get_attribute("data-zoom") or 0) > 10)
    tilt, box = console.part("map-tilt"), console.part("map").bounding_box()
    assert box is not None
    expect(tilt).to_have_attribute("aria-pressed", "false")
    # Away from the middle, which stays when a map is tilted.
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    console.page.mouse.move(*middle)
    console.page.mouse.down()
    console.page.mouse.move(middle[0] - 150, middle[1] - 130, steps=8)
    console.page.mouse.up()
    flat = drawn_at(console, box)
    flat_place = place_at(console, flat)
    tilt.click()
    expect(tilt).to_have_attribute("aria-pressed", "true")
    tilted = drawn_at(console, box)
    assert tilted[1] - flat[1] > 30, "the upper half comes nearer to the middle"
    for north_m, east_m in (flat_place, place_at(console, tilted)):
        assert abs(north_m) < 12
        assert abs(east_m) < 12
    tilt.click()
    again = drawn_at(console, box)
    assert abs(again[1] - flat[1]) < 4


def eye_past_m(console: ConsolePage, box: FloatRect, pixel: tuple[float, float], place: tuple[float, ...]) -> float:
    """How far the ray of sight through a pixel passes the place (metres north, east, above home) on the tilted map. The
    ray ends where MapLibre says that the pixel is on the ground; the eye is where its documents put it."""
    zoom = float(console.part("map").get_attribute("data-zoom") or 0)
    px_m = 40_075_016.7 * math.cos(math.radians(HOME.lat_deg)) / (512 * 2**zoom)
    away_m = box["height"] / 2 / math.tan(math.radians(36.87 / 2)) * px_m
    north, east = place_at(console, (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2))
    tilt = math.radians(55)
    eye = (north - away_m * math.sin(tilt), east, float(hills_m(north, east)) + away_m * math.cos(tilt))
    seen = place_at(console, pixel)
    ray = [end - begin for end, begin in zip((*seen, float(hills_m(*seen))), eye, strict=True)]
    to_place = [end - begin for end, begin in zip(place, eye, strict=True)]
    along = sum(a * b for a, b in zip(ray, to_place, strict=True)) / sum(a * a for a in ray)
    return math.dist(to_place, [along * a for a in ray])


@pytest.mark.long("the look of a replay over the ground")
def test_a_replay_stands_over_the_shape_of_the_ground(come: Somebody, hills: World) -> None:
    console = come()
    asked: list[str] = []
    console.page.context.on("request", lambda request: asked.append(request.url))
    console.sign_in("alice")
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/flights")
    console.part("flight-replay").click()
    expect(console.part("replay")).to_have_attribute("data-whole", "true")
    console.part("scrub").fill("35000")
    console.wait("the way", lambda: float(console.part("map").get_attribute("data-zoom") or 0) > 13)
    console.page.get_by_role("button", name="Whole track").click()
    box = console.part("map").bounding_box()
    assert box is not None
    # A hill in the middle: what is in the plain must not be drawn as high as it.
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    console.page.mouse.move(*middle)
    console.page.mouse.down()
    console.page.mouse.move(middle[0] - 180, middle[1] - 40, steps=8)
    console.page.mouse.up()
    before = place_at(console, middle)
    console.part("map-tilt").click()
    expect(console.page.locator("[data-shaped=true]")).to_be_visible()
    lat, lon, height_m, _ = position(35.0)
    drone = (*FRAME.to_local(lat, lon), height_m)
    pixel = (0.0, 0.0)

    def is_where_it_is() -> bool:
        nonlocal pixel
        pixel = drawn_at(console, box, step=10)
        return eye_past_m(console, box, pixel, drone) < 15

    console.wait("the drone where it is", is_where_it_is, timeout_s=30)
    assert float(hills_m(*place_at(console, middle))) > 12, "on a hill"
    under_it = (*drone[:2], float(hills_m(*drone[:2])))
    assert eye_past_m(console, box, pixel, under_it) > 20
    console.part("map-tilt").click()
    console.wait("the view as before", lambda: math.dist(place_at(console, middle), before) < 4)
    expect(console.page.locator("[data-shaped=false]")).to_be_visible()
    ours = (hills.address + "/", "data:", f"blob:{hills.address}/")
    assert asked
    assert [url for url in asked if not url.startswith(ours)] == []
