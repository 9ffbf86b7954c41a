"""A request body that arrives slowly: a right to fly revoked meanwhile no longer counts, and the upload has a
deadline."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from flying_scene import Scene
from tower_world import assert_problem, start_tower

import server.http.body

JSON = {"Content-Type": "application/json"}


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        yield scene


@pytest.mark.parametrize(
    ("method", "path", "whole"),
    [("PUT", "mission", b'{"items": []}'), ("PATCH", "parameters", b'{"values": {"RTL_ALT": 1}}')],
    ids=["plan", "parameters"],
)
async def test_a_token_that_is_revoked_before_the_body_is_whole_writes_nothing(
    scene: Scene, method: str, path: str, whole: bytes
) -> None:
    made = (await scene.holder.post("/api/v1/tokens", json={"name": "slow", "scopes": ["fly"]})).json()
    program = await scene.world.client(headers={"Authorization": f"Bearer {made['secret']}"})
    begun, revoked = asyncio.Event(), asyncio.Event()

    async def slowly() -> AsyncIterator[bytes]:
        yield whole[:5]
        begun.set()
        await revoked.wait()
        yield whole[5:]

    writing = asyncio.create_task(
        program.request(method, f"{scene.path}/{path}", content=slowly(), headers=JSON, timeout=30)
    )
    await begun.wait()
    # Once another request of the same token is answered, the first has been authorised.
    assert (await program.get("/api/v1/me")).status_code == 200
    gone = await scene.holder.delete(f"/api/v1/tokens/{made['token']['id']}")
    assert gone.status_code in (200, 204), gone.text
    revoked.set()
    assert_problem(await writing, 401, "bad-token")
    assert scene.agent.asked == []


async def test_a_body_that_does_not_come_to_its_end_is_given_up(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server.http.body, "WITHIN_S", 0.2)
    url = scene.holder.base_url
    cookie = scene.world.cookie_header(scene.holder)["Cookie"]
    reader, writer = await asyncio.open_connection(url.host, url.port)
    head = [
        f"PUT {scene.path}/mission HTTP/1.1",
        *(f"Host: {url.netloc.decode()}", f"Cookie: {cookie}", f"Origin: {url.scheme}://{url.netloc.decode()}"),
        *("Content-Type: application/json", "Content-Length: 1000"),
    ]
    writer.write("\r\n".join([*head, "", '{"items": [']).encode())
    said = await asyncio.wait_for(reader.read(), 15.0)  # until the connection ends
    assert said.startswith(b"HTTP/1.1 408 "), said
    assert b"request-timeout" in said
    writer.close()
    assert scene.agent.asked == []
