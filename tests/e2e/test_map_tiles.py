"""Tiles from the tower on the map: drawn where they exist, and the coastline elsewhere."""

import base64
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from console_page import ConsolePage, signed_in, visitors
from playwright.sync_api import Browser, FloatRect, expect
from worlds.processes import World
from worlds.tile_files import MVT, PNG, all_over_mvt, one_colour_png, place_mvt, write_tile_file

EAST, WEST = 31.7, -11.3
"""Degrees of longitude: land in the half with a tile, sea in the half without."""
RED = (200, 30, 40)
COLOUR_AT = """async ([picture, x, y]) => {
  const image = new Image();
  image.src = `data:image/png;base64,${picture}`;
  await image.decode();
  const canvas = new OffscreenCanvas(image.width, image.height).getContext('2d');
  canvas.drawImage(image, 0, 0);
  return [...canvas.getImageData(x, y, 1, 1).data].slice(0, 3);
}"""


@pytest.fixture
def tiled(tmp_path: Path, prepared_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[World]:
    """A tower with a file of tiles beside its database."""
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    monkeypatch.setenv("TOWER_TILES", str(tmp_path / "tiles.pmtiles"))
    monkeypatch.setenv("TOWER_TILES_ATTRIBUTION", "© The surveyors")
    write_tile_file(tmp_path / "tiles.pmtiles", PNG, one_colour_png(*RED), {})
    with World(tmp_path, prepared=True) as world:
        world.start_tower()
        yield world


def token(console: ConsolePage, name: str) -> tuple[int, ...]:
    text = console.page.evaluate(f"getComputedStyle(document.documentElement).getPropertyValue('--{name}').trim()")
    return tuple(bytes.fromhex(str(text).removeprefix("#")))


def colour(console: ConsolePage, lon_deg: float) -> tuple[int, ...]:
    """Returns the colour at the map's middle height and this longitude."""
    frame = console.part("map")
    box = frame.bounding_box()
    assert box is not None
    zoom, middle = float(frame.get_attribute("data-zoom") or 0), float(frame.get_attribute("data-lon") or 0)
    x = box["width"] / 2 + (lon_deg - middle) * 512 * 2**zoom / 360
    picture = base64.b64encode(frame.screenshot()).decode()
    return tuple(console.page.evaluate(COLOUR_AT, [picture, round(x), round(box["height"] / 2)]))


def expect_colours(console: ConsolePage, east: tuple[int, ...]) -> None:
    expect(console.part("map")).to_have_attribute("data-zoom", "3.0")
    console.wait("the tile", lambda: colour(console, EAST) == east)
    # There is no tile, and no gap either.
    assert colour(console, WEST) == token(console, "map-sea")


def test_tiles_are_drawn_where_the_file_has_some_and_the_coastline_elsewhere(chromium: Browser, tiled: World) -> None:
    with visitors(chromium, tiled.address, has_map=True) as somebody:
        alice = signed_in(somebody, "alice", is_sharp=True)
        expect(alice.part("map-attribution")).to_have_text("© The surveyors")
        # A small move makes the page report its position.
        alice.page.locator(".maplibregl-canvas").press("ArrowRight")
        expect_colours(alice, RED)
        assert [said for said in alice.complaints if "401" not in said] == []

        # A vector map replaces the file: it uses the theme's colours.
        write_tile_file(
            tiled.folder / "tiles.pmtiles",
            MVT,
            all_over_mvt("buildings"),
            {"vector_layers": [{"id": "buildings", "fields": {}}, {"id": "places", "fields": {}}]},
        )
        tiled.tower.terminate()
        tiled.tower.wait()
        tiled.start_tower()
        alice.page.reload()
        expect(alice.part("squad-row").first).to_be_visible()
        alice.page.locator(".maplibregl-canvas").press("ArrowRight")
        expect_colours(alice, token(alice, "map-building"))


def test_a_browser_does_without_maps_until_it_is_told_otherwise(chromium: Browser, tiled: World) -> None:
    asked: list[str] = []
    with visitors(chromium, tiled.address, has_map=True) as somebody:
        alice = signed_in(somebody, "alice")
        canvas = alice.page.locator(".maplibregl-canvas")
        expect(canvas).to_be_visible()
        alice.part("map-layers").click()
        alice.part("map-off").click()  # it goes with the map
        expect(canvas).to_have_count(0)
        alice.page.context.on("request", lambda request: asked.append(request.url))
        alice.page.reload()
        expect(alice.part("map-on")).to_be_visible()
        assert not [url for url in asked if "create_map" in url or "tiles" in url]
        alice.part("map-on").click()
        expect(canvas).to_be_visible()
        expect(alice.part("map-attribution")).to_have_text("© The surveyors")
        assert [url for url in asked if "create_map" in url]


NAMED: Final = "Kingsbury Under Test"
NAMED_AT_DEG: Final = 20.0
LETTERS: Final = """async (picture) => {
  const image = new Image();
  image.src = `data:image/png;base64,${picture}`;
  await image.decode();
  const canvas = new OffscreenCanvas(image.width, image.height).getContext('2d');
  canvas.drawImage(image, 0, 0);
  const { data } = canvas.getImageData(0, 0, image.width, image.height);
  let white = 0;
  for (let at = 0; at < data.length; at += 4) if (Math.min(data[at], data[at + 1], data[at + 2]) > 190) white++;
  return white;
}"""
"""Counts white pixels: letters over red imagery."""


def white_pixels(console: ConsolePage, lon_deg: float) -> int:
    """Around a place at the map's middle height."""
    frame = console.part("map")
    box = frame.bounding_box()
    assert box is not None
    zoom, middle = float(frame.get_attribute("data-zoom") or 0), float(frame.get_attribute("data-lon") or 0)
    x = box["x"] + box["width"] / 2 + (lon_deg - middle) * 512 * 2**zoom / 360
    clip: FloatRect = {"x": x - 70, "y": box["y"] + box["height"] / 2 - 60, "width": 140, "height": 120}
    return int(console.page.evaluate(LETTERS, base64.b64encode(console.page.screenshot(clip=clip)).decode()))


@pytest.fixture
def mapped(tmp_path: Path, prepared_folder: Path) -> Iterator[World]:
    """A tower with imagery and a vector map in its folder of maps."""
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    (tmp_path / "maps").mkdir()
    write_tile_file(tmp_path / "maps" / "above.pmtiles", PNG, one_colour_png(*RED), {"attribution": "© Flyers"})
    # Its place is at the map's middle height.
    vector = {"attribution": "© Walkers", "vector_layers": [{"id": "places"}]}
    write_tile_file(tmp_path / "maps" / "streets.pmtiles", MVT, place_mvt(NAMED, NAMED_AT_DEG / 180, 0.7034), vector)
    with World(tmp_path, prepared=True) as world:
        world.start_tower()
        yield world


def test_imagery_and_names_come_from_the_tower_alone_and_the_choice_is_the_users(
    chromium: Browser, mapped: World
) -> None:
    asked: list[str] = []
    with visitors(chromium, mapped.address, has_map=True) as somebody:
        alice = somebody(is_sharp=True)
        alice.page.context.on("request", lambda request: asked.append(request.url))
        alice.open()
        alice.sign_in("alice")
        expect(alice.part("map-attribution")).to_have_text("© Flyers · © Walkers")
        alice.page.locator(".maplibregl-canvas").press("ArrowRight")
        expect(alice.part("map")).to_have_attribute("data-zoom", "3.0")
        # White letters over red imagery.
        alice.wait("the name", lambda: white_pixels(alice, NAMED_AT_DEG) > 20)
        alice.part("map-layers").click()
        alice.part("map-labels").uncheck()
        alice.wait("no name", lambda: white_pixels(alice, NAMED_AT_DEG) == 0)
        opaque = colour(alice, EAST)[1]
        alice.part("map-opacity").fill("40")
        alice.wait("paler imagery", lambda: abs(colour(alice, EAST)[1] - opaque) > 15)
        with alice.page.expect_response(lambda answer: answer.url.endswith("/me/preferences/map")):
            alice.part("map-view").get_by_text("Map", exact=True).click()
        expect(alice.part("map-attribution")).to_have_text("© Walkers")
        assert [said for said in alice.complaints if "401" not in said] == []

        # Another browser of the same user shows the same.
        again = signed_in(somebody, "alice", is_sharp=True)
        expect(again.part("map-attribution")).to_have_text("© Walkers")
        again.part("map-layers").click()
        expect(again.part("map-labels")).not_to_be_checked()
        expect(again.part("map-opacity")).to_have_value("40")
    assert asked
    assert [
        url for url in asked if not url.startswith((mapped.address + "/", "data:", f"blob:{mapped.address}/"))
    ] == []
