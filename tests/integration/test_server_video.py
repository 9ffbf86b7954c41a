"""Live video through a running tower: tickets, units from one to many, who may watch, who may not any more."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from agent_fakes import until
from tower_world import NewDrone, Person, TowerWorld, assert_problem, start_tower
from video_world import CameraAgent, Watcher, camera_agent, filming, watching_video
from websockets.exceptions import ConnectionClosed, InvalidStatus

from server.domain.people import Role
from server.live.relay.flood_gate import FLOODING
from server.live.video.drone_video import UNITS_BURST
from wire.video import HEADER_BYTES, CameraState, Codec, KeyWanted, Quality, encode_unit


class Scene:
    """Alice's drone with a camera, and an admin."""

    def __init__(self, world: TowerWorld) -> None:
        self.world = world
        self.stack = contextlib.AsyncExitStack()

    async def set_up(self) -> None:
        self.admin: Person = await self.world.add_user("root", Role.ADMIN)
        self.alice: Person = await self.world.add_user("alice")
        self.mallory: Person = await self.world.add_user("mallory")
        self.drone: NewDrone = await self.world.add_drone("Kestrel", self.alice)
        self.agent: CameraAgent = await self.stack.enter_async_context(camera_agent(self.world, self.drone))
        self.client: httpx.AsyncClient = await self.world.signed_in(self.alice)

    def headers(self, client: httpx.AsyncClient) -> dict[str, str]:
        return {**self.world.cookie_header(client), "Origin": self.world.base_url}

    async def clock_known(self) -> None:
        deadline = time.monotonic() + 20
        while (await self.client.get(f"/api/v1/drones/{self.drone.id}/video")).json()["clock_error_ms"] is None:
            assert time.monotonic() < deadline
            await asyncio.sleep(0.02)

    async def watch(
        self,
        client: httpx.AsyncClient | None = None,
        *,
        drone_id: int | str | None = None,
        query: str = "",
        receive_buffer: int | None = None,
    ) -> Watcher:
        return await self.stack.enter_async_context(
            watching_video(
                self.world,
                self.drone.id if drone_id is None else drone_id,
                self.headers(client or self.client),
                query=query,
                receive_buffer=receive_buffer,
            )
        )


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        async with scene.stack:
            await scene.set_up()
            yield scene


async def wanted(scene: Scene, *streams: tuple[Quality, Codec]) -> None:
    def asked() -> bool:
        told = scene.agent.wanted
        return told is not None and tuple((one.quality, one.codec) for one in told.streams) == streams

    await until(asked, what=f"to be asked for {streams}")


async def was_wanted(scene: Scene, *streams: tuple[Quality, Codec]) -> None:
    """Even if it is over by now."""

    def asked() -> bool:
        return any(
            tuple((one.quality, one.codec) for one in told.streams) == streams for told in scene.agent.all_wanted
        )

    await until(asked, what=f"to have been asked for {streams}")


MEDIUM = (Quality.MEDIUM, Codec.MPEG1)


async def test_video_is_asked_for_on_demand_and_comes_unchanged_but_for_the_clock(scene: Scene) -> None:
    await wanted(scene)
    viewer = await scene.watch()
    await wanted(scene, MEDIUM)
    await viewer.until(lambda: viewer.states() == ["waiting"])
    await scene.agent.tell(CameraState.LIVE)
    await scene.agent.open_video()
    await scene.clock_known()
    sent = scene.agent.unit(key=True, size=70_000, payload=bytes(range(256)) * 270)
    await scene.agent._video.send(encode_unit(sent))  # type: ignore[union-attr]
    await viewer.until(lambda: viewer.units)
    came = viewer.units[0]
    assert came._replace(capture_us=sent.capture_us) == sent
    assert -0.001 < viewer.delays_s()[0] < 0.5
    await until(lambda: scene.agent.got, what="Got")
    assert scene.agent.got[0].sequence == sent.sequence
    assert viewer.states() == ["waiting", "waiting", "live"]
    assert [one["codecs"] for one in viewer.told if one["type"] == "state"] == [[], ["mpeg1"], ["mpeg1"]]
    await viewer.go()
    await wanted(scene)  # after a few seconds
    metrics = scene.world.tower.hub.video.traffic
    assert (metrics.units_in, metrics.units_out) == (1, 1)
    assert metrics.bytes_in == HEADER_BYTES + len(sent.payload)


