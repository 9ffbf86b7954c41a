"""Carries recorded flights into the database: begun ones, those that are over, and those that a crash left behind.

The files come first: a flight is recorded while the database is away, and gets its row when it is back. A flight whose
row is missing altogether (the tower ended before it was written) is found by its files at the next start.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from typing import Final

import structlog
from sqlalchemy import select

from server.audit.store.action import AuditAction
from server.fleet.store.tables import DroneRow
from server.flights.core.index import NoIndex, Pilot, head_line, read_index
from server.flights.core.recorder import FlightHead, FlightSink
from server.flights.store import catalogue
from server.flights.store.catalogue import FAILED, RUNNING
from server.flights.store.figures import keep_figures, without_figures
from server.flights.store.files import INDEX, TLOG, FlightFacts, FlightFiles, FoundFlight
from server.flights.store.quota import FlightQuota
from server.flights.store.tables import FlightRow
from server.flights.store.writer import FULL, FlightFile, FlightWriter
from server.kernel.clock import Clock
from server.storage.database import Database, DatabaseSession, DatabaseUnavailable
from server.storage.file_budget import MIN_FREE_BYTES

LOOK_EVERY_S: Final = 0.5
TIDY_EVERY_S: Final = 10.0
INSERTED_AT_ONCE: Final = 50
"""Flights that begin together get their rows in one transaction."""
TRY_AGAIN_AFTER_S: Final = 30.0
"""After a disk that could not be written: no flight begins before."""
CRASHED: Final = "the tower ended while it was recorded"
UNREADABLE: Final = "the files of the flight cannot be read"
NO_SHARE: Final = "the space for flights of this drone's owner is used up"
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class _Due:
    """A flight whose files are to be closed. `lost_frames`: as far as is known. `words`: why it ended; None: the index
    says so, unless the tower crashed. A disk that is full has no room for the reason either."""

    drone_id: int
    file: str
    lost_frames: int = 0
    words: str | None = None


class FlightService:
    """One for a tower. `begin` is for the recorder; `work` runs in the background."""

    def __init__(
        self,
        *,
        database: Database,
        clock: Clock,
        files: FlightFiles,
        writer: FlightWriter,
        quota: FlightQuota,
        largest_bytes: int,
    ) -> None:
        self._database = database
        self._clock = clock
        self._files = files
        self._writer = writer
        self._quota = quota
        self._largest_bytes = largest_bytes
        self._running: dict[str, FlightFile] = {}
        self._new: deque[tuple[FlightHead, str]] = deque()
        """Without a row."""
        self._due: deque[_Due] = deque()
        self._disk_full = False
        self._probe_at: float | None = None
        self._tidy_at = float("-inf")
        self._dirty = True
        self._figured_out: int | None = 0
        """Flights up to this id have their figures; None: all have."""
        self._waits = False
        """Database or disk cannot be reached, and the log says so."""

    def begin(self, head: FlightHead) -> FlightSink | None:
        """Returns at once; None where nothing can be recorded now."""
        if self.failing:
            return None
        name = secrets.token_hex(8)
        file = FlightFile(
            self._writer,
            drone_id=head.drone_id,
            file=name,
            tlog=self._files.path(head.drone_id, name, TLOG),
            index=self._files.path(head.drone_id, name, INDEX),
            largest_bytes=self._largest_bytes,
        )
        file.event(head_line(head))
        self._running[name] = file
        self._new.append((head, name))
        return file

    @property
    def failing(self) -> bool:
        """Whether flights are not recorded because of the disk."""
        return self._writer.failing or self._disk_full or not self._files.id

    def running_bytes(self) -> int:
        return sum(one.bytes_written + one.index_bytes for one in self._running.values())

    async def recover(self) -> None:
        """Finds what an earlier tower left. Call it before `work`, when no flight is being recorded. Raises OSError."""
        async with self._database.reading() as session:
            known = await catalogue.files_of_store(session, self._files.id)
        for file, (drone_id, state) in known.items():
            if state in (RUNNING, FAILED):  # a disk that could not be read then
                self._due.append(_Due(drone_id, file))
        for found in await asyncio.to_thread(self._files.unknown, known):
            if await self._adopt(found):
                self._due.append(_Due(found.drone_id, found.file))
            else:
                self._quota.strays.append(found)

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            try:
                await self._step()
                self._waits = False
            except (DatabaseUnavailable, OSError) as error:
                if not self._waits:
                    _log.warning("flights_wait", error=type(error).__name__)
                self._waits = True
            await asyncio.sleep(LOOK_EVERY_S)

    async def _step(self) -> None:
        await self._probe()
        for file in list(self._running.values()):
            if file.closed:
                del self._running[file.file]
                self._due.append(_Due(file.drone_id, file.file, file.frames_lost, file.words))
        while self._new:
            batch = list(islice(self._new, INSERTED_AT_ONCE))
            await self._insert(batch)
            for _ in batch:
                self._new.popleft()
        while self._due:
            await self._finish(self._due[0])
            self._due.popleft()
            self._dirty = True
        if not self._running:
            await self._figure_out_one()
        if time.monotonic() >= self._tidy_at and (self._running or self._dirty):
            self._tidy_at = time.monotonic() + TIDY_EVERY_S
            await self._tidy()
            self._dirty = False

    async def _probe(self) -> None:
        """After a disk that could not be written: looks now and then whether it can."""
        now = time.monotonic()
        if not self._writer.failing:
            self._probe_at = None
        elif self._probe_at is None:
            self._probe_at = now + TRY_AGAIN_AFTER_S
        elif now >= self._probe_at:
            self._probe_at = None
            if await asyncio.to_thread(self._writer.probe, self._files.root):
                _log.info("flights_recorded_again")

    async def _tidy(self) -> None:
        """Sees to it that the disk keeps its free part, and the flights their budget."""
        was_full, self._disk_full = self._disk_full, not await asyncio.to_thread(self._files.has_room, 0)
        if self._disk_full:
            self._dirty = True  # looks again
            if not was_full:
                _log.error("flights_not_recorded", why=FULL, min_free_mb=MIN_FREE_BYTES // 1_000_000)
        used: dict[int, int] = {}
        for file in self._running.values():
            used[file.drone_id] = used.get(file.drone_id, 0) + file.bytes_written + file.index_bytes
        over = await self._quota.make_space(used)
        for file in self._running.values():
            if self._disk_full:
                file.problem = file.problem or FULL
            elif file.drone_id in over:
                file.problem = file.problem or NO_SHARE

    async def _insert(self, new: Sequence[tuple[FlightHead, str]]) -> None:
        """Rows of flights that have begun, unless they have one or their drone was deleted meanwhile."""
        drones = select(DroneRow.id).where(DroneRow.id.in_([head.drone_id for head, _ in new]))
        files = select(FlightRow.file).where(FlightRow.file.in_([name for _, name in new]))
        async with self._database.writing() as session:
            there, known = set(await session.scalars(drones)), set(await session.scalars(files))
            for head, name in new:
                if head.drone_id not in there or name in known:
                    continue
                await catalogue.add(
                    session,
                    drone_id=head.drone_id,
                    store=self._files.id,
                    file=name,
                    began_at=head.began_at,
                    pilots=[] if head.pilot is None else [Pilot(head.pilot.id, head.pilot.name)],
                )

    async def _finish(self, due: _Due) -> None:
        """Closes the files and completes the row; makes it, if there is none yet."""
        facts: FlightFacts | None = None
        try:
            facts = await asyncio.to_thread(self._files.close_unfinished, due.drone_id, due.file)
        except (NoIndex, OSError) as error:
            _log.error("flight_unreadable", drone_id=due.drone_id, file=due.file, why=str(error))
        async with self._database.writing() as session:
            row = await self._row(session, due, facts)
            if row is None:
                is_known = False
            else:
                is_known = True
                if facts is None:
                    catalogue.fail(row, UNREADABLE, self._clock())
                else:
                    words = due.words
                    if words is None:
                        words = facts.index.words if facts.index.is_over else CRASHED
                    await catalogue.finish(session, row, facts, words=words, lost_frames=due.lost_frames)
        if not is_known:  # its drone was deleted meanwhile
            await asyncio.to_thread(self._files.remove, due.drone_id, due.file)
        elif facts is not None:
            about = {"drone_id": due.drone_id, "frames": facts.summary.frames, "torn_bytes": facts.torn_bytes}
            _log.info("flight_recorded", **about, lost_frames=due.lost_frames, whole=facts.index.is_over)

    async def _figure_out_one(self) -> None:
        """The figures of one flight that an older tower recorded, while no drone flies. Files that cannot be read are
        passed over until the next start."""
        if self._figured_out is None or not self._files.id:
            return
        async with self._database.reading() as session:
            row = await without_figures(session, self._files.id, above=self._figured_out)
        if row is None:
            self._figured_out = None
            return
        self._figured_out = row.id
        try:
            await self.figure_out(row)
        except (NoIndex, OSError) as error:
            _log.warning("flight_without_figures", flight=row.id, why=str(error))

    async def figure_out(self, row: FlightRow) -> None:
        """Computes and keeps the figures of a flight of this folder that is over. Raises OSError, NoIndex."""
        figures = await asyncio.to_thread(self._files.figures, row.drone_id, row.file)
        async with self._database.writing() as session:
            if await session.get(FlightRow, row.id) is not None:
                await keep_figures(session, flight_id=row.id, drone_id=row.drone_id, figures=figures)

    async def _row(self, session: DatabaseSession, due: _Due, facts: FlightFacts | None) -> FlightRow | None:
        row = await catalogue.by_file(session, due.file)
        if row is not None or facts is None or await session.get(DroneRow, due.drone_id) is None:
            return row
        began_at = datetime.fromtimestamp(facts.index.began_us / 1e6, UTC)
        return await catalogue.add(
            session, drone_id=due.drone_id, store=self._files.id, file=due.file, began_at=began_at, pilots=[]
        )

    async def _adopt(self, found: FoundFlight) -> bool:
        """Whether these files are of a drone that the database knows. A drone that was made after the flight is another
        one: an older copy of the database may have given its number away again."""
        try:
            lines = await asyncio.to_thread(self._head, found)
            index = read_index(lines)
        except (NoIndex, OSError):
            return False
        async with self._database.reading() as session:
            drone = await session.get(DroneRow, found.drone_id)
        is_same = drone is not None and drone.created_at.timestamp() * 1e6 <= index.began_us
        return is_same and index.drone_id == found.drone_id

    def _head(self, found: FoundFlight) -> list[bytes]:
        with self._files.path(found.drone_id, found.file, INDEX).open("rb") as file:
            return [file.readline()]

    async def delete(self, flight_id: int, action: AuditAction) -> None:
        """Raises UnknownFlight, FlightRunning."""
        async with self._database.writing() as session:
            row = await catalogue.remove(session, flight_id, "flight.deleted", action)
        if row.store == self._files.id:
            await asyncio.to_thread(self._files.remove, row.drone_id, row.file)
        self._dirty = True
