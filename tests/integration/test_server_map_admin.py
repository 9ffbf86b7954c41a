"""Maps that an admin chooses, from files and from other servers, through the tower's cache."""

import asyncio
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

import httpx
import numpy as np
import pytest
from control_world import until
from sqlalchemy import select
from tower_world import TowerWorld, assert_problem, start_tower
from worlds.geotiff_files import Geotiff, projected
from worlds.tile_files import PNG, one_colour_png, write_tile_file
from worlds.tile_server import TileServer, tile_server

from server.audit.store.tables import AuditEventRow
from server.kernel.people import Role
from server.maps.io.elevation import converting

AREA: Final = {"name": "Field", "south": 47.39, "west": 8.53, "north": 47.41, "east": 8.56, "max_zoom": 12}


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, map_file_largest_mb=1) as running:
        yield running


@pytest.fixture
async def ada(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("ada", Role.ADMIN))


def layer(server: TileServer, **changes: Any) -> dict[str, Any]:
    return {
        "name": "Field map",
        "role": "imagery",
        "template": server.template,
        "max_zoom": 14,
        "attribution": "© The surveyors",
        "may_be_private": True,
        "may_be_kept": True,
        **changes,
    }


async def added(client: httpx.AsyncClient, body: dict[str, Any]) -> int:
    answer = await client.post("/api/v1/map/layers", json=body)
    assert answer.status_code == 201, answer.text
    return int(answer.json()["id"])


async def audited(world: TowerWorld) -> list[tuple[str, dict[str, Any]]]:
    async with world.database.reading() as session:
        rows = await session.scalars(
            select(AuditEventRow).where(AuditEventRow.action.like("map.%")).order_by(AuditEventRow.id)
        )
        return [(row.action, row.detail) for row in rows]


async def whole_area(client: httpx.AsyncClient) -> dict[str, Any]:
    """Returns the only area once all of it is here."""
    while True:
        (area,) = (await client.get("/api/v1/map/admin")).json()["areas"]
        if area["done"] == area["tiles"]:
            return dict(area)


async def test_a_layer_of_another_server_is_added_drawn_cached_and_removed(
    world: TowerWorld, ada: httpx.AsyncClient
) -> None:
    olga = await world.signed_in(await world.add_user("olga"))
    with tile_server() as server:
        assert_problem(await olga.post("/api/v1/map/layers", json=layer(server)), 403, "admins-only")
        number = await added(ada, layer(server))
        (said,) = (await olga.get("/api/v1/map")).json()["layers"]
        assert said["url"] == f"/api/v1/map/layers/{number}/{{z}}/{{x}}/{{y}}"
        assert "s3cret" not in (await olga.get("/api/v1/map")).text
        path = f"/api/v1/map/layers/{number}"
        asking = (olga.get(f"{path}/3/4/5", headers={"Referer": "x", "Via": "y"}) for _ in range(5))
        answers = await asyncio.gather(*asking)
        assert {answer.content for answer in answers} == {server.tile}
        # The server claims that it is a page; its bytes say what it is.
        assert answers[0].headers["content-type"] == "image/png"
        assert server.asked == {"/t/3/4/5.png?key=s3cret": 1}
        assert set(server.headers) <= {"Host", "User-Agent", "Accept", "Accept-Encoding"}
        assert (await olga.get(f"{path}/15/0/0")).status_code == 204
        assert (await olga.get(f"{path}/3/8/0")).status_code == 204
        assert (await olga.get(f"{path}/3/-1/0")).status_code == 422
        stranger = await world.client()
        assert (await stranger.get(f"{path}/3/4/5")).status_code == 401
    # The network is cut.
    assert (await olga.get(f"{path}/3/4/5")).content == server.tile
    assert_problem(await olga.get(f"{path}/3/4/6"), 503, "map-tile-unavailable")
    assert (await ada.delete(path)).status_code == 204
    assert_problem(await olga.get(f"{path}/3/4/5"), 404, "unknown-map-layer")
    assert not list((world.settings.var / "tiles").rglob("4-5"))
    assert await audited(world) == [
        ("map.layer_added", {"layer_id": number, "layer": "Field map", "role": "imagery"}),
        ("map.layer_removed", {"layer_id": number, "layer": "Field map"}),
    ]


@pytest.mark.parametrize(
    ("status", "tile"),
    [(302, b""), (500, b""), (200, b"<html><script>alert(1)</script>"), (200, b"\x89PNG\r\n\x1a\n" * 400_000)],
)
async def test_what_is_no_tile_does_not_reach_a_browser(ada: httpx.AsyncClient, status: int, tile: bytes) -> None:
    with tile_server() as server:
        server.status, server.tile = status, tile
        number = await added(ada, layer(server))
        assert_problem(await ada.get(f"/api/v1/map/layers/{number}/1/0/0"), 503, "map-tile-unavailable")


