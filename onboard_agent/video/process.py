"""The video process: connects camera, encoders and channel, as the flight process demands. Decides nothing itself.

Everything runs in the event loop, except the camera's thread and one thread for the encoders. A thread that hangs
cannot be recovered: the whole process then ends, and the flight process starts another one.
"""

import asyncio
import logging
import os
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final, Protocol

import msgspec

from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.video.channel import VideoChannel
from onboard_agent.video.core.lines import REPORT_EVERY_S, Report, Watched
from onboard_agent.video.core.link_memory import LinkMemory, Remembered
from onboard_agent.video.core.streaming import Encoded, Order, Streaming
from onboard_agent.video.frame_share import FrameWriter
from onboard_agent.video.sources.source import Picture, PictureRequest
from onboard_agent.video.stream_encoders import MakeEncoder, StreamEncoders
from wire.video import LIMITS, CameraState, Codec, StreamRequest

_log = logging.getLogger(__name__)

TICK_S: Final = 0.1
CAMERA_KEPT_S: Final = 3.0
"""After the last stream ended, so that a viewer who switches streams need not wait for the camera."""
CAMERA_REQUEST: Final = PictureRequest(
    max(limits.width for limits in LIMITS.values()),
    max(limits.height for limits in LIMITS.values()),
    max(limits.rate_hz for limits in LIMITS.values()),
)
"""Requested whatever is watched first, so that a later stream need not reopen the camera under the others."""
HANGS_S: Final = 5.0
"""An encoder that takes this long for one picture hangs."""
SAID_AFTER_S: Final = 0.7
"""Viewers are informed after this time without a picture from the encoders."""
HANGING_WORDS: Final = "The drone's video encoder does not answer."
CODEC_SEARCH_TIMEOUT_S: Final = 30.0
"""For hardware encoders, on a small computer that has just started."""
HUNG_CODE: Final = 3
BROKEN_PAUSE_S: Final = 1.0
SUMMARY_S: Final = 60.0


class CameraThread(Protocol):
    """The required part of `sources.camera.Camera`."""

    @property
    def state(self) -> CameraState: ...
    @property
    def words(self) -> str: ...
    def start(self) -> None: ...
    def stop(self) -> bool: ...
    def newest(self) -> Picture | None: ...


@dataclass(frozen=True)
class Parts:
    """Dependencies of the process. `make_camera` takes the picture request and a callback, which the camera calls in
    its own thread on each picture and each change of state. `usable_codecs` may be slow."""

    make_camera: Callable[[PictureRequest, Callable[[], None]], CameraThread]
    make_encoder: MakeEncoder
    usable_codecs: Callable[[], tuple[Codec, ...]]


