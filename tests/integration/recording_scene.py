"""A tower with one drone whose video can be recorded."""

import asyncio
import time
from collections.abc import AsyncIterator
from typing import Any

import httpx
from flying_scene import Scene
from worlds.camera_units import units
from worlds.recorded_video import VideoByHand

from wire.video import Codec


class RecordingScene(Scene):
    """A drone with a camera. The test sends its units."""

    async def begin(self) -> None:
        await super().begin()
        self.video = VideoByHand()
        self.world.tower.recordings.service.video = self.video

    async def record(self, client: httpx.AsyncClient | None = None, **body: Any) -> dict[str, Any]:
        answer = await (client or self.holder).post(f"{self.path}/recordings", json=body)
        assert answer.status_code == 201, answer.text
        begun: dict[str, Any] = answer.json()
        return begun

    async def stop(self, recording_id: int) -> dict[str, Any]:
        answer = await self.holder.post(f"{self.path}/recordings/{recording_id}/stop")
        assert answer.status_code == 200, answer.text
        ended: dict[str, Any] = answer.json()
        return ended

    async def get(self, recording_id: int) -> dict[str, Any]:
        answer = await self.watcher.get(f"{self.path}/recordings/{recording_id}")
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    async def came_to(self, recording_id: int, *states: str) -> dict[str, Any]:
        """Waits until the recording reaches one of these states."""
        async for found in self._looks(recording_id):
            if found["state"] in states:
                return found
        raise AssertionError(f"it did not come to be {states}: {await self.get(recording_id)}")

    async def shows(self, recording_id: int, flights: int) -> list[str]:
        """Waits until it reports this many flights."""
        async for found in self._looks(recording_id):
            if len(found["flights"]) == flights:
                return list(found["flights"])
        raise AssertionError(f"no {flights} flights: {await self.get(recording_id)}")

    async def _looks(self, recording_id: int) -> AsyncIterator[dict[str, Any]]:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            yield await self.get(recording_id)
            await asyncio.sleep(0.05)

    async def whole(self, *, codec: Codec = Codec.H264, pictures: int = 12) -> dict[str, Any]:
        """Makes a finished recording."""
        begun = await self.record()
        self.send(codec=codec, pictures=pictures)
        await self.stop(begun["id"])
        return await self.came_to(begun["id"], "ready", "failed")

    def send(self, *, codec: Codec = Codec.H264, pictures: int = 12, since_us: int | None = None) -> None:
        """`since_us`: when the first picture was taken, by the monotonic clock; None: now."""
        begun = time.monotonic_ns() // 1000 if since_us is None else since_us
        self.video.send(self.drone.id, units(codec, [begun + 40_000 * number for number in range(pictures)], group=6))

    @property
    def files(self) -> list[str]:
        folder = self.world.settings.files / "recordings" / f"drone-{self.drone.id}"
        return sorted(path.suffix for path in folder.iterdir()) if folder.is_dir() else []
