"""Recording through the relay: units over an agent's own connection, a real tower's files, a killed tower."""

import asyncio
import json
import subprocess
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import av
import httpx
import pytest
from agent_fakes import until
from control_world import ask
from tower_world import PASSWORD, NewDrone, start_tower
from video_world import CameraAgent, agent_us, camera_agent
from worlds.camera_units import number_in, units
from worlds.processes import World, kill_9

from wire.video import CameraState, Codec, decode_unit

RATE_HZ = 20
WITHIN_S = 60.0


@dataclass(frozen=True)
class Place:
    """The tower's details that a test agent needs."""

    base_url: str
    udp_port: int

    @property
    def agent_url(self) -> str:
        return self.base_url.replace("http", "ws", 1) + "/api/v1/agent"


async def film(agent: CameraAgent, codec: Codec, pictures: int) -> list[int]:
    """Sends pictures at their frame rate, the first a key. Returns the capture times, microseconds of the agent's
    clock."""
    made = [decode_unit(message) for message in units(codec, [0] * pictures, group=10, rate_hz=RATE_HZ)]
    taken: list[int] = []
    begun = time.monotonic()
    for number, unit in enumerate(made):
        await asyncio.sleep(max(0.0, begun + number / RATE_HZ - time.monotonic()))
        taken.append(agent_us())
        await agent.send(
            key=unit.key,
            codec=codec,
            payload=unit.payload,
            capture_us=taken[-1],
            width=320,
            height=240,
            rate_hz=RATE_HZ,
        )
    await until(lambda: len(agent.got) >= pictures, what="the tower to have it all")
    return taken


