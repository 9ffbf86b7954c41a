"""The map files of the simulated land: their formats, byte by byte, and that they agree with what the cameras see."""

import gzip
import json
import math
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from simulator.camera.ground_map import ground_map, to_px
from simulator.camera.land import make_land
from simulator.geodesy import LocalFrame, Place
from simulator.land_map import imagery, names
from simulator.land_map.features import features
from simulator.land_map.pmtiles import TileType, tile_id, write_pmtiles
from simulator.land_map.tile_grid import Bounds, Tile, TileGrid
from simulator.land_map.vector_map import vector_tiles
from simulator.land_map.vector_tile import EXTENT, Shape, TileFeature, encode_tile

HOME = Place(47.3977, 8.5456, 488.0)
GRID = TileGrid(LocalFrame(HOME))
BOUNDS = Bounds(8.0, 47.0, 9.0, 48.0)


@pytest.mark.parametrize(
    ("zoom", "x", "y", "number"),
    [
        *[(0, 0, 0, 0), (1, 0, 0, 1), (1, 0, 1, 2), (1, 1, 1, 3), (1, 1, 0, 4), (2, 0, 0, 5)],
        # From the reference implementation in JavaScript.
        *[(3, 5, 2, 76), (12, 3423, 1763, 19078479), (18, 137295, 91839, 81288481535)],
    ],
)
def test_tiles_are_numbered_along_the_curve(zoom: int, x: int, y: int, number: int) -> None:
    assert tile_id(Tile(zoom, x, y)) == number


def test_each_tile_of_a_zoom_has_a_number_of_its_own() -> None:
    numbers = {tile_id(Tile(4, x, y)) for x in range(16) for y in range(16)}
    assert numbers == set(range(tile_id(Tile(4, 0, 0)), tile_id(Tile(4, 0, 0)) + 256))


def test_an_archive_has_its_parts_where_its_header_says(tmp_path: Path) -> None:
    file = tmp_path / "land.pmtiles"
    tiles = {Tile(1, 1, 0): b"north-east", Tile(0, 0, 0): b"all"}
    write_pmtiles(file, tiles, TileType.JPEG, BOUNDS, {"name": "Land"})
    raw = file.read_bytes()
    assert raw[:8] == b"PMTiles\x03"
    root_at, root_bytes, said_at, said_bytes, _, _, data_at, data_bytes, *counts = struct.unpack_from("<11Q", raw, 8)
    assert counts == [2, 2, 2]
    clustered, inside, outside, kind, least, most = raw[96:102]
    assert (clustered, inside, outside, kind, least, most) == (1, 2, 1, 3, 0, 1)
    assert struct.unpack_from("<4i", raw, 102) == (80_000_000, 470_000_000, 90_000_000, 480_000_000)
    assert json.loads(gzip.decompress(raw[said_at : said_at + said_bytes])) == {"name": "Land"}
    # Two entries: steps of the ids, run lengths, lengths, offsets (one more; 0: directly after).
    assert gzip.decompress(raw[root_at : root_at + root_bytes]) == bytes([2, 0, 4, 1, 1, 3, 10, 1, 0])
    assert raw[data_at : data_at + data_bytes] == b"allnorth-east"
    assert [path.name for path in tmp_path.iterdir()] == ["land.pmtiles"]


