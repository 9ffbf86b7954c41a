"""A flight's video with a burnt-in flight display over REST: asked for, watched, downloaded, and who may."""

import asyncio
import io
import secrets
from collections.abc import AsyncIterator
from datetime import datetime, timedelta
from pathlib import Path

import av
import httpx
import pytest
from control_world import ask
from flight_scene import FlightScene
from tower_world import assert_problem, start_tower
from worlds.clock_film import HEIGHT, PICTURES_S, WIDTH, write_film

from server.flights.core import recorder
from server.video.store.store import MP4
from server.video.store.tables import RecordingRow

PICTURES = 10


@pytest.fixture(autouse=True)
def _land_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "AFTER_S", 0.3)


class FilmScene(FlightScene):
    stranger: httpx.AsyncClient


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[FilmScene]:
    async with start_tower(tmp_path) as world:
        scene = FilmScene(world)
        await scene.begin()
        scene.stranger = await world.signed_in(await world.add_user("mallory"))
        yield scene


async def filmed(scene: FilmScene, began_at: datetime, first_picture_at: datetime | None = None) -> int:
    """The id of a recording of that time."""
    store = scene.world.tower.recordings.store
    path = store.path(scene.drone.id, secrets.token_hex(8), MP4)
    path.parent.mkdir(exist_ok=True)
    await asyncio.to_thread(write_film, path, PICTURES / PICTURES_S)
    async with scene.world.database.writing() as session:
        row = RecordingRow(
            drone_id=scene.drone.id,
            store=store.id,
            file=path.stem,
            by_name="alice",
            quality="low",
            codec="h264",
            state="ready",
            began_at=began_at,
            first_picture_at=first_picture_at,
            ended_at=(first_picture_at or began_at) + timedelta(seconds=PICTURES / PICTURES_S),
            size_bytes=path.stat().st_size,
            duration_s=PICTURES / PICTURES_S,
            pictures=PICTURES,
            width=WIDTH,
            height=HEIGHT,
        )
        session.add(row)
        await session.flush()
        return row.id


async def made(scene: FilmScene, display: str) -> httpx.Response:
    """The answer with the file, when it is made."""
    begun = await scene.holder.post(display)
    assert begun.status_code == 202, begun.text
    async with asyncio.timeout(60):
        while (video := (await scene.holder.get(display)).json())["state"] != "ready":
            assert video["state"] in ("waiting", "making"), video
            await asyncio.sleep(0.05)
    return await scene.holder.get(f"{display}/file")


async def test_it_is_made_downloaded_and_seen_by_those_who_may(scene: FilmScene) -> None:
    flight = await scene.whole()
    began_at = datetime.fromisoformat(flight["began_at"])
    path = f"/api/v1/flights/{flight['id']}/video"
    display = f"{path}/{await filmed(scene, began_at)}/display"
    assert_problem(await scene.holder.get(display), 404, "flight-video-not-made")
    assert_problem(await scene.holder.get(f"{display}/file"), 404, "flight-video-not-made")
    assert_problem(await scene.stranger.post(display), 404, "unknown-flight")
    assert_problem(await scene.holder.post(f"{path}/77/display"), 404, "unknown-recording")

    answer = await made(scene, display)
    assert (answer.status_code, answer.headers["content-type"]) == (200, "video/mp4")
    assert len(answer.content) == (await scene.holder.get(display)).json()["size_bytes"]
    with av.open(io.BytesIO(answer.content), "r") as film:
        assert len(list(film.decode(video=0))) == PICTURES
    part = await scene.holder.get(f"{display}/file", headers={"Range": "bytes=0-9"})
    assert (part.status_code, part.content) == (206, answer.content[:10])

    assert_problem(await scene.stranger.get(display), 404, "unknown-flight")
    assert_problem(await scene.stranger.get(f"{display}/file"), 404, "unknown-flight")
    # Who lost the view with the controls sees no video either, also none that was made before.
    taken = await ask(scene.admin, scene.drone.id, "take", video="move")
    assert taken.status_code == 200, taken.text
    for refused in (await scene.holder.get(f"{display}/file"), await scene.holder.post(display)):
        assert refused.status_code == 404, refused.text
    assert (await scene.admin.get(display)).json()["state"] == "ready"


async def test_a_recording_of_another_time_is_none_of_the_flight(scene: FilmScene) -> None:
    flight = await scene.whole()
    later = datetime.fromisoformat(flight["ended_at"]) + timedelta(minutes=5)
    display = f"/api/v1/flights/{flight['id']}/video/{await filmed(scene, later)}/display"
    assert_problem(await scene.holder.post(display), 404, "unknown-recording")


async def test_a_recording_is_drawn_on_from_its_first_picture(scene: FilmScene) -> None:
    flight = await scene.whole()
    began_at = datetime.fromisoformat(flight["began_at"])
    early = began_at - timedelta(seconds=30)
    recordings = [await filmed(scene, *times) for times in ((early, began_at), (began_at,), (early,))]
    files = [
        (await made(scene, f"/api/v1/flights/{flight['id']}/video/{one}/display")).content for one in recordings[:2]
    ]
    assert files[0] == files[1]  # UTC is drawn on each picture
    # Of an old recording only the beginning is known, and it ended before the flight.
    answer = await scene.holder.post(f"/api/v1/flights/{flight['id']}/video/{recordings[2]}/display")
    assert_problem(answer, 404, "unknown-recording")
    video = (await scene.holder.get(f"/api/v1/flights/{flight['id']}")).json()["video"]
    assert [(one["id"], one["first_picture_at"]) for one in video] == [
        (recordings[1], None),
        (recordings[0], flight["began_at"]),
    ]
    report = (await scene.holder.get(f"/api/v1/flights/{flight['id']}/report")).text
    assert f"<td>{recordings[0]}, low quality</td>" in report