async def came_to(client: httpx.AsyncClient, path: str, fits: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Waits until the recording meets the condition."""
    deadline = time.monotonic() + WITHIN_S
    while True:
        found: dict[str, Any] = (await client.get(path)).json()
        if fits(found):
            return found
        assert time.monotonic() < deadline, found
        await asyncio.sleep(0.05)


def is_over(recording: dict[str, Any]) -> bool:
    return recording["state"] in ("ready", "failed")


async def downloaded(client: httpx.AsyncClient, path: str, target: Path) -> dict[str, Any]:
    """Downloads the file. Returns ffprobe's report on its one stream."""
    answer = await client.get(f"{path}/file")
    assert answer.status_code == 200, answer.text
    await asyncio.to_thread(target.write_bytes, answer.content)
    asked = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", str(target)]
    reported = await asyncio.to_thread(subprocess.run, asked, capture_output=True, text=True, check=True, timeout=60)
    assert reported.stderr == ""
    stream: dict[str, Any] = json.loads(reported.stdout)["streams"][0]
    return stream


def assert_shows(target: Path, taken_us: list[int]) -> None:
    """Asserts every picture, at its capture time."""
    with av.open(str(target)) as container:
        seen = [(number_in(frame), frame.time) for frame in container.decode(video=0)]
    assert [number for number, _ in seen] == list(range(len(taken_us)))
    # Pictures from before the clock comparison are placed by their arrival.
    assert [at for _, at in seen] == pytest.approx([(at - taken_us[0]) / 1e6 for at in taken_us], abs=0.2)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[tuple[CameraAgent, httpx.AsyncClient, str]]:
    """An agent with a camera, its holder, and the URL of the recordings."""
    async with start_tower(tmp_path) as world:
        alice = await world.add_user("alice")
        drone = await world.add_drone("Kestrel", alice)
        client = await world.signed_in(alice)
        async with camera_agent(world, drone) as agent:
            await agent.announce(CameraState.IDLE, codecs=(Codec.MPEG1, Codec.H264))
            assert (await ask(client, drone.id, "acquire")).status_code == 200
            path = f"/api/v1/drones/{drone.id}"
            await came_to(client, f"{path}/video", lambda video: video["codecs"] != [])
            yield agent, client, f"{path}/recordings"


@pytest.mark.parametrize("codec", list(Codec), ids=lambda one: one.name)
async def test_from_the_agent_to_the_file(
    scene: tuple[CameraAgent, httpx.AsyncClient, str], tmp_path: Path, codec: Codec
) -> None:
    agent, client, recordings = scene
    if codec is Codec.MPEG1:
        await agent.announce(CameraState.IDLE, codecs=(Codec.MPEG1,))
        await came_to(client, recordings.replace("recordings", "video"), lambda video: video["codecs"] == ["mpeg1"])
    begun = (await client.post(recordings, json={})).json()
    assert (begun["state"], begun["codec"]) == ("recording", codec.name.lower())
    # A recording requests video from the drone, as a viewer does.
    await agent.open_video()
    assert agent.wanted is not None
    assert [one.codec for one in agent.wanted.streams] == [codec]
    taken = await film(agent, codec, 40)
    path = f"{recordings}/{begun['id']}"
    assert (await client.post(f"{path}/stop")).status_code == 200
    ready = await came_to(client, path, is_over)
    assert (ready["state"], ready["words"], ready["pictures"]) == ("ready", "", 40)
    reported = await downloaded(client, path, tmp_path / "a.mp4")
    assert (reported["codec_name"], reported["pix_fmt"], reported["nb_read_frames"]) == ("h264", "yuv420p", "40")
    lasts = (taken[-1] - taken[0]) / 1e6 + 1 / RATE_HZ
    # The last picture stays for as long as the one before, which a busy machine may have sent early.
    pause = max(after - before for before, after in pairwise(taken)) / 1e6
    assert float(reported["duration"]) == pytest.approx(lasts, abs=0.2 + pause)
    assert_shows(tmp_path / "a.mp4", taken)
    # Nobody receives it any more: after a moment the tower tells the drone to stop.
    await until(lambda: agent.wanted is not None and agent.wanted.streams == (), what="the drone to be told to stop")


async def test_a_tower_that_is_killed_finishes_what_it_was_recording_when_it_is_back(tmp_path: Path) -> None:
    folder = tmp_path / "world"
    folder.mkdir()
    with World(folder) as world:
        await asyncio.to_thread(world.add_user, "alice")
        drone_id = await asyncio.to_thread(world.add_drone, "Kestrel", "alice")
        await asyncio.to_thread(world.start_tower)
        key = await asyncio.to_thread(world.enrolled, "Kestrel")
        recordings = f"/api/v1/drones/{drone_id}/recordings"
        async with httpx.AsyncClient(base_url=world.address, trust_env=False, timeout=20) as client:
            assert (await client.post("/api/v1/session", json={"name": "alice", "password": PASSWORD})).is_success
            place: Any = Place(world.address, world.udp_port)
            async with camera_agent(place, NewDrone(drone_id, "Kestrel", key)) as agent:
                await agent.announce(CameraState.IDLE, codecs=(Codec.MPEG1,))
                await came_to(client, f"/api/v1/drones/{drone_id}/video", lambda video: video["codecs"] != [])
                assert (await ask(client, drone_id, "acquire")).status_code == 200
                begun = (await client.post(recordings)).json()
                await agent.open_video()
                taken = await film(agent, Codec.MPEG1, 40)
                first_s = time.time() - (agent_us() - taken[0]) / 1e6
                # A killed process loses nothing of the page cache.
                await until(lambda: written(world.folder) > 20_000, what="the units on the disk")
                await came_to(client, f"{recordings}/{begun['id']}", lambda one: one["pictures"] == 40)
                await asyncio.to_thread(kill_9, world.tower)
        await asyncio.to_thread(world.start_tower)
        async with httpx.AsyncClient(base_url=world.address, trust_env=False, timeout=20) as client:
            assert (await client.post("/api/v1/session", json={"name": "alice", "password": PASSWORD})).is_success
            path = f"{recordings}/{begun['id']}"
            ready = await came_to(client, path, is_over)
            assert (ready["state"], ready["words"]) == ("ready", "the tower stopped during the recording")
            assert ready["ended_at"] > ready["first_picture_at"] > ready["began_at"]
            assert datetime.fromisoformat(ready["first_picture_at"]).timestamp() == pytest.approx(first_s, abs=0.2)
            reported = await downloaded(client, path, tmp_path / "a.mp4")
            # Units received in the last instant may not have been written.
            shown = int(reported["nb_read_frames"])
            assert 38 <= shown <= 40
            assert_shows(tmp_path / "a.mp4", taken[:shown])
            assert written(world.folder) == 0


def written(folder: Path) -> int:
    """Returns the bytes of units on the disk."""
    return sum(path.stat().st_size for path in (folder / "files").rglob("*.units"))
