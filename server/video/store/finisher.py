"""Creates the files of ended recordings, one after another, and at start those that an earlier tower left. A separate
low-priority process creates each MP4."""

from __future__ import annotations

import asyncio
import os
import sys
from collections import deque
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import msgspec
import structlog

from server.storage.database import Database
from server.video.core.recordings.notifier import RecordingNotifier
from server.video.store import catalogue
from server.video.store.catalogue import Finished
from server.video.store.quota import RecordingQuota
from server.video.store.store import MP4, PART, UNITS, RecordingStore
from server.video.store.tables import RecordingRow

SILENCE_S: Final = 180.0
"""A process that reports nothing for this long hangs. It reports once a second if it gets any processor time."""
MAX_DURATION_S: Final = 6 * 3600.0
"""Limit for one file, because the others wait for it. Two hours at the highest quality take a small computer less than
two; data that no camera produces could keep it busy for days."""
HOPELESS: Final = 2
"""Exit code if a retry would not help: there was no picture."""
_ROOT: Final = Path(__file__).resolve().parents[3]
_MAX_TEXT_LENGTH: Final = 150


class CannotFinish(Exception):
    """The message is for people. `hopeless`: a retry would not help."""

    def __init__(self, words: str, *, hopeless: bool = False) -> None:
        super().__init__(words)
        self.words = words
        self.hopeless = hopeless


async def make_mp4(source: Path, target: Path) -> Finished:
    """Writes `target`; removes it on failure. Raises CannotFinish, OSError."""
    # Without the tower's environment: the process reads data from a drone, and must not see the tower's secrets.
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "server.video.store.make_mp4", str(source), str(target)),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        cwd=_ROOT,
        env={"PATH": os.defpath, "LANG": "C.UTF-8"},
    )
    assert process.stdout is not None
    last: dict[str, Any] = {}
    done = False
    try:
        async with asyncio.timeout(MAX_DURATION_S) as whole:
            while True:
                async with asyncio.timeout(SILENCE_S):
                    line = await process.stdout.readline()
                if not line:
                    break
                last = msgspec.json.decode(line, type=dict[str, Any])
            async with asyncio.timeout(SILENCE_S):
                code = await process.wait()
        if code != 0:
            words = str(last.get("problem", "")) or f"the program that makes the file ended with {code}"
            raise CannotFinish(words[:_MAX_TEXT_LENGTH], hopeless=code == HOPELESS)
        sizes = last["width"], last["height"], last["pictures"]
        finished = Finished(last["duration_s"], *sizes, last["first_lag_s"])
        done = True
        return finished
    except TimeoutError:
        raise CannotFinish(
            f"the program that makes the file {'takes too long' if whole.expired() else 'hangs'}"
        ) from None
    except (msgspec.DecodeError, KeyError, ValueError):
        raise CannotFinish("the program that makes the file gave no readable result") from None
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        if not done:
            await asyncio.to_thread(target.unlink, missing_ok=True)


CUT_OFF: Final = "the tower stopped during the recording"
GONE: Final = "its file is gone"
NO_ROOM: Final = "there is no room to make its file; it is tried again when the tower starts"
_log = structlog.get_logger(__name__)

MakeMp4 = Callable[[Path, Path], Awaitable[Finished]]


