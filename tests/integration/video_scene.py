"""A tower with one drone that sends video."""

import asyncio
import contextlib
import time

import httpx
from agent_fakes import until
from tower_world import NewDrone, Person, TowerWorld
from video_world import CameraAgent, Watcher, camera_agent, watching_video

from server.kernel.people import Role
from wire.video import Codec, Quality


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


async def wanted(scene: Scene, *streams: tuple[Quality, Codec]) -> None:
    def asked() -> bool:
        reported = scene.agent.wanted
        return reported is not None and tuple((one.quality, one.codec) for one in reported.streams) == streams

    await until(asked, what=f"to be asked for {streams}")


MEDIUM = (Quality.MEDIUM, Codec.MPEG1)
