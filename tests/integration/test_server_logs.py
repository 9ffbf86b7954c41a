"""Flight logs over REST: the list, and a file from the agent to the user who requested it."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ObedientAgent, audit, until
from flying_scene import Scene
from tower_world import assert_problem, start_tower

from wire.transactions import LogDownloadWork

LOG = bytes(range(256)) * 4000


class LogScene(Scene):
    """The agent delays its responses."""

    async def fetch(self, log_id: int = 7) -> int:
        """Returns the transaction that the agent received."""
        self.agent.waits = True
        path = f"{self.path}/logs/{log_id}/fetch"
        begun = await self.holder.post(path, headers={"Prefer": "respond-async"})
        assert begun.status_code == 202, begun.text
        assert self.agent.asked[-1].work == LogDownloadWork(log_id)
        return self.agent.asked[-1].id

    async def send(
        self, transaction_id: int, content: bytes | AsyncIterator[bytes] = LOG, ticket: str = "", **headers: str
    ) -> httpx.Response:
        agent = await self.world.client()
        headers = {"Authorization": f"Bearer {ticket or self.agent.link.ticket}"} | headers
        return await agent.put(f"/api/v1/agent/files/{transaction_id}", content=content, headers=headers)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[LogScene]:
    async with start_tower(tmp_path, file_largest_mb=2) as world:
        scene = LogScene(world)
        await scene.begin()
        yield scene


async def test_the_list_is_kept_and_a_log_that_was_fetched_can_be_downloaded(scene: LogScene, tmp_path: Path) -> None:
    assert (await scene.watcher.get(f"{scene.path}/logs")).json() == {"read_at": None, "on_board": None, "kept": []}
    listed = (await scene.watcher.post(f"{scene.path}/logs/list")).json()
    assert [(one["id"], one["size_bytes"], one["began_at"]) for one in listed["logs"]] == [
        (7, 5, "2023-11-14T22:13:20Z"),
        (6, 3, None),
    ]
    assert_problem(await scene.watcher.get(f"{scene.path}/logs/7/file"), 404, "unknown-log")
    transaction = await scene.fetch()
    sent = await scene.send(transaction)
    assert sent.status_code == 204, sent.text
    scene.agent.go_on()
    logs = (await scene.watcher.get(f"{scene.path}/logs")).json()
    assert logs["on_board"] == listed["logs"]
    assert [(one["id"], one["size_bytes"], one["began_at"]) for one in logs["kept"]] == [
        (7, len(LOG), "2023-11-14T22:13:20Z")
    ]
    file = await scene.watcher.get(f"{scene.path}/logs/7/file")
    assert file.content == LOG
    assert file.headers["Content-Disposition"] == 'attachment; filename="kestrel-log-7.bin"'
    stored = next(tmp_path.rglob("7-*.bin"))  # noqa: ASYNC240 (one small file)
    stored.write_bytes(b"ULog" + LOG[4:])
    file = await scene.watcher.get(f"{scene.path}/logs/7/file")
    assert file.headers["Content-Disposition"] == 'attachment; filename="kestrel-log-7.ulg"'
    events = [one["action"] for one in await _noted(scene)]
    assert events == ["operation.ended", "operation.began"]


async def _noted(scene: LogScene) -> list[dict[str, Any]]:
    for _ in range(500):
        if len(found := await audit(scene.admin, "operation.")) == 2:
            return found
        await asyncio.sleep(0.01)
    return []


async def test_only_whoever_has_the_controls_has_one_fetched(scene: LogScene) -> None:
    assert_problem(await scene.watcher.post(f"{scene.path}/logs/7/fetch"), 409, "not-in-control")
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    for path in ("logs", "logs/7/file"):
        assert_problem(await stranger.get(f"{scene.path}/{path}"), 404, "unknown-drone")


async def test_a_file_that_nobody_waits_for_is_not_taken(scene: LogScene) -> None:
    crow = await scene.world.add_drone("crow", scene.alice)
    other = ObedientAgent(scene.world.tower.hub, crow.id)
    transaction = await scene.fetch()
    assert_problem(await scene.send(transaction + 1), 404, "not-asked-for")
    assert_problem(await scene.send(transaction, ticket=other.link.ticket), 404, "not-asked-for")
    assert_problem(await scene.send(transaction, ticket="twd_1_" + "x" * 43), 401, "bad-credential")
    assert_problem(await scene.holder.put(f"/api/v1/agent/files/{transaction}", content=b"x"), 401, "bad-credential")
    scene.agent.go_on()
    operation = scene.world.tower.hub.operations.find(transaction)
    await until("the end", lambda: not operation.running)
    assert_problem(await scene.send(transaction), 404, "not-asked-for")
    scene.agent.waits = True
    upload = asyncio.create_task(scene.holder.put(f"{scene.path}/mission", json={"items": []}))
    await until("the upload", lambda: scene.agent.asked[-1].id != transaction)
    assert_problem(await scene.send(scene.agent.asked[-1].id), 404, "not-asked-for")
    scene.agent.go_on()
    await upload
    assert list(scene.world.settings.files.rglob("*.*")) == []


async def test_a_file_is_taken_whole_or_not_at_all(scene: LogScene) -> None:
    transaction = await scene.fetch()

    async def without_length() -> AsyncIterator[bytes]:
        yield LOG

    assert_problem(await scene.send(transaction, without_length()), 400, "incomplete")
    assert_problem(await scene.send(transaction, b"x" * 2_000_001), 413, "no-room")
    reader, writer = await asyncio.open_connection("127.0.0.1", int(scene.world.base_url.rpartition(":")[2]))
    head = f"PUT /api/v1/agent/files/{transaction} HTTP/1.1\r\nHost: x\r\nContent-Length: {len(LOG)}\r\n"
    writer.write(f"{head}Authorization: Bearer {scene.agent.link.ticket}\r\n\r\n".encode() + LOG[:300_000])
    await writer.drain()
    files = scene.world.settings.files
    await until("a part of it", lambda: any(files.rglob("*.part")))
    # An agent that restarts has discarded what it sent before.
    assert (await scene.send(transaction)).status_code == 204
    writer.write(LOG[300_000:310_000])
    assert b" 404 " in await asyncio.wait_for(reader.readline(), 20)
    writer.close()
    await until("the part to go", lambda: not any(files.rglob("*.part")))
    assert [path.read_bytes() for path in files.rglob("*.bin")] == [LOG]


async def test_what_breaks_off_leaves_nothing(scene: LogScene) -> None:
    transaction = await scene.fetch()
    _, writer = await asyncio.open_connection("127.0.0.1", int(scene.world.base_url.rpartition(":")[2]))
    head = f"PUT /api/v1/agent/files/{transaction} HTTP/1.1\r\nHost: x\r\nContent-Length: {len(LOG)}\r\n"
    writer.write(f"{head}Authorization: Bearer {scene.agent.link.ticket}\r\n\r\n".encode() + LOG[:300_000])
    await writer.drain()
    files = scene.world.settings.files
    await until("a part of it", lambda: any(files.rglob("*.part")))
    writer.transport.abort()
    await until("the part to go", lambda: not any(files.rglob("*.*")))
