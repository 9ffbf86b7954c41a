"""An encoder that hangs: viewers are notified before the process ends because of it."""

import asyncio
import threading
import time
from typing import Any, cast

import av

from onboard_agent.video.channel import VideoChannel
from onboard_agent.video.core.lines import Report, Watched
from onboard_agent.video.encoders.encoder import Encoder
from onboard_agent.video.process import HANGING_WORDS, SAID_AFTER_S, Parts, VideoProcess
from onboard_agent.video.sources.source import Picture
from wire.video import CameraState, Codec, Quality, StreamRequest


class OnePicture:
    state, words = CameraState.LIVE, ""

    def __init__(self) -> None:
        self.picture: Picture | None = Picture(av.VideoFrame(160, 120, "yuv420p"), time.monotonic_ns() // 1000, 1, True)

    def start(self) -> None:
        pass

    def stop(self) -> bool:
        return True

    def newest(self) -> Picture | None:
        picture, self.picture = self.picture, None
        return picture


class OpenChannel:
    is_open, words = True, ""

    def tick(self) -> None:
        pass


class HangingEncoder:
    name = "hanging"

    def __init__(self) -> None:
        self.encodes, self.go_on = threading.Event(), threading.Event()

    def retune(self, **_: Any) -> None:
        pass

    def encode(self, *_: Any, **__: Any) -> list[Any]:
        self.encodes.set()
        self.go_on.wait(10)
        return []


async def test_that_an_encoder_does_not_answer_is_said_until_it_does() -> None:
    said: list[Report] = []
    lives = asyncio.Event()

    def say(report: Report) -> None:
        said.append(report)
        if report.camera is CameraState.LIVE:
            lives.set()

    encoder = HangingEncoder()
    parts = Parts(lambda _request, _changed: OnePicture(), lambda _codec, _quality: cast(Encoder, encoder), lambda: ())
    process = VideoProcess(parts, None, (), say)
    process.watched(Watched(ticket="t", streams=(StreamRequest(Quality.LOW, Codec.MPEG1),)))
    process._channel = cast(VideoChannel, OpenChannel())
    process._news()
    began = process._encodes_since
    assert began is not None
    await asyncio.to_thread(encoder.encodes.wait, 10)
    process._tick(began + SAID_AFTER_S - 0.1)
    assert said[-1].camera is CameraState.LIVE
    process._tick(began + SAID_AFTER_S + 0.1)
    assert (said[-1].camera, said[-1].words) == (CameraState.LOST, HANGING_WORDS)
    lives.clear()
    encoder.go_on.set()
    await asyncio.wait_for(lives.wait(), 10)