async def test_a_server_in_a_private_network_is_not_contacted_unless_an_admin_says_so(ada: httpx.AsyncClient) -> None:
    with tile_server() as server:
        number = await added(ada, layer(server, may_be_private=False))
        answer = await ada.get(f"/api/v1/map/layers/{number}/1/0/0")
        assert "private network" in answer.json()["detail"]
        assert not server.asked


async def test_only_a_few_tiles_are_fetched_at_a_time(ada: httpx.AsyncClient) -> None:
    with tile_server() as server:
        number = await added(ada, layer(server))
        server.slow.clear()
        asking = [asyncio.create_task(ada.get(f"/api/v1/map/layers/{number}/6/{x}/0")) for x in range(15)]
        await until("six requests", lambda: server.at_a_time == 6)
        assert (await ada.get("/api/v1/health")).status_code == 200
        server.slow.set()
        assert {answer.status_code for answer in await asyncio.gather(*asking)} == {200}
        assert server.most_at_a_time == 6


async def test_an_area_is_kept_and_served_with_the_network_cut(world: TowerWorld, ada: httpx.AsyncClient) -> None:
    with tile_server() as server:
        number = await added(ada, layer(server))
        body = {**AREA, "layer_id": number}
        estimate = (await ada.post("/api/v1/map/areas/estimate", json=body)).json()
        assert estimate["tiles"] > 12
        assert estimate["bytes"] == estimate["tiles"] * 25_000
        too_many = await ada.post(
            "/api/v1/map/areas/estimate", json={**body, "south": -40, "west": -60, "max_zoom": 14}
        )
        assert "at most 50,000" in too_many.json()["detail"]
        assert (await ada.post("/api/v1/map/areas", json=body)).status_code == 202
        await until("the area", lambda: len(server.asked) == estimate["tiles"])
        area = await whole_area(ada)
        assert (area["tiles"], area["problem"]) == (estimate["tiles"], "")
        assert area["bytes"] == area["tiles"] * len(server.tile)
    for file in (world.settings.var / "tiles").rglob("*-*"):
        file.unlink()  # the cache is gone; the area is not
    assert (await ada.get(f"/api/v1/map/layers/{number}/12/2145/1434")).content == server.tile
    assert (await ada.delete(f"/api/v1/map/areas/{area['id']}")).status_code == 204
    assert not [file for file in (world.settings.var / "offline-maps").rglob("*-*") if file.is_file()]
    assert [action for action, _ in await audited(world)] == ["map.layer_added", "map.area_kept", "map.area_let_go"]


async def test_an_area_of_a_layer_whose_terms_forbid_it_is_not_kept(ada: httpx.AsyncClient) -> None:
    with tile_server() as server:
        number = await added(ada, layer(server, may_be_kept=False))
        answer = await ada.post("/api/v1/map/areas", json={**AREA, "layer_id": number})
        assert "terms" in answer.json()["detail"]


async def test_addresses_that_name_no_tiles_are_refused_in_words(ada: httpx.AsyncClient) -> None:
    with tile_server() as server:
        for template, words in (
            ("/etc/passwd", "https://"),
            ("file:///{z}/{x}/{y}", "https://"),
            ("https://example.org/{z}/{x}", "{y}"),
            ("https://{s}.example.org/{z}/{x}/{y}", "one host"),
        ):
            answer = await ada.post("/api/v1/map/layers", json=layer(server, template=template))
            assert_problem(answer, 422, "invalid-request")
            assert words in answer.json()["detail"]
        wmts = "https://example.org/{TileMatrix}/{TileRow}/{TileCol}"
        await added(ada, layer(server, template=wmts))
        (known,) = (await ada.get("/api/v1/map/admin")).json()["layers"]
        assert known["template"] == "https://example.org/{z}/{y}/{x}"


