"""Imported flights: `flight-imports/user-<id>/<id>.tlog` and, beside it, what is known of it, `<id>.json`.

No row of the database knows them: they are of no drone, and the folder has everything. A file that is being received or
converted ends with `.part`; the start of the tower removes what is left of those.
"""

from __future__ import annotations

import asyncio
import os
import re
import secrets
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Final

import structlog
from pydantic import ValidationError
from sqlalchemy import select

from server.accounts.store.tables import UserRow
from server.flights.core.imports.converted import Converted
from server.flights.core.imports.refusals import BadFlightFile, ImportsFull, UnknownImport
from server.flights.core.imports.views import ClockJumpView, ImportedFlightView, UploaderView
from server.flights.store.imports.converting import run_converter
from server.kernel.clock import Clock
from server.kernel.people import UserRef
from server.kernel.shares import ShareName, Shares
from server.runtime.settings import Settings
from server.storage.database import Database, DatabaseUnavailable
from server.storage.file_budget import disk_takes
from wire.ids import UserId

_MB: Final = 1_000_000
PIECE_WITHIN_S: Final = 30.0
MAX_NAME: Final = 100
TLOG, ABOUT, PART = ".tlog", ".json", ".part"
_USER: Final = re.compile(r"user-(\d{1,10})")
_log = structlog.get_logger(__name__)

Convert = Callable[[Path, Path, int], Awaitable[Converted]]
"""Source, target, and the time of the upload in microseconds since 1970."""


class FlightImports:
    """`root`: need not exist yet. `budget_bytes`: for the telemetry logs of one person."""

    def __init__(
        self,
        root: Path,
        clock: Clock,
        *,
        budget_bytes: int,
        largest_bytes: int,
        convert: Convert = run_converter,
        shares: Shares | None = None,
    ) -> None:
        self._shares = shares or Shares()
        self._root = root
        self._clock = clock
        self._budget_bytes = budget_bytes
        self._largest_bytes = largest_bytes
        self._convert = convert
        self._converting = asyncio.Semaphore(1)
        self._uploading: set[UserId] = set()

    async def listed(self, user_id: UserId | None) -> list[ImportedFlightView]:
        """Newest upload first. None: of everybody."""
        found = await asyncio.to_thread(self._read_all, user_id)
        return sorted(found, key=lambda one: one.uploaded_at, reverse=True)

    async def count_by_person(self) -> dict[UserId, int]:
        """How many flights each person has imported."""
        return await asyncio.to_thread(
            lambda: {user_id: sum(1 for _ in folder.glob(f"*{ABOUT}")) for user_id, folder in self._people()}
        )

    async def get(self, import_id: str) -> ImportedFlightView:
        """Raises UnknownImport."""
        found = await asyncio.to_thread(lambda: next(map(_read, self._root.glob(f"user-*/{import_id}{ABOUT}")), None))
        if found is None:
            raise UnknownImport
        return found

    def path(self, view: ImportedFlightView) -> Path:
        """Of the telemetry log."""
        return self._folder(UserId(view.by.id)) / f"{view.id}{TLOG}"

    async def delete(self, view: ImportedFlightView) -> None:
        path = self.path(view)
        await asyncio.to_thread(path.with_suffix(ABOUT).unlink, missing_ok=True)
        await asyncio.to_thread(path.unlink, missing_ok=True)

    async def add(self, by: UserRef, name: str, length: str, pieces: AsyncIterator[bytes]) -> ImportedFlightView:
        """Receives, converts and keeps a file of `length` bytes. Raises BadFlightFile, ImportsFull; then nothing is
        kept."""
        if not (length.isascii() and length.isdigit() and len(length) < 16):
            raise BadFlightFile("the file's length is required: send Content-Length")
        if int(length) > self._largest_bytes:
            raise BadFlightFile(f"the file is larger than {self._largest_bytes // _MB} MB")
        if by.id in self._uploading:
            raise ImportsFull("another file of yours is being imported: wait until it is done")
        self._uploading.add(by.id)
        try:
            return await self._add(by, name, int(length), pieces)
        except OSError as error:
            _log.error("flight_not_imported", why=str(error))
            raise BadFlightFile(f"the file cannot be stored ({error.strerror})") from None
        finally:
            self._uploading.discard(by.id)

    async def _add(self, by: UserRef, name: str, length: int, pieces: AsyncIterator[bytes]) -> ImportedFlightView:
        there = await asyncio.to_thread(self._read_all, by.id)
        used_bytes = sum(one.size_bytes for one in there)
        if len(there) >= self._shares.limit(ShareName.IMPORTS) or used_bytes >= self._budget_bytes:
            raise ImportsFull("you have no room for another flight: delete one of yours")
        import_id, folder = secrets.token_hex(8), self._folder(by.id)
        source, target = folder / f"{import_id}.upload{PART}", folder / f"{import_id}{TLOG}{PART}"
        uploaded_at = self._clock()
        try:
            file = await asyncio.to_thread(_open, source, length)
            try:
                await _receive(file, pieces, length)
            finally:
                await asyncio.to_thread(file.close)
            async with self._converting:
                found = await self._convert(source, target, round(uploaded_at.timestamp() * 1e6))
            if used_bytes + found.size_bytes > self._budget_bytes:
                raise ImportsFull("you have no room for this flight: delete one of yours")
            view = _view(import_id, by, name, uploaded_at, found)
            await asyncio.to_thread(_keep, target, folder, view)
        finally:
            for part in (source, target):
                with suppress(OSError):
                    await asyncio.to_thread(part.unlink, missing_ok=True)
        _log.info("flight_imported", user_id=by.id, format=found.format, frames=found.frames)
        return view

    async def sweep(self, database: Database) -> None:
        """At the start: removes what deleted people left, and files that never became whole. A folder that cannot be
        read, or a database that is away, stops no tower."""
        try:
            there = await asyncio.to_thread(lambda: {user_id for user_id, _ in self._people()})
            async with database.reading() as session:
                known = set(await session.scalars(select(UserRow.id).where(UserRow.id.in_(there))))
            await asyncio.to_thread(self._remove, there - known)
        except (OSError, DatabaseUnavailable) as error:
            _log.error("flight_imports_not_swept", why=str(error))

    def _remove(self, user_ids: Iterable[int]) -> None:
        for user_id in user_ids:
            shutil.rmtree(self._folder(UserId(user_id)), ignore_errors=True)
        for part in self._root.glob(f"user-*/*{PART}"):
            part.unlink(missing_ok=True)

    def _people(self) -> list[tuple[UserId, Path]]:
        if not self._root.is_dir():
            return []
        found = [(_USER.fullmatch(folder.name), folder) for folder in self._root.iterdir()]
        return [(UserId(int(match[1])), folder) for match, folder in found if match]

    def _folder(self, user_id: UserId) -> Path:
        return self._root / f"user-{user_id}"

    def _read_all(self, user_id: UserId | None) -> list[ImportedFlightView]:
        folders = [folder for one, folder in self._people() if user_id is None or one == user_id]
        views = (_read(path) for folder in folders for path in folder.glob(f"*{ABOUT}"))
        return [view for view in views if view is not None]