def test_too_many_tiles_for_one_directory_are_refused(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    tiles = {Tile(16, int(x), int(y)): b"x" * int(x % 97) for x, y in random.integers(0, 65_536, (9_000, 2))}
    with pytest.raises(ValueError, match="too many"):
        write_pmtiles(tmp_path / "land.pmtiles", tiles, TileType.JPEG, BOUNDS, {})


def test_a_vector_tile_is_encoded_as_specified() -> None:
    point = TileFeature(Shape.POINT, np.array([(25, 17)]), {"name": "A"})
    # The example of the specification, 4.3.5: a point at 25, 17 is 9 50 34.
    assert encode_tile([("p", [point]), ("empty", [])]) == bytes.fromhex(
        "1a207802 0a0170 120b 1202 0000 1801 2203 093222 1a04 6e616d65 2203 0a0141 28 8040".replace(" ", "")
    )


def test_rings_are_clockwise_on_the_screen_and_nothing_is_written_of_what_has_no_area() -> None:
    square = np.array([(0, 0), (0, 9), (9, 9), (9, 0)])
    there = encode_tile([("a", [TileFeature(Shape.AREA, square, {})])])
    back = encode_tile([("a", [TileFeature(Shape.AREA, square[::-1], {})])])
    # Whichever way round it is given: a first step to the right or down along the outer ring.
    assert len(there) == len(back)
    flat = encode_tile([("a", [TileFeature(Shape.AREA, np.array([(0, 0), (5, 0), (9, 0)]), {})])])
    assert b"\x22" not in flat


def test_the_imagery_shows_what_the_cameras_see() -> None:
    """The colour of the ground under a place is the same on its tile and on the cameras' ground."""
    ground = ground_map(1)
    levels = imagery._levels(1)
    checked = 0
    for tile in GRID.around_home(18, 4):
        raw = imagery._encoded(levels, GRID, tile)
        picture = cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_COLOR)
        assert picture.shape == (imagery.TILE_PX, imagery.TILE_PX, 3)
        for across, along in ((0.25, 0.25), (0.5, 0.75), (0.8, 0.4)):
            east_m, north_m = GRID.corner_m(tile, across, along)
            if any(math.hypot(tree.east_m - east_m, tree.north_m - north_m) < 12 for tree in ground.land.trees):
                continue  # trees stand on the map, and above the cameras' ground
            x, y = (round(n) for n in to_px(east_m, north_m))
            seen = ground.levels[0][y - 8 : y + 8, x - 8 : x + 8].reshape(-1, 3).mean(axis=0)
            px, py = round(across * imagery.TILE_PX), round(along * imagery.TILE_PX)
            shown = picture[py - 10 : py + 10, px - 10 : px + 10].reshape(-1, 3).mean(axis=0)
            assert np.abs(seen - shown).max() < 9.0, (tile, across, along)
            checked += 1
    assert checked > 20


def test_a_pad_of_home_is_where_the_map_has_home() -> None:
    x, y = GRID.to_world(np.array(0.0), np.array(0.0))
    assert float(x) * 360 - 180 == pytest.approx(HOME.lon_deg)
    tile = Tile(18, int(float(x) * 2**18), int(float(y) * 2**18))
    east_m, north_m = GRID.corner_m(tile, float(x) * 2**18 % 1, float(y) * 2**18 % 1)
    assert (east_m, north_m) == (pytest.approx(0.0, abs=1e-6), pytest.approx(0.0, abs=1e-6))
    # ArduPilot's flat earth and Mercator agree to centimetres within a kilometre.
    lat, lon = LocalFrame(HOME).to_local(HOME.lat_deg + 0.005, HOME.lon_deg + 0.005)
    back = LocalFrame(HOME).to_place(lat, lon, 0.0)
    assert back.lat_deg == pytest.approx(HOME.lat_deg + 0.005)


def test_the_vector_map_has_every_house_of_the_land_and_names_that_differ() -> None:
    land = make_land(1)
    made = list(features(land, 1))
    near = [one for one in made if one.layer == "buildings" and np.abs(one.points_m).max() < 512]
    assert len(near) == sum(max(abs(house.east_m), abs(house.north_m)) < 500 for house in land.houses) > 20
    villages = [str(one.facts["name"]) for one in made if one.layer == "places"]
    assert len(villages) == 49
    assert len(set(villages)) > 42
    assert names.village(1, 0, 0) == names.village(1, 0, 0)
    assert names.village(2, 0, 0) != names.village(1, 0, 0)
    fields = [one for one in made if one.layer == "landuse" and one.facts["kind"] != "garden"]
    # No feature is large beside a tile: nothing is cut.
    assert max(np.ptp(one.points_m, axis=0).max() for one in fields) < 250.0


def test_the_tile_of_home_names_its_village_once() -> None:
    tiles = vector_tiles(1, GRID)
    village = names.village(1, 0, 0).encode()
    for zoom in (11, 12, 13, 14):
        holding = [tile for tile, raw in tiles.items() if tile.zoom == zoom and village in raw]
        assert len(holding) == 1, zoom
    assert EXTENT == 8192
    assert sum(len(raw) for raw in tiles.values()) < 8_000_000
