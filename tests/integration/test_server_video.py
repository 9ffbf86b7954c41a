"""Live video through a running tower: units from one sender to many viewers, codecs, tickets and cameras."""

import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from agent_fakes import until
from tower_world import assert_problem, start_tower
from video_scene import MEDIUM, Scene, wanted
from video_world import camera_agent, watching_video
from websockets.exceptions import InvalidStatus

from wire.video import HEADER_BYTES, CameraState, Codec, KeyWanted, Quality, encode_unit


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        async with scene.stack:
            await scene.set_up()
            yield scene


async def was_wanted(scene: Scene, *streams: tuple[Quality, Codec]) -> None:
    """Waits for the request, even if it has already ended."""

    def asked() -> bool:
        return any(
            tuple((one.quality, one.codec) for one in reported.streams) == streams
            for reported in scene.agent.all_wanted
        )

    await until(asked, what=f"to have been asked for {streams}")


async def test_video_is_asked_for_on_demand_and_comes_unchanged_but_for_the_clock(scene: Scene) -> None:
    await wanted(scene)
    viewer = await scene.watch()
    await wanted(scene, MEDIUM)
    await viewer.until(lambda: viewer.states() == ["waiting"])
    await scene.agent.announce(CameraState.LIVE)
    await scene.agent.open_video()
    await scene.clock_known()
    sent = scene.agent.unit(key=True, size=70_000, payload=bytes(range(256)) * 270)
    await scene.agent._video.send(encode_unit(sent))  # type: ignore[union-attr]
    await viewer.until(lambda: viewer.units)
    came = viewer.units[0]
    assert came._replace(capture_us=sent.capture_us) == sent
    assert -0.01 < viewer.delays_s()[0] < 0.5  # the clocks were compared on a busy machine
    await until(lambda: scene.agent.got, what="Got")
    assert scene.agent.got[0].sequence == sent.sequence
    assert viewer.states() == ["waiting", "waiting", "live"]
    assert [one["codecs"] for one in viewer.reported if one["type"] == "state"] == [[], ["mpeg1"], ["mpeg1"]]
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
    await viewer.until(lambda: viewer.reported[-1]["type"] == "clock")
    answer = viewer.reported[-1]
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
    assert not watcher.reported
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
    await scene.agent.announce(CameraState.LIVE)
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    await scene.agent.send(key=True)
    await viewer.until(lambda: viewer.states()[-1] == "live")
    await scene.agent.announce(CameraState.LOST, words="no such device")
    await viewer.until(lambda: viewer.states()[-1] == "camera-lost")
    assert viewer.reported[-1]["words"] == "The camera of Kestrel is lost: no such device"
    await scene.agent.announce(CameraState.LIVE, codecs=(Codec.MPEG1, Codec.H264))
    await scene.agent.send(key=True, is_break=True)
    await viewer.until(lambda: viewer.states()[-1] == "live")
    assert viewer.reported[-1]["codecs"] == ["mpeg1", "h264"]
    await scene.agent.announce(CameraState.LIVE, thin=True)
    await viewer.until(lambda: viewer.states()[-1] == "thin-link")
    answer = await scene.client.get(f"/api/v1/drones/{scene.drone.id}/video")
    assert answer.json()["state"] == "thin-link"
    assert answer.json()["streams"][0]["viewers"] == 1
    bare = await scene.world.add_drone("Swift", scene.alice)
    async with camera_agent(scene.world, bare, takes=()) as agent:
        other = await scene.watch(drone_id=bare.id)
        await other.until(lambda: other.states() == ["no-camera"])
        assert agent.wanted is None