def _view(import_id: str, by: UserRef, name: str, at: datetime, found: Converted) -> ImportedFlightView:
    began, ended = _at(found.began_us), _at(found.ended_us)
    return ImportedFlightView(
        id=import_id,
        name=(name.strip() or found.format)[:MAX_NAME],
        format=found.format,
        by=UploaderView(id=by.id, name=by.name),
        uploaded_at=at,
        began_at=began,
        ended_at=ended,
        clock_known=found.clock_known,
        duration_s=(ended - began).total_seconds(),
        clock_jumps=[ClockJumpView(at=_at(one.at_us), by_s=one.by_s) for one in found.clock_jumps],
        distance_m=found.distance_m,
        max_height_m=found.max_height_m,
        track=found.track,
        frames=found.frames,
        skipped_bytes=found.skipped_bytes,
        size_bytes=found.size_bytes,
    )


def _at(at_us: int) -> datetime:
    return datetime.fromtimestamp(at_us / 1e6, UTC)


def _read(path: Path) -> ImportedFlightView | None:
    try:
        return ImportedFlightView.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None


def _open(path: Path, length: int) -> IO[bytes]:
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not disk_takes(path.parent, 2 * length):
        raise ImportsFull("the tower's disk has no room for this file")
    return open(path, "xb", opener=lambda name, flags: os.open(name, flags, 0o600))


async def _receive(file: IO[bytes], pieces: AsyncIterator[bytes], expected: int) -> None:
    taken = 0
    while True:
        try:
            async with asyncio.timeout(PIECE_WITHIN_S):
                piece = await anext(pieces, None)
        except TimeoutError:
            raise BadFlightFile("the file came too slowly") from None
        if piece is None:
            break
        taken += len(piece)
        if taken > expected:
            raise BadFlightFile("the file is longer than was said")
        await asyncio.to_thread(file.write, piece)
    if taken != expected:
        raise BadFlightFile("the file is not whole")


def _keep(target: Path, folder: Path, view: ImportedFlightView) -> None:
    """The telemetry log first: what is listed can be replayed."""
    about = folder / f"{view.id}{ABOUT}"
    part = about.with_name(about.name + PART)
    target.replace(folder / f"{view.id}{TLOG}")
    part.write_text(view.model_dump_json())
    part.replace(about)


def new_flight_imports(settings: Settings, clock: Clock, shares: Shares) -> FlightImports:
    return FlightImports(
        settings.files / "flight-imports",
        clock,
        budget_bytes=settings.flight_imports_budget_mb * _MB,
        largest_bytes=settings.flight_import_largest_mb * _MB,
        shares=shares,
    )
