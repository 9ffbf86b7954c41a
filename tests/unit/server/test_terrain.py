"""Heights of the ground, from PMTiles of terrarium tiles."""

from pathlib import Path

import pytest
from worlds.tile_files import one_colour_png, varint, write_tile_file

from server.maps.io.map_files import MapFolder
from server.maps.io.pmtiles_file import BrokenArchive, PmtilesFile, tile_id
from server.maps.io.terrain import Terrain
from server.maps.io.terrarium import BadTile, decode_terrarium
from simulator.geodesy import LocalFrame, Place
from simulator.land_map import elevation
from simulator.land_map.pmtiles import TileType, write_pmtiles
from simulator.land_map.tile_grid import Tile, TileGrid
from simulator.terrain import hills_m

HOME = Place(47.3977, 8.5456, 488.0)
TERRARIUM = {"encoding": "terrarium"}


def terrain_of(folder: Path) -> Terrain:
    files = MapFolder(folder)
    return Terrain(lambda: files.look()[0])


def test_the_simulated_land_is_read_as_it_is(tmp_path: Path) -> None:
    frame = LocalFrame(HOME)
    grid = TileGrid(frame)
    tiles = {tile: elevation.encoded(elevation.heights(grid, tile)) for tile in grid.around_home(14, 2)}
    write_pmtiles(tmp_path / "land.pmtiles", tiles, TileType.PNG, elevation.bounds(grid), elevation.METADATA)
    terrain = terrain_of(tmp_path)
    assert terrain.is_there()
    north, south = tiles_seam_m(grid, tiles)
    offsets = [(0.0, 0.0), (123.4, -250.0), (-310.0, 340.0), (north, 10.0), (north + 1.0, 10.0), (south, -400.0)]
    places = [frame.to_place(one, other, 0.0) for one, other in offsets]
    found = terrain.heights((place.lat_deg, place.lon_deg) for place in places)
    assert found == pytest.approx([488.0 + hills_m(*one) for one in offsets], abs=0.1)
    assert terrain.heights([(0.0, 0.0), (48.0, 8.5), (89.0, 0.0), (float("nan"), 0.0)]) == [None] * 4


def tiles_seam_m(grid: TileGrid, tiles: dict[Tile, bytes]) -> tuple[float, float]:
    """North of home, metres: the seam between the two rows of tiles, and a place near the southern edge."""
    top, bottom = min(tile.y for tile in tiles), max(tile.y for tile in tiles)
    tile = next(one for one in tiles if one.y == top)
    lower = next(one for one in tiles if one.y == bottom)
    return grid.corner_m(tile, 0.0, 1.0)[1], grid.corner_m(lower, 0.0, 0.9)[1]


def test_a_file_that_changes_or_goes_is_noticed(tmp_path: Path) -> None:
    terrain = terrain_of(tmp_path)
    assert terrain.heights([(40.0, 90.0)]) == [None]
    assert not terrain.is_there()
    write_tile_file(tmp_path / "one.pmtiles", 2, one_colour_png(129, 44, 128), TERRARIUM)
    assert terrain.heights([(40.0, 90.0), (40.0, -90.0)]) == [300.5, None]
    write_tile_file(tmp_path / "one.pmtiles", 2, one_colour_png(128, 10, 0) + b"longer", TERRARIUM)
    assert terrain.heights([(40.0, 90.0)]) == [10.0]
    (tmp_path / "one.pmtiles").unlink()
    assert terrain.heights([(40.0, 90.0)]) == [None]


def test_images_that_are_no_heights_are_unknown_ground(tmp_path: Path) -> None:
    write_tile_file(tmp_path / "one.pmtiles", 2, b"\x89PNG\r\n\x1a\nnothing", TERRARIUM)
    assert terrain_of(tmp_path).heights([(40.0, 90.0)]) == [None]
    for raw in (b"", b"GIF89a", one_colour_png(1, 2, 3, side=64), one_colour_png(1, 2, 3)[:60]):
        with pytest.raises(BadTile):
            decode_terrarium(raw)


def test_tiles_are_found_through_leaf_directories_and_runs(tmp_path: Path) -> None:
    file = tmp_path / "leaves.pmtiles"
    first = tile_id(2, 0, 0)

    def directory(*entries: tuple[int, int, int, int]) -> bytes:
        steps, before = [], 0
        for number, *_ in entries:
            steps.append(number - before)
            before = number
        columns = ([len(entries)], steps, *([one[i] for one in entries] for i in (1, 2, 3)))
        return b"".join(varint(number) for column in columns for number in column)

    leaf = directory((first, 4, 3, 1), (first + 6, 1, 2, 4))
    root = directory((first, 0, len(leaf), 1))
    write_tile_file(file, 2, b"", {})
    head = bytearray(file.read_bytes()[:127])
    at = 127
    for place, value in ((8, at), (16, len(root)), (24, at), (32, 0), (40, at + len(root)), (48, len(leaf))):
        head[place : place + 8] = value.to_bytes(8, "little")
    head[56:64] = (at + len(root) + len(leaf)).to_bytes(8, "little")
    head[100:102] = bytes([2, 2])
    file.write_bytes(bytes(head) + root + leaf + b"abcde")
    with PmtilesFile(file) as archive:
        by_number = {tile_id(2, x, y) - first: archive.tile(2, x, y) for x in range(4) for y in range(4)}
        assert [by_number[n] for n in range(8)] == [b"abc"] * 4 + [None, None, b"de", None]
        assert archive.tile(1, 0, 0) is None


def test_a_broken_archive_is_said_to_be_broken(tmp_path: Path) -> None:
    file = tmp_path / "one.pmtiles"
    write_tile_file(file, 2, b"tile", {})
    whole = file.read_bytes()
    file.write_bytes(whole[:-3])
    with PmtilesFile(file) as archive, pytest.raises(BrokenArchive, match="beyond its end"):
        archive.tile(1, 1, 0)
    file.write_bytes(b"PMTiles\x02" + whole[8:])
    with pytest.raises(BrokenArchive):
        PmtilesFile(file)