class RecordingFinisher:
    """`work` runs in the background. One file at a time, because flights come first."""

    def __init__(
        self,
        *,
        database: Database,
        store: RecordingStore,
        quota: RecordingQuota,
        notifier: RecordingNotifier,
        make: MakeMp4 = make_mp4,
    ) -> None:
        self._database = database
        self._store = store
        self._quota = quota
        self._notifier = notifier
        self._make = make
        self._waiting: deque[int] = deque()
        self._something = asyncio.Event()

    def add(self, recording_id: int) -> None:
        """The recording has ended."""
        self._waiting.append(recording_id)
        self._something.set()

    @property
    def waiting(self) -> int:
        """The number of recordings to finish, including the current one."""
        return len(self._waiting)

    async def recover(self, deleted: Iterable[int]) -> None:
        """At start, before anything is recorded: resumes unfinished recordings. `deleted`: drones whose files are
        removed."""
        try:
            await asyncio.to_thread(self._store.open)
        except OSError as error:
            # Flights continue without recordings. Existing recordings are left as they are.
            _log.error("recordings_cannot_be_kept", why=str(error))
            return
        await asyncio.to_thread(self._store.remove_drones, deleted)
        async with self._database.reading() as session:
            rows = await catalogue.all_of_store(session, self._store.id)
        for row in rows:
            await self._take_up(row)
        self._quota.strays = await asyncio.to_thread(self._store.sweep, {row.file for row in rows})
        if self._quota.strays:
            _log.warning(
                "recordings_not_in_the_database",
                files=len(self._quota.strays),
                size_bytes=self._quota.stray_bytes(),
                hint="kept until the room is needed; they come back with the database that knows them",
            )

    async def _take_up(self, row: RecordingRow) -> None:
        units = self._store.path(row.drone_id, row.file, UNITS)
        file_stat = await asyncio.to_thread(_size_and_time, units)
        if row.state == "ready" and await asyncio.to_thread(self._store.path(row.drone_id, row.file, MP4).is_file):
            await asyncio.to_thread(units.unlink, missing_ok=True)
            return
        if file_stat is None and row.state == "failed":
            return
        async with self._database.writing() as session:
            if file_stat is None:
                await catalogue.mark_failed(session, row.id, GONE, size_bytes=0)
                return
            found = await session.get(RecordingRow, row.id)
            if found is None:
                return
            if found.state == "recording":
                found.words, found.ended_at = CUT_OFF, max(found.began_at, file_stat[1])
            elif found.state == "failed":
                found.words = ""
            found.state, found.size_bytes = "finishing", file_stat[0]
        self.add(row.id)

    async def work(self) -> None:
        """Runs until cancelled. Retries after errors of the database."""
        while True:
            while self._waiting:
                await self._finish(self._waiting[0])
                self._waiting.popleft()
            self._something.clear()
            await self._something.wait()

    async def _finish(self, recording_id: int) -> None:
        async with self._database.reading() as session:
            row = await session.get(RecordingRow, recording_id)
        if row is None or row.state != "finishing":
            return
        units = self._store.path(row.drone_id, row.file, UNITS)
        target = self._store.path(row.drone_id, row.file, MP4)
        part = target.with_name(target.name + PART)
        try:
            # The units file is counted already; its MP4 is not larger.
            if not await self._quota.make_space(row.size_bytes, row.drone_id):
                raise CannotFinish(NO_ROOM)
            finished = await self._make(units, part)
            await asyncio.to_thread(part.replace, target)
            size_bytes = (await asyncio.to_thread(target.stat)).st_size
        except (CannotFinish, OSError) as error:
            hopeless = isinstance(error, CannotFinish) and error.hopeless
            await self._fail(row, str(error), units, hopeless=hopeless)
            return
        async with self._database.writing() as session:
            ready = await catalogue.mark_ready(session, row.id, finished, size_bytes=size_bytes)
        if ready is None:  # its drone was deleted meanwhile
            await asyncio.to_thread(self._store.remove, row.drone_id, row.file)
            return
        await asyncio.to_thread(units.unlink, missing_ok=True)
        self._notifier.publish("ready", catalogue.view_of(ready))

    async def _fail(self, row: RecordingRow, words: str, units: Path, *, hopeless: bool) -> None:
        _log.error("recording_failed", recording=row.id, drone_id=row.drone_id, why=words)
        file_stat = None if hopeless else await asyncio.to_thread(_size_and_time, units)
        async with self._database.writing() as session:
            failed = await catalogue.mark_failed(session, row.id, words, size_bytes=file_stat[0] if file_stat else 0)
        if hopeless or failed is None:
            await asyncio.to_thread(self._store.remove, row.drone_id, row.file)
        if failed is not None:
            self._notifier.publish("failed", catalogue.view_of(failed))


def _size_and_time(path: Path) -> tuple[int, datetime] | None:
    """Returns size in bytes and time of the last write. None if there is no such file."""
    try:
        file_stat = path.stat()
    except FileNotFoundError:
        return None
    return file_stat.st_size, datetime.fromtimestamp(file_stat.st_mtime, UTC)