async def test_a_late_joiner_gets_a_key_first_and_two_viewers_the_same(scene: Scene) -> None:
    first = await scene.watch()
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    for number, key in enumerate((True, False, False, True, False, False, False), 1):
        await scene.agent.send(key=key)
        await first.until(lambda number=number: len(first.units) == number)  # type: ignore[misc]
    second = await scene.watch()
    await second.until(lambda: len(second.units) == 4)
    assert [unit.sequence for unit in second.units] == [3, 4, 5, 6]
    assert second.units[0].key
    await scene.agent.send()
    await second.until(lambda: len(second.units) == 5)
    await first.until(lambda: len(first.units) == 8)
    assert first.units[-1] == second.units[-1]


async def test_after_a_gap_or_a_break_nothing_comes_before_the_next_key(scene: Scene) -> None:
    viewer = await scene.watch()
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    await scene.agent.send()
    await until(lambda: scene.agent.keys_asked, what="to be asked for a key picture")
    assert scene.agent.keys_asked == [KeyWanted(Quality.MEDIUM, Codec.MPEG1)]
    await scene.agent.send(key=True)
    await viewer.until(lambda: len(viewer.units) == 1)
    await scene.agent.send()
    await viewer.until(lambda: len(viewer.units) == 2)
    await scene.agent.send(sequence=77)
    await scene.agent.send(sequence=78)
    await scene.agent.send(sequence=79, key=True, is_break=True)
    await viewer.until(lambda: viewer.units and viewer.units[-1].sequence == 79)
    assert [unit.sequence for unit in viewer.units] == [1, 2, 79]


async def test_switching_goes_without_reconnecting(scene: Scene) -> None:
    viewer = await scene.watch(query="?quality=low")
    await scene.agent.open_video()
    await wanted(scene, (Quality.LOW, Codec.MPEG1))
    await scene.agent.send(key=True, quality=Quality.LOW)
    await viewer.until(lambda: viewer.units)
    await viewer.ask(type="want", quality="high", codec="mpeg1")
    await was_wanted(scene, (Quality.LOW, Codec.MPEG1), (Quality.HIGH, Codec.MPEG1))
    await scene.agent.send(key=True, quality=Quality.HIGH)
    await viewer.until(lambda: len(viewer.units) == 2)
    assert [unit.quality for unit in viewer.units] == [Quality.LOW, Quality.HIGH]
    await wanted(scene, (Quality.HIGH, Codec.MPEG1))
    await viewer.ask(type="clock", sent=12.5)
    await viewer.until(lambda: viewer.told[-1]["type"] == "clock")
    answer = viewer.told[-1]
    assert answer["sent"] == 12.5
    assert abs(answer["tower_us"] / 1e6 - time.monotonic()) < 5


@pytest.mark.parametrize("which", ["theirs", "not-there", "no-number"])
async def test_a_stranger_gets_the_answer_of_a_drone_that_is_not_there(scene: Scene, which: str) -> None:
    stranger = await scene.world.signed_in(scene.mallory)
    ids: dict[str, int | str] = {"theirs": scene.drone.id, "not-there": 4_000, "no-number": "kestrel"}
    drone_id = ids[which]
    watcher = await scene.watch(stranger, drone_id=drone_id)
    assert await watcher.until_closed() == 4404
    assert watcher.connection.close_reason == "there is no such drone"
    assert not watcher.told
    if which != "no-number":
        answer = await stranger.get(f"/api/v1/drones/{drone_id}/video")
        assert_problem(answer, 404, "unknown-drone")


async def test_who_may_come_in_at_all_is_as_on_the_live_channel(scene: Scene) -> None:
    world = scene.world
    headers = scene.headers(scene.client)
    cases = (({"Origin": world.base_url}, 4401), (headers | {"Origin": "https://elsewhere.example"}, 4403))
    for one, code in cases:
        async with watching_video(world, scene.drone.id, one) as watcher:
            assert await watcher.until_closed() == code
    for query in ("quality=best", "quality=low&quality=high", "codec=mpeg1&codec=h264", "quality=", "codec=,"):
        bad = await scene.watch(query=f"?{query}")
        assert await bad.until_closed() == 4400, query
    answer = await scene.client.post("/api/v1/tokens", json={"name": "wall", "scopes": ["watch"]})
    assert answer.status_code == 201, answer.text
    async with watching_video(world, scene.drone.id, {"Authorization": f"Bearer {answer.json()['secret']}"}) as program:
        await program.until(lambda: program.states() == ["waiting"])


@pytest.mark.parametrize("ticket", ["", "nonsense", "key"])
async def test_only_a_ticket_of_a_link_that_stands_opens_the_agents_channel(scene: Scene, ticket: str) -> None:
    shown = str(scene.drone.key) if ticket == "key" else ticket
    with pytest.raises(InvalidStatus) as refused:
        await scene.agent.open_video(shown)
    assert refused.value.response.status_code == 401


