"""The video process opens a camera only when the previous one has released the device, however fast requests change."""

import asyncio
import threading
import time

from onboard_agent.video.core.lines import Watched
from onboard_agent.video.process import CAMERA_KEPT_S, Parts, VideoProcess
from onboard_agent.video.sources.source import Picture
from wire.video import CameraState, Codec, Quality, StreamRequest

RATE_REQUESTS = (StreamRequest(Quality.LOW, Codec.MPEG1),)


class SlowCamera:
    """Releases its device when the test says so."""

    state, words = CameraState.OPENING, ""

    def __init__(self) -> None:
        self.began = asyncio.Event()
        self.stops = 0
        self.free = threading.Event()

    def start(self) -> None:
        self.began.set()

    @property
    def started(self) -> bool:
        return self.began.is_set()

    def stop(self) -> bool:
        self.stops += 1
        if self.started:
            self.free.wait(5)
        return True

    def newest(self) -> Picture | None:
        return None


class TransactionHandler:
    """Reports what is watched, and advances the time."""

    def __init__(self) -> None:
        self.cameras: list[SlowCamera] = []
        self.process = VideoProcess(
            Parts(lambda _request, _changed: self.make(), lambda _codec, _quality: None, lambda: ()),  # type: ignore[arg-type, return-value]
            None,
            (),
            lambda _report: None,
        )

    def make(self) -> SlowCamera:
        self.cameras.append(SlowCamera())
        return self.cameras[-1]

    def watch(self) -> SlowCamera:
        self.process.watched(Watched(ticket="t", streams=RATE_REQUESTS))
        return self.cameras[-1]

    def watch_nothing_for_long(self) -> None:
        self.process.watched(Watched(ticket="t"))
        self.process._tick(time.monotonic() + CAMERA_KEPT_S + 1)


async def settled() -> None:
    """Waits for threads to return, as far as they can."""
    await asyncio.get_running_loop().run_in_executor(None, lambda: None)
    for _ in range(5):
        await asyncio.sleep(0.01)


async def test_a_camera_waits_until_the_one_before_has_let_go() -> None:
    service = TransactionHandler()
    first = service.watch()
    assert first.started
    service.watch_nothing_for_long()
    second = service.watch()
    await settled()
    assert not second.started
    first.free.set()
    await asyncio.wait_for(second.began.wait(), 20)


async def test_also_where_one_between_was_given_up_before_it_began() -> None:
    service = TransactionHandler()
    first = service.watch()
    service.watch_nothing_for_long()
    between = service.watch()
    service.watch_nothing_for_long()
    last = service.watch()
    await settled()
    assert not last.started, "the device was still taken"
    first.free.set()
    await asyncio.wait_for(last.began.wait(), 20)
    assert not between.started
    assert (first.stops, last.stops) == (1, 0)


async def test_nobody_looks_any_more_when_the_device_is_free() -> None:
    service = TransactionHandler()
    first = service.watch()
    service.watch_nothing_for_long()
    second = service.watch()
    service.watch_nothing_for_long()
    first.free.set()
    await settled()
    assert not second.started
    third = service.watch()
    assert third.started, "at once"