async def test_a_file_is_uploaded_checked_and_removed(
    world: TowerWorld, ada: httpx.AsyncClient, tmp_path: Path
) -> None:
    whole = tmp_path / "whole.pmtiles"
    write_tile_file(whole, PNG, one_colour_png(129, 44, 128), {"encoding": "terrarium"})
    content = whole.read_bytes()
    path = "/api/v1/map/files/hills"
    for bad, words in (
        (b"GIF89a" + content, "not PMTiles"),
        (content[:100], "not PMTiles"),
        (content[:127] + b"\xff" * 40, "broken"),
        (b"x" * 1_000_001, "larger than 1 MB"),
    ):
        answer = await ada.put(path, content=bad)
        assert_problem(answer, 422, "invalid-request")
        assert words in answer.json()["detail"]
    assert list(world.settings.maps.glob("*")) == []
    assert (await ada.put(path, content=content)).status_code == 204
    (said,) = (await ada.get("/api/v1/map")).json()["layers"]
    assert said["role"] == "terrain"
    heights = await ada.post("/api/v1/map/heights", json={"places": [[40, 90], [40, -90]]})
    assert heights.json() == {"heights_m": [300.5, None]}
    assert (await ada.delete(path)).status_code == 204
    assert_problem(await ada.delete(path), 422, "invalid-request")
    assert [action for action, _ in await audited(world)] == ["map.file_added", "map.file_removed"]


async def conversion(client: httpx.AsyncClient, **awaited: Any) -> dict[str, Any]:
    """Returns the GeoTIFF uploaded last when its values are those that are awaited."""
    async with asyncio.timeout(60):
        while True:
            found = dict((await client.get("/api/v1/map/admin")).json()["elevation"])
            if found == found | awaited:
                return found
            await asyncio.sleep(0.05)


async def test_a_geotiff_is_uploaded_and_is_elevation_of_the_map(
    world: TowerWorld, ada: httpx.AsyncClient, tmp_path: Path
) -> None:
    content = Geotiff(np.full((40, 50), 321.5, "f4")).write(tmp_path / "hills.tif").read_bytes()
    path = "/api/v1/map/elevation/hills"
    olga = await world.signed_in(await world.add_user("olga"))
    assert_problem(await olga.put(path, content=content), 403, "admins-only")
    for bad, words in ((b"GIF89a" + content, "no TIFF file"), (b"II*\0" + b"x" * 1_000_000, "larger than 1 MB")):
        answer = await ada.put(path, content=bad)
        assert_problem(answer, 422, "invalid-request")
        assert words in answer.json()["detail"]
    assert (await ada.get("/api/v1/map/admin")).json()["elevation"] is None
    assert (await ada.put(path, content=content, params={"title": "My hills", "attribution": "A survey"})).is_success
    assert await conversion(ada, is_running=False) == {
        "name": "hills",
        "is_running": False,
        "share": 1.0,
        "problem": "",
    }
    (said,) = (await ada.get("/api/v1/map")).json()["layers"]
    assert (said["name"], said["role"], said["attribution"]) == ("My hills", "terrain", "A survey")
    heights = await ada.post("/api/v1/map/heights", json={"places": [[46.995, 8.005], [46, 8]]})
    assert heights.json() == {"heights_m": [321.5, None]}
    ((action, detail),) = await audited(world)
    assert (action, detail["file"]) == ("map.file_added", "hills")

    # One that cannot be used is told of in words, and the map keeps what it has.
    swiss = Geotiff(np.zeros((9, 9), "f4"), keys=projected(2056)).write(tmp_path / "swiss.tif").read_bytes()
    assert (await ada.put(path, content=swiss)).status_code == 202
    assert (await conversion(ada, is_running=False))["problem"].startswith(
        "has the projection EPSG:2056: only EPSG:4326"
    )
    assert (await ada.delete("/api/v1/map/elevation")).status_code == 204
    assert (await ada.get("/api/v1/map/admin")).json()["elevation"] is None
    assert_problem(await ada.delete("/api/v1/map/elevation"), 422, "invalid-request")
    assert [file.name for file in world.settings.maps.iterdir()] == ["hills.pmtiles"]


async def test_one_geotiff_at_a_time_and_it_can_be_stopped(
    world: TowerWorld, ada: httpx.AsyncClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program that never ends stands in for a long conversion."""
    slow = "import time; print('{\"done\": 0.25}', flush=True); time.sleep(600)"
    monkeypatch.setattr(converting, "_command", lambda _arguments: [sys.executable, "-c", slow])
    content = Geotiff(np.full((9, 9), 1.0, "f4")).write(tmp_path / "hills.tif").read_bytes()
    assert (await ada.put("/api/v1/map/elevation/hills", content=content)).status_code == 202
    await conversion(ada, share=0.25)
    answer = await ada.put("/api/v1/map/elevation/other", content=content)
    assert "another GeoTIFF is being received or converted" in answer.json()["detail"]
    assert (await ada.delete("/api/v1/map/elevation")).status_code == 204
    assert (await conversion(ada, is_running=False))["problem"] == "was stopped"
    assert list(world.settings.maps.iterdir()) == []
    assert await audited(world) == []
