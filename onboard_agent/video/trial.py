"""Tests the camera for `tower-agent check`: the video process opens it and reports its state."""

import asyncio
import contextlib
from typing import Final

from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.video.child import VideoChild
from onboard_agent.video.core.lines import SetUp
from onboard_agent.video.core.service import VideoService
from onboard_agent.video.sources.schemes import shown
from wire.video import VIDEO, CameraState, Codec, Quality, StreamRequest, VideoState, VideoWanted

WITHIN_S: Final = 30.0
"""For a small computer that reads all libraries from a memory card, and a camera that wakes up afterwards."""


async def try_camera(camera: str, tower: TowerUrl) -> tuple[bool, str]:
    """Returns whether the camera gives pictures, and a description. Sends nothing: there is no valid ticket."""
    service = VideoService(has_camera=True)
    service.link_up((VIDEO,))
    service.wanted(
        VideoWanted(ticket="none", streams=(StreamRequest(Quality.HIGH, Codec.MPEG1),)),
        asyncio.get_running_loop().time(),
    )
    tried = asyncio.Event()
    state = VideoState(camera=CameraState.OPENING)

    def changed() -> None:
        nonlocal state
        if tried.is_set():
            return
        state = service.messages_to_tower() or state
        if state.camera in (CameraState.LIVE, CameraState.LOST):
            tried.set()

    child = VideoChild(
        service, SetUp(tower=str(tower), camera=camera, uplinks=("",), log_level="critical", trial=True), changed
    )
    running = asyncio.create_task(child.run())
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(WITHIN_S):
            await tried.wait()
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    if state.camera is CameraState.LIVE:
        codecs = " and ".join(codec.name for codec in state.codecs)
        return True, f"the camera {shown(camera)} gives pictures; this computer can send {codecs}"
    return False, state.words or f"no picture of {shown(camera)} within {WITHIN_S:.0f} s"
