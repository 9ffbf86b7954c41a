"""Videos with a burnt-in flight display: made on request in a process of their own, one at a time, kept for an hour.

`root` is a cache: whatever an earlier tower left there is removed at the start. No row of the database knows a file.
"""

from __future__ import annotations

import asyncio
import os
import secrets
import shutil
import sys
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import structlog

from server.flights.core.videos.refusals import FlightVideoNotMade, FlightVideosBusy
from server.flights.core.videos.views import DisplayVideoView
from server.kernel.people import Principal
from server.storage.file_budget import disk_takes
from wire.ids import UserId

KEPT_S: Final = 3_600.0
MAX_VIDEOS: Final = 10
"""Waiting, being made, and kept; the oldest that is ready makes room."""
MAX_DURATION_S: Final = 6 * 3_600.0
MAX_BYTES: Final = 4_000_000_000
SPARE_BYTES: Final = 16_000_000
"""What a drawn-on video may have beyond twice its recording."""
_ROOT: Final = Path(__file__).resolve().parents[4]
_MAX_LINE_BYTES: Final = 4_096
_log = structlog.get_logger(__name__)

Key = tuple[int, int]
"""Flight and recording."""
State = Literal["waiting", "making", "ready", "failed"]


@dataclass(frozen=True)
class Sources:
    """`began_us`: when the first picture of the recording was taken. `pictures`: how many it has."""

    recording: Path
    telemetry: Path
    index: Path
    began_us: int
    pictures: int


@dataclass
class _Video:
    by: UserId
    path: Path
    pictures: int
    state: State = "waiting"
    done: int = 0
    words: str = ""
    size_bytes: int = 0
    task: asyncio.Task[None] | None = field(default=None, repr=False)

    @property
    def is_open(self) -> bool:
        return self.state in ("waiting", "making")


class FlightVideos:
    """One instance per tower. `root`: need not exist yet. `kept_s`: how long a finished video is kept."""

    def __init__(self, root: Path, *, kept_s: float = KEPT_S) -> None:
        self._root = root
        self._kept_s = kept_s
        self._videos: dict[Key, _Video] = {}
        """Oldest first."""
        self._making = asyncio.Semaphore(1)

    async def sweep(self) -> None:
        """At the start."""
        await asyncio.to_thread(shutil.rmtree, self._root, ignore_errors=True)

    async def close(self) -> None:
        """Ends what is being made, and removes all files."""
        for key in list(self._videos):
            await self._drop(key)

    def view(self, key: Key) -> DisplayVideoView:
        """Raises FlightVideoNotMade."""
        return _view(key, self._get(key))

    def path(self, key: Key) -> Path:
        """Of a video that is ready. Raises FlightVideoNotMade."""
        video = self._get(key)
        if video.state != "ready":
            raise FlightVideoNotMade
        return video.path

    async def begin(self, key: Key, sources: Sources, by: Principal) -> DisplayVideoView:
        """Repeated: the video that there is; one that failed is made again. Raises FlightVideosBusy."""
        known = self._videos.get(key)
        if known is not None and known.state != "failed":
            return _view(key, known)
        if any(one.is_open and one.by == by.user_id for one in self._videos.values()):
            raise FlightVideosBusy("another video is being made for you: wait until it is ready")
        self._make_room(key)
        # Registered before anything is awaited: a second request finds it.
        video = self._videos[key] = _Video(by.user_id, self._root / f"{secrets.token_hex(8)}.mp4", sources.pictures)
        video.task = asyncio.create_task(self._work(key, video, sources), name="flight video")
        return _view(key, video)

    def _make_room(self, key: Key) -> None:
        """Ends the one that failed, or the oldest one that is over where there are too many."""
        gone: Key | None = key
        if key not in self._videos and len(self._videos) >= MAX_VIDEOS:
            gone = next((other for other, one in self._videos.items() if not one.is_open), None)
            if gone is None:
                raise FlightVideosBusy("too many videos are being made: try again later")
        video = self._videos.pop(gone, None) if gone is not None else None
        if video is not None and video.task is not None:
            video.task.cancel()  # it removes its file

    def _get(self, key: Key) -> _Video:
        video = self._videos.get(key)
        if video is None:
            raise FlightVideoNotMade
        return video

    async def _drop(self, key: Key) -> None:
        video = self._videos.pop(key, None)
        if video is not None and video.task is not None:
            video.task.cancel()
            with suppress(asyncio.CancelledError):
                await video.task

    async def _work(self, key: Key, video: _Video, sources: Sources) -> None:
        """Makes it, keeps it for its time, and removes it."""
        try:
            async with self._making:
                video.state = "making"
                await self._make(video, sources)
            _log.info("flight_video", flight=key[0], recording=key[1], state=video.state, why=video.words)
            await asyncio.sleep(self._kept_s)
        finally:
            if self._videos.get(key) is video:
                del self._videos[key]
            with suppress(OSError):
                video.path.unlink(missing_ok=True)

    async def _make(self, video: _Video, sources: Sources) -> None:
        try:
            max_bytes = await asyncio.to_thread(_prepare, self._root, sources)
            async with asyncio.timeout(MAX_DURATION_S):
                answer = await _run(video, sources, max_bytes)
        except TimeoutError:
            answer = {"problem": "it took too long"}
        except OSError as error:
            answer = {"problem": error.strerror or type(error).__name__}
        if "size_bytes" in answer:
            video.state, video.done, video.size_bytes = "ready", video.pictures, int(answer["size_bytes"])
            return
        video.state, video.words = "failed", str(answer.get("problem") or "it took too much time or memory")[:200]
        with suppress(OSError):
            await asyncio.to_thread(video.path.unlink, missing_ok=True)


def _prepare(root: Path, sources: Sources) -> int:
    """Returns how large the video may become. Raises OSError."""
    max_bytes = min(MAX_BYTES, 2 * sources.recording.stat().st_size + SPARE_BYTES)
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not disk_takes(root, max_bytes):
        raise OSError(0, "the tower's disk has no room for it")
    return max_bytes


async def _run(video: _Video, sources: Sources, max_bytes: int) -> dict[str, Any]:
    """Returns the last answer of the process; empty if it had none."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "server.flights.store.videos.make_display_video"),
        *(str(sources.recording), str(sources.telemetry), str(sources.index), str(sources.began_us)),
        *(str(video.path), str(max_bytes)),
        stdin=asyncio.subprocess.PIPE,  # its end tells the process that the tower is gone
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        cwd=_ROOT,
        env={"PATH": os.defpath, "LANG": "C.UTF-8"},
        limit=_MAX_LINE_BYTES,
    )
    assert process.stdout is not None
    answer: dict[str, Any] = {}
    try:
        while line := await process.stdout.readline():
            answer = msgspec.json.decode(line, type=dict[str, Any])
            if "done" in answer:
                video.done = min(int(answer["done"]), video.pictures)
        return answer if await process.wait() in (0, 1) else {}
    except ValueError:  # a line that is too long, or no JSON
        return {}
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        await process.wait()


def _view(key: Key, video: _Video) -> DisplayVideoView:
    return DisplayVideoView(
        flight_id=key[0],
        recording_id=key[1],
        state=video.state,
        done=1.0 if video.state == "ready" else round(video.done / max(1, video.pictures), 3),
        words=video.words,
        size_bytes=video.size_bytes,
    )
