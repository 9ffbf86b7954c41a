"""Map tiles from the tower: the list, and a file of them by ranges."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

import httpx
import pytest
from tower_world import TowerWorld, assert_problem, start_tower
from worlds.tile_files import MVT, PNG, write_tile_file
from worlds.tile_server import tile_server

from server.maps.io.tile_source import TileAddresses, TileFile

CONTENT: Final = bytes(range(256)) * 40
FILE: Final = "/api/v1/map/tiles.pmtiles"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    file = tmp_path / "region.pmtiles"
    file.write_bytes(CONTENT)
    source = TileFile(file, "raster")
    async with start_tower(tmp_path, tiles=source, tiles_attribution="© The surveyors") as running:
        yield running


@pytest.fixture
async def olga(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("olga"))


async def layers(client: httpx.AsyncClient) -> list[dict[str, Any]]:
    answer = await client.get("/api/v1/map")
    assert answer.status_code == 200
    return list(answer.json()["layers"])


async def test_the_file_is_for_whoever_is_signed_in(world: TowerWorld, olga: httpx.AsyncClient) -> None:
    stranger = await world.client()
    assert_problem(await stranger.get("/api/v1/map"), 401, "not-signed-in")
    assert_problem(await stranger.get(FILE, headers={"Range": "bytes=0-9"}), 401, "not-signed-in")
    assert (await stranger.head(FILE)).status_code == 401
    (said,) = await layers(olga)
    url = said.pop("url")
    assert said == {
        "id": "tiles",
        "name": "Map of this tower",
        "role": "map",
        "kind": "raster",
        "source": "file",
        "tile_size": 256,
        "max_zoom": None,
        "attribution": "© The surveyors",
    }
    whole = await olga.get(url)
    assert whole.status_code == 200
    assert whole.content == CONTENT
    assert whole.headers["accept-ranges"] == "bytes"
    assert whole.headers["content-type"] == "application/vnd.pmtiles"
    assert whole.headers["cache-control"] == "private, max-age=604800, no-transform"
    assert "content-encoding" not in whole.headers


@pytest.mark.parametrize(
    ("asked", "first", "last"),
    [("bytes=0-126", 0, 126), ("bytes=100-100", 100, 100), ("bytes=10200-", 10200, 10239), ("bytes=-7", 10233, 10239)],
)
async def test_a_range_is_answered_with_just_that(olga: httpx.AsyncClient, asked: str, first: int, last: int) -> None:
    answer = await olga.get(FILE, headers={"Range": asked, "Accept-Encoding": "br, gzip"})
    assert answer.status_code == 206
    assert answer.content == CONTENT[first : last + 1]
    assert answer.headers["content-range"] == f"bytes {first}-{last}/{len(CONTENT)}"
    assert answer.headers["content-length"] == str(last - first + 1)
    assert "content-encoding" not in answer.headers
    head = await olga.head(FILE, headers={"Range": asked})
    assert (head.status_code, head.content) == (206, b"")
    assert head.headers["content-range"] == answer.headers["content-range"]


async def test_what_is_not_in_the_file_is_said_so(olga: httpx.AsyncClient) -> None:
    beyond = await olga.get(FILE, headers={"Range": f"bytes={len(CONTENT)}-"})
    assert beyond.status_code == 416
    assert beyond.headers["content-range"] == f"bytes */{len(CONTENT)}"
    assert beyond.headers["cache-control"] == "no-store"
    assert (await olga.get(FILE, headers={"Range": "lines=1-2"})).status_code == 400


async def test_a_file_that_was_replaced_meanwhile_is_noticed(world: TowerWorld, olga: httpx.AsyncClient) -> None:
    url = (await layers(olga))[0]["url"]
    known = (await olga.head(FILE)).headers
    assert not known["etag"].startswith("W/")
    fresh = {"Range": "bytes=0-9", "If-Range": known["etag"]}
    assert (await olga.get(FILE, headers=fresh)).status_code == 206
    assert isinstance(world.settings.tiles, TileFile)
    world.settings.tiles.path.write_bytes(CONTENT + b"more")
    stale = await olga.get(FILE, headers=fresh)
    assert stale.status_code == 200
    assert stale.content == CONTENT + b"more"
    assert stale.headers["etag"] != known["etag"]
    assert (await layers(olga))[0]["url"] != url
    world.settings.tiles.path.unlink()
    assert_problem(await olga.get(FILE), 404, "no-tiles")


async def test_without_a_setting_there_is_only_the_coastline(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        olga = await world.signed_in(await world.add_user("olga"))
        assert await layers(olga) == []
        assert_problem(await olga.get(FILE), 404, "no-tiles")
        assert "https:" not in (await olga.get("/")).headers["content-security-policy"]


async def test_tiles_of_another_address_go_through_the_tower(tmp_path: Path) -> None:
    with tile_server() as server:
        source = TileAddresses(server.template)
        async with start_tower(tmp_path, tiles=source, tiles_most_zoom=17) as world:
            olga = await world.signed_in(await world.add_user("olga"))
            (said,) = await layers(olga)
            url = "/api/v1/map/layers/0/{z}/{x}/{y}"
            assert (said["source"], said["url"], said["max_zoom"]) == ("addresses", url, 17)
            assert "://" not in (await olga.get("/")).headers["content-security-policy"]
            tile = await olga.get("/api/v1/map/layers/0/3/4/5")
            assert (tile.status_code, tile.content) == (200, server.tile)
            assert_problem(await olga.get(FILE), 404, "no-tiles")


async def test_a_file_put_into_the_folder_of_maps_is_a_layer_at_once(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        olga = await world.signed_in(await world.add_user("olga"))
        folder = world.settings.maps
        assert await layers(olga) == []
        folder.mkdir()
        write_tile_file(folder / "valley.pmtiles", MVT, b"", {"name": "The valley", "attribution": "<b>© Us</b>"})
        write_tile_file(folder / "air.pmtiles", PNG, b"", {"tile_size": 512})
        write_tile_file(folder / "hills.pmtiles", PNG, b"", {"encoding": "terrarium"})
        (folder / "broken.pmtiles").write_bytes(b"PMTiles")
        (folder / "Bad name.pmtiles").write_bytes(b"")
        (folder / "notes.txt").write_text("no map")
        found = {layer["id"]: layer for layer in await layers(olga)}
        assert {name: layer["role"] for name, layer in found.items()} == {
            "file-air": "imagery",
            "file-hills": "terrain",
            "file-valley": "map",
        }
        valley = found["file-valley"]
        assert (valley["name"], valley["attribution"], valley["kind"]) == ("The valley", "© Us", "vector")
        assert found["file-air"]["tile_size"] == 512
        answer = await olga.get(valley["url"], headers={"Range": "bytes=0-6"})
        assert (answer.status_code, answer.content) == (206, b"PMTiles")
        write_tile_file(folder / "valley.pmtiles", MVT, b"longer", {"name": "The other valley"})
        changed = next(layer for layer in await layers(olga) if layer["id"] == "file-valley")
        assert changed["name"] == "The other valley"
        assert changed["url"] != valley["url"]


@pytest.mark.parametrize("name", ["none", "broken", "..%2Fsecret", "%2Fetc%2Fpasswd", "air.pmtiles", ".air"])
async def test_only_a_usable_file_of_the_folder_is_sent(tmp_path: Path, name: str) -> None:
    async with start_tower(tmp_path) as world:
        olga = await world.signed_in(await world.add_user("olga"))
        world.settings.maps.mkdir()
        write_tile_file(world.settings.maps / "air.pmtiles", PNG, b"", {})
        (world.settings.maps / "broken.pmtiles").write_bytes(b"PMTiles")
        (world.settings.maps.parent / "secret.pmtiles").write_bytes((world.settings.maps / "air.pmtiles").read_bytes())
        assert (await olga.get(f"/api/v1/map/files/{name}")).status_code == 404
        stranger = await world.client()
        assert_problem(await stranger.get("/api/v1/map/files/air"), 401, "not-signed-in")