async def test_a_ticket_ends_with_its_link_and_the_channel_with_it(scene: Scene) -> None:
    viewer = await scene.watch()
    await wanted(scene, MEDIUM)
    channel = await scene.agent.open_video()
    await scene.agent.send(key=True)
    await viewer.until(lambda: viewer.states()[-1:] == ["live"])
    before = scene.agent.wanted
    assert before is not None
    async with camera_agent(scene.world, scene.drone) as again:
        await until(lambda: again.wanted and again.wanted.streams, what="the new link to be told")
        assert again.wanted is not None
        assert again.wanted.ticket != before.ticket
        await until(lambda: channel.close_code == 4401, what="the old channel to end")
        with pytest.raises(InvalidStatus):
            await again.open_video(before.ticket)
        await again.open_video()
        await again.send(key=True)
        await viewer.until(lambda: len(viewer.units) == 2)
    await viewer.until(lambda: viewer.states()[-1] == "offline")
    assert "waiting" in viewer.states()[1:]


async def test_camera_lost_and_back_is_told_and_no_camera_too(scene: Scene) -> None:
    viewer = await scene.watch()
    await scene.agent.tell(CameraState.LIVE)
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    await scene.agent.send(key=True)
    await viewer.until(lambda: viewer.states()[-1] == "live")
    began = time.monotonic()
    await scene.agent.tell(CameraState.LOST, words="no such device")
    await viewer.until(lambda: viewer.states()[-1] == "camera-lost")
    assert time.monotonic() - began < 1.0
    assert viewer.told[-1]["words"] == "The camera of Kestrel is lost: no such device"
    await scene.agent.tell(CameraState.LIVE, codecs=(Codec.MPEG1, Codec.H264))
    await scene.agent.send(key=True, is_break=True)
    await viewer.until(lambda: viewer.states()[-1] == "live")
    assert viewer.told[-1]["codecs"] == ["mpeg1", "h264"]
    await scene.agent.tell(CameraState.LIVE, thin=True)
    await viewer.until(lambda: viewer.states()[-1] == "thin-link")
    answer = await scene.client.get(f"/api/v1/drones/{scene.drone.id}/video")
    assert answer.json()["state"] == "thin-link"
    assert answer.json()["streams"][0]["viewers"] == 1
    bare = await scene.world.add_drone("Swift", scene.alice)
    async with camera_agent(scene.world, bare, takes=()) as agent:
        other = await scene.watch(drone_id=bare.id)
        await other.until(lambda: other.states() == ["no-camera"])
        assert agent.wanted is None


async def test_the_end_of_a_session_ends_its_video(scene: Scene) -> None:
    watcher = await scene.watch()
    await watcher.until(lambda: watcher.states())
    assert (await scene.client.delete("/api/v1/session")).status_code == 204
    assert await watcher.until_closed() == 4401


async def test_a_disabled_account_and_a_lost_drone_end_video_at_once(scene: Scene) -> None:
    watcher = await scene.watch()
    root = await scene.world.signed_in(scene.admin)
    of_admin = await scene.watch(root)
    await of_admin.until(lambda: of_admin.states())
    answer = await root.patch(f"/api/v1/users/{scene.alice.id}", json={"disabled": True})
    assert answer.status_code == 200, answer.text
    assert await watcher.until_closed() == 4401
    assert (await root.delete(f"/api/v1/drones/{scene.drone.id}")).status_code in (200, 204)
    assert await of_admin.until_closed() == 4404


@pytest.mark.parametrize("how", ["view", "video"])
async def test_take_moves_the_video_if_the_admin_says_so(scene: Scene, how: str) -> None:
    base = f"/api/v1/drones/{scene.drone.id}/control"
    root = await scene.world.signed_in(scene.admin)
    assert (await scene.client.post(f"{base}/acquire")).status_code == 200
    watcher = await scene.watch()
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    await scene.agent.send(key=True)
    await watcher.until(lambda: watcher.units)
    body = {"watch": False} if how == "view" else {"video": "move"}
    assert (await root.post(f"{base}/take", json=body)).status_code == 200
    await scene.agent.send()
    assert await watcher.until_closed() == 4403
    assert len(watcher.units) == 1
    assert "Kestrel" in (watcher.connection.close_reason or "")
    again = await scene.watch()
    assert await again.until_closed() == 4403
    assert_problem(await scene.client.get(f"/api/v1/drones/{scene.drone.id}/video"), 403, "view-taken")
    seen = (await scene.client.get(f"/api/v1/drones/{scene.drone.id}")).json()
    assert (seen["may_watch"], seen["may_watch_video"]) == (how == "video", False)
    assert (await root.post(f"{base}/give")).status_code == 200
    offered = await scene.watch()
    await offered.until(offered.states)
    await scene.agent.send(key=True)
    await offered.until(lambda: offered.units)
    trail = (await root.get("/api/v1/audit", params={"action": "control.take"})).json()
    detail = trail["records"][0]["detail"] if "records" in trail else trail[0]["detail"]
    assert detail["video_taken"] is True
    assert detail["view_taken"] is (how == "view")


