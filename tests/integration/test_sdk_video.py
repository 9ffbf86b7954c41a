"""Video of the SDK through a running tower: pictures in their order as arrays, and the end with its reason."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from av.video.frame import VideoFrame
from tower_world import start_tower
from video_scene import MEDIUM, Scene, wanted
from worlds.camera_units import number_in, units

from control_tower import Tower, TowerError
from wire.video import CameraState, Codec


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        async with scene.stack:
            await scene.set_up()
            yield scene


async def test_pictures_are_arrays(scene: Scene) -> None:
    made = await scene.client.post("/api/v1/tokens", json={"name": "eyes", "scopes": ["watch"]})
    assert made.status_code == 201, made.text
    numbers: list[int] = []

    async def look() -> None:
        tower = Tower(scene.world.base_url, made.json()["secret"])
        async with tower, tower.drone("Kestrel").video() as pictures:
            async for picture in pictures:
                assert picture.image.shape == (240, 320, 3)
                numbers.append(number_in(VideoFrame.from_ndarray(picture.image, format="rgb24")))

    looking = asyncio.create_task(look())
    await wanted(scene, MEDIUM)
    await scene.agent.announce(CameraState.LIVE)
    await scene.agent.open_video()
    for message in units(Codec.MPEG1, [1_000_000 + 40_000 * number for number in range(10)]):
        await scene.agent._video.send(message)  # type: ignore[union-attr]
        count = len(numbers)
        async with asyncio.timeout(20):
            while len(numbers) == count:
                assert not looking.done(), looking.exception()
                await asyncio.sleep(0.01)
    assert numbers == list(range(10))
    await scene.client.delete(f"/api/v1/tokens/{made.json()['token']['id']}")
    async with asyncio.timeout(20):
        with pytest.raises(TowerError):
            await looking