class VideoProcess:
    """Create it inside a running event loop; call `watched` on each change, and `run` it. `say` takes the reports."""

    def __init__(
        self,
        parts: Parts,
        tower: TowerUrl | None,
        uplinks: tuple[str, ...],
        say: Callable[[Report], None],
        link: Remembered | None = None,
    ) -> None:
        """Without `tower` nothing is sent. `link`: what the previous process had learnt of the link."""
        self._loop = asyncio.get_running_loop()
        self._parts = parts
        self._tower = tower
        self._uplinks = uplinks
        self._say = say
        self._streaming = Streaming(time.monotonic())
        self._memory = LinkMemory(link)
        self._workbench = StreamEncoders(parts.make_encoder, self._done_in_thread, self._broken_in_thread)
        self._worker: Executor = ThreadPoolExecutor(1, thread_name_prefix="encoders")
        self._busy_until: float | None = None
        """Deadline of the encoder thread's current work. None: it is idle."""
        self._encodes_since: float | None = None
        self._encoder_hangs = False
        self._watched = Watched()
        self._share: FrameWriter | None = None
        self._camera: CameraThread | None = None
        self._camera_waits = False
        """Waits until the previous camera is released: a device cannot be opened twice."""
        self._letting_go: asyncio.Future[bool] | None = None
        self._idle_since = time.monotonic()
        self._channel: VideoChannel | None = None
        self._channel_task: asyncio.Task[None] | None = None
        self._codecs: tuple[Codec, ...] = ()
        self._encoder_words = ""
        self._reported: Report | None = None
        self._report_due = 0.0
        self._summary_due = time.monotonic() + SUMMARY_S
        self._units = 0

    async def run(self) -> None:
        """Runs until cancelled."""
        self._report()
        self._work(CODEC_SEARCH_TIMEOUT_S, self._find_codecs)
        try:
            while True:
                await asyncio.sleep(TICK_S)
                self._tick(time.monotonic())
        finally:
            if self._channel_task is not None:
                self._channel_task.cancel()
            self._let_camera_go()

    # -- from the flight process -----------------------------------------------------------------------------------

    def watched(self, watched: Watched) -> None:
        """Sets what is watched."""
        now = time.monotonic()
        another_link = watched.ticket != self._watched.ticket
        if another_link or bool(watched.streams) != bool(self._watched.streams):
            self._close_channel()
        if another_link and self._watched.ticket:
            self._memory.forget()
        if watched.frames != self._watched.frames:
            self._share = _writer(watched.frames)
        self._watched = watched
        self._streaming.watch(watched.streams, now)
        self._worker.submit(self._workbench.keep, watched.streams)
        if not watched.streams and not watched.frames:
            self._idle_since = now
            return
        self._open_camera()
        if not watched.streams:
            return
        if self._channel is None and self._tower is not None:
            self._channel = VideoChannel(
                parse_tower_url(watched.tower) if watched.tower else self._tower,
                self._uplinks,
                watched.ticket,
                self._streaming.rate,
                self._memory,
                opened=self._streaming.restart,
                key_wanted=self._key_wanted,
            )
            self._channel_task = asyncio.create_task(self._channel.run(), name="video channel")

    def _close_channel(self) -> None:
        if self._channel_task is not None:
            self._channel_task.cancel()
        self._channel = self._channel_task = None

    def _key_wanted(self, request: StreamRequest) -> None:
        self._streaming.key_wanted(request, time.monotonic())

    # -- the camera ------------------------------------------------------------------------------------------------

    def _open_camera(self) -> None:
        if self._camera is not None:
            return
        self._camera = self._parts.make_camera(CAMERA_REQUEST, self._news_in_thread)
        self._camera_waits = self._letting_go is not None
        if not self._camera_waits:
            self._camera.start()

    @property
    def _in_use(self) -> bool:
        return bool(self._watched.streams or self._watched.frames)

    def _let_camera_go(self) -> None:
        camera, self._camera = self._camera, None
        if camera is not None and not self._camera_waits:
            self._letting_go = self._loop.run_in_executor(None, camera.stop)
            self._letting_go.add_done_callback(self._let_go)
        self._camera_waits = False

    def _let_go(self, done: "asyncio.Future[bool]") -> None:
        self._letting_go = None
        if not done.cancelled() and not done.result():
            _log.error("video: the camera cannot be let go; the process ends")
            os._exit(HUNG_CODE)
        if self._camera is not None and self._camera_waits:
            self._camera_waits = False
            self._camera.start()

    def _news_in_thread(self) -> None:
        self._loop.call_soon_threadsafe(self._news)

    def _news(self) -> None:
        """Handles a new picture, or a change of the camera's state."""
        self._report_changes()
        camera, channel = self._camera, self._channel
        if camera is None or self._busy_until is not None:
            return  # the newest picture will still be available when the encoders are ready
        picture = camera.newest()
        if picture is None:
            return
        orders = []
        if channel is not None and channel.is_open:
            orders = self._streaming.orders(picture.capture_us, time.monotonic(), is_break=picture.is_break)
        if orders:
            self._encodes_since = time.monotonic()
        if orders or self._share is not None:
            self._work(HANGS_S, self._use, picture, orders, self._share)

    def _use(self, picture: Picture, orders: list[Order], share: FrameWriter | None) -> None:
        """In the encoders' thread. A controller gets its picture first: it flies by it."""
        if share is not None:
            share.write(picture)
        if orders:
            self._workbench.encode(picture, orders)

    # -- the encoders ----------------------------------------------------------------------------------------------

    def _work(self, within_s: float, prepare: Callable[..., None], *arguments: object) -> None:
        self._busy_until = time.monotonic() + within_s
        self._loop.run_in_executor(self._worker, prepare, *arguments).add_done_callback(self._worked)

    def _worked(self, done: "asyncio.Future[None]") -> None:
        self._busy_until = self._encodes_since = None
        self._encoder_hangs = False
        if not done.cancelled():
            done.result()
        self._news()

    def _find_codecs(self) -> None:
        codecs = self._parts.usable_codecs()
        self._loop.call_soon_threadsafe(self._codecs_found, codecs)

    def _codecs_found(self, codecs: tuple[Codec, ...]) -> None:
        self._codecs = codecs
        self._report_changes()

    def _done_in_thread(self, order: Order, encoded: Encoded) -> None:
        self._loop.call_soon_threadsafe(self._encoded, order, encoded)

    def _encoded(self, order: Order, encoded: Encoded) -> None:
        self._encoder_words = ""
        if self._channel is None or not self._channel.is_open:
            return  # the next connection begins with a key picture
        departure = self._streaming.unit(order, encoded, time.monotonic())
        if departure is not None:
            self._units += 1
            self._channel.send(departure)

    def _broken_in_thread(self, order: Order, words: str) -> None:
        self._loop.call_soon_threadsafe(self._broken, order, words)

    def _broken(self, order: Order, words: str) -> None:
        _log.error("video: the encoder of %s has failed: %s", order.request, words)
        self._encoder_words = f"The drone's video encoder has failed: {words}"
        self._streaming.rest(order.request, time.monotonic() + BROKEN_PAUSE_S)

    # -- time ------------------------------------------------------------------------------------------------------

    def _tick(self, now: float) -> None:
        if self._busy_until is not None and now > self._busy_until:
            _log.error("video: an encoder hangs; the process ends")
            os._exit(HUNG_CODE)
        self._encoder_hangs = self._encodes_since is not None and now - self._encodes_since > SAID_AFTER_S
        self._streaming.tick(now)
        if self._channel is not None:
            self._channel.tick()
        if self._camera is not None and not self._in_use and now - self._idle_since > CAMERA_KEPT_S:
            self._let_camera_go()
        self._report_changes()
        if now >= self._report_due:
            self._report()
        if now >= self._summary_due:
            self._summarise(now)

    def _summarise(self, now: float) -> None:
        self._summary_due = now + SUMMARY_S
        if self._units:
            _log.info(
                "video: %d units in the last minute, %d pictures left out; %.0f kbit/s of %.0f",
                self._units,
                self._streaming.left_out,
                self._streaming.rate.budget_bps / 1000,
                self._streaming.rate.pacing_bps / 1000,
            )
        self._units = self._streaming.left_out = 0

    # -- reports ---------------------------------------------------------------------------------------------------

    def _state(self) -> Report:
        camera = self._camera
        if camera is None:
            return Report(camera=CameraState.IDLE, codecs=self._codecs)
        if self._encoder_hangs and camera.state is CameraState.LIVE:
            return Report(camera=CameraState.LOST, words=HANGING_WORDS, codecs=self._codecs)
        words = camera.words or self._encoder_words or (self._channel.words if self._channel is not None else "")
        return Report(camera=camera.state, words=words[:200], thin=self._streaming.thin, codecs=self._codecs)

    def _report_changes(self) -> None:
        if self._state() != self._reported:
            self._report()

    def _report(self) -> None:
        self._reported = self._state()
        self._report_due = time.monotonic() + REPORT_EVERY_S
        self._say(msgspec.structs.replace(self._reported, link=self._memory.remembered))


def _writer(path: str) -> FrameWriter | None:
    if not path:
        return None
    try:
        return FrameWriter(path)
    except (OSError, ValueError) as error:
        _log.error("video: no pictures for a controller: %s", error)
        return None
