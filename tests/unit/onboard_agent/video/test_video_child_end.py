"""A video process that cannot be killed delays neither the next one nor the end of the agent."""

import asyncio
from asyncio.subprocess import Process
from typing import cast

import pytest

from onboard_agent.video import child
from onboard_agent.video.core.lines import SetUp
from onboard_agent.video.core.service import VideoService
from wire.video import VIDEO, Codec, Quality, StreamRequest, VideoWanted


class Pipe:
    def write(self, line: bytes) -> None:
        pass

    def close(self) -> None:
        pass


class Hung:
    """Hangs in a driver, where no signal reaches it."""

    returncode = None
    stdin = Pipe()
    pid = 4711

    def __init__(self) -> None:
        self.kills = 0

    def kill(self) -> None:
        self.kills += 1

    async def wait(self) -> None:
        await asyncio.Event().wait()


@pytest.mark.parametrize("cancelled", [False, True], ids=["given up", "agent ends"])
async def test_what_cannot_be_killed_is_left_behind(monkeypatch: pytest.MonkeyPatch, *, cancelled: bool) -> None:
    monkeypatch.setattr(child, "END_WITHIN_S", 0.02)
    monkeypatch.setattr(child, "GONE_WITHIN_S", 0.02, raising=False)
    process, reading = Hung(), asyncio.create_task(never())
    ending = asyncio.create_task(child._end(cast(Process, process), reading))
    await asyncio.sleep(0)
    if cancelled:
        ending.cancel()
    done, _ = await asyncio.wait({ending}, timeout=30)
    ending.cancel()
    assert done == {ending}
    assert ending.cancelled() is cancelled
    assert process.kills == 1
    assert reading.cancelled()


async def test_beside_one_that_hangs_no_second_one_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child, "END_WITHIN_S", 0.02)
    monkeypatch.setattr(child, "GONE_WITHIN_S", 0.02)
    monkeypatch.setattr(child, "FIRST_PAUSE_S", 0.0)
    monkeypatch.setattr(asyncio, "create_subprocess_exec", start)
    service = VideoService(has_camera=True)
    service.link_up((VIDEO,))
    service.wanted(VideoWanted(ticket="a", streams=(StreamRequest(Quality.LOW, Codec.MPEG1),)), 0.0)
    video = child.VideoChild(service, SetUp(tower="", camera="", uplinks=()), lambda: None)
    monkeypatch.setattr(video, "_watch", broken)
    monkeypatch.setattr(video, "_read", lambda _process: never())
    running = asyncio.create_task(video.run())
    await asyncio.sleep(0.5)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    assert video.starts == 1


async def start(*_: object, **__: object) -> Hung:
    return Hung()


async def broken(*_: object) -> str:
    return "hangs"


async def never() -> str:
    await asyncio.Event().wait()
    return ""