async def test_take_keeps_the_video_unless_it_is_said(scene: Scene) -> None:
    base = f"/api/v1/drones/{scene.drone.id}/control"
    root = await scene.world.signed_in(scene.admin)
    assert (await scene.client.post(f"{base}/acquire")).status_code == 200
    watcher = await scene.watch()
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    assert (await root.post(f"{base}/take", json={})).status_code == 200
    await scene.agent.send(key=True)
    await watcher.until(lambda: watcher.units)


async def test_what_is_no_unit_ends_the_agents_channel_and_nonsense_a_viewers(scene: Scene) -> None:
    watcher = await scene.watch()
    channel = await scene.agent.open_video()
    await channel.send(b"\x07" * 100)
    await until(lambda: channel.close_code == 4400, what="the end of the channel")
    await watcher.ask(type="fly")
    assert await watcher.until_closed() == 4400
    for large in (b"{" * 2_000, b"\x00" * 10):
        one = await scene.watch()
        await one.connection.send(large, text=len(large) > 100)
        assert await one.until_closed() in (1009, 4400)
    channel = await scene.agent.open_video()
    await channel.send(b"\x01" * 300_000)
    await until(lambda: channel.close_code == 1009, what="the end of the channel")


async def test_a_flood_of_units_does_not_go_on_by_coming_again(scene: Scene) -> None:
    async def flood(count: int) -> int:
        """How many of so many units were taken before the channel was closed."""
        channel = await scene.agent.open_video()
        answered = len(scene.agent.got)
        with contextlib.suppress(ConnectionClosed):
            for number in range(count):
                await scene.agent.send(key=number == 0, size=188)
        await until(lambda: channel.close_code == FLOODING, what="the end of the flood")
        return len(scene.agent.got) - answered

    assert await flood(3 * round(UNITS_BURST)) >= UNITS_BURST
    assert await flood(round(UNITS_BURST)) < UNITS_BURST


async def test_more_streams_than_a_user_may_have(tmp_path: Path) -> None:
    async with start_tower(tmp_path, user_video_sockets=2) as world:
        scene = Scene(world)
        async with scene.stack:
            await scene.set_up()
            kept = [await scene.watch() for _ in range(2)]
            for one in kept:
                await one.until(one.states)
            third = await scene.watch()
            assert await third.until_closed() == 4430


@contextlib.asynccontextmanager
async def throttled(watcher: Watcher, bytes_per_s: float) -> AsyncIterator[None]:
    watcher.bytes_per_s = bytes_per_s
    yield
    watcher.bytes_per_s = None


async def test_a_throttled_viewer_is_never_late_recovers_and_disturbs_nobody(scene: Scene) -> None:
    """A third of the bit rate: 24 pictures of 2 to 7 kB are 58 kB/s."""
    slow = await scene.watch(receive_buffer=2_048)
    fast = await scene.watch()
    await scene.agent.open_video()
    await scene.clock_known()
    async with filming(scene.agent):
        await fast.until(lambda: len(fast.units) > 24)
        began = time.monotonic()
        async with throttled(slow, 58_000 / 3):
            await asyncio.sleep(6)
        ended = time.monotonic()
        during = slow.delays_s(began)
        await asyncio.sleep(4)
    # Everything is in this process: what the machine itself was late by is the other viewer's delay.
    machine_s = max(fast.delays_s(began))
    assert len(during) > 12
    assert max(during) < 1.0 + machine_s
    after = slow.delays_s(ended + 2.0)
    assert len(after) > 20
    assert sorted(after)[len(after) * 9 // 10] < 0.25
    undisturbed = fast.delays_s(began)
    assert sorted(undisturbed)[len(undisturbed) * 9 // 10] < 0.25
    follows = True
    for before, unit in zip(slow.units, slow.units[1:], strict=False):
        follows = follows and (unit.key or unit.sequence == before.sequence + 1)
    assert follows, "what cannot be decoded was sent"
    assert slow.skipped() > 40
    assert fast.skipped() < slow.skipped() / 5
