"""Carries the gaps of flights from the recorder to the fetcher, and what was fetched into the files.

A gap has a row, so a fetch goes on after a restart of the tower. Pieces are appended to `<file>.<gap>.part`, and are
merged into the telemetry log when the flight is over and its gap has been fetched.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice, takewhile
from pathlib import Path
from typing import Final

import structlog
from sqlalchemy import select

from server.flights.core.black_box import BlackBoxFetcher, Gap
from server.flights.core.gap_watch import GapFound, GapWatch
from server.flights.core.index import NoIndex, index_end_us
from server.flights.store import catalogue
from server.flights.store.files import INDEX, TLOG, FlightFiles
from server.flights.store.merging import NEAR_US, merge, resume_point
from server.flights.store.tables import FlightGapRow, FlightRow
from server.flights.store.writer import FlightFile
from server.kernel.clock import Clock
from server.storage.database import Database, DatabaseUnavailable
from wire.ids import DroneId

LOOK_EVERY_S: Final = 0.5
FOUND_AT_ONCE: Final = 100
"""Gaps that get their rows in one transaction: a tower that stood still has one in each of its flights."""
MERGE_EVERY_S: Final = 2.0
MAX_WAITING: Final = 4096
"""Found gaps and pieces that database and disk have not taken yet; more are lost, and fetched again after a restart."""
WANTED: Final = "wanted"
FETCHED: Final = "fetched"
MERGED: Final = "merged"
MISSING: Final = "missing"
KEEP_S: Final = 30 * 86400.0
"""A drone that has not come back for so long has overwritten it."""
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class _Piece:
    gap: Gap
    entries: bytes
    shift_us: int


@dataclass(frozen=True)
class _Done:
    gap: Gap
    words: str


class GapService:
    """One for a tower. `work` runs in the background."""

    def __init__(
        self, *, database: Database, clock: Clock, files: FlightFiles, watch: GapWatch, fetcher: BlackBoxFetcher
    ) -> None:
        self._database = database
        self._clock = clock
        self._files = files
        self._fetcher = fetcher
        self._jobs: deque[GapFound | _Piece | _Done] = deque(maxlen=MAX_WAITING)
        self._shifts: dict[int, int] = {}
        self._dirty = True
        self._merge_at = 0.0
        self._waits = False
        self.frames = 0
        """That came into flights, since the tower started."""
        watch.on_gap = self._jobs.append
        fetcher.on_piece = lambda gap, entries, shift_us: self._jobs.append(_Piece(gap, entries, shift_us))
        fetcher.on_done = lambda gap, words: self._jobs.append(_Done(gap, words))

    async def recover(self) -> None:
        """Goes on with what an earlier tower left. Call it before `work`. Raises OSError, DatabaseUnavailable."""
        oldest_us = round((self._clock().timestamp() - KEEP_S) * 1e6)
        async with self._database.reading() as session:
            query = select(FlightGapRow, FlightRow.drone_id, FlightRow.file).join(
                FlightRow, FlightRow.id == FlightGapRow.flight_id
            )
            query = query.where(FlightRow.store == self._files.id, FlightGapRow.state == WANTED)
            found = (await session.execute(query.order_by(FlightGapRow.id))).all()
        for row, drone_id, file in found:
            gap = Gap(row.id, DroneId(drone_id), file, row.from_us, row.to_us)
            gap.resume_us = await asyncio.to_thread(resume_point, self._part(gap))
            if row.to_us < oldest_us or not self._fetcher.add(gap):
                self._jobs.append(_Done(gap, "the drone did not come back with it"))

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            try:
                await self._step()
                self._waits = False
            except (DatabaseUnavailable, OSError) as error:
                if not self._waits:
                    _log.warning("flight_gaps_wait", error=type(error).__name__)
                self._waits = True
            await asyncio.sleep(LOOK_EVERY_S)

    async def _step(self) -> None:
        left = len(self._jobs)
        while left:
            found = self._found_next(left)
            if found:
                left -= len(found)
                self._jobs.extend(await self._found(found))
            else:
                left -= 1
                job = self._jobs[0]
                if isinstance(job, _Piece):
                    self._shifts[job.gap.id] = job.shift_us
                    await asyncio.to_thread(self._append, job)
                elif isinstance(job, _Done):
                    await self._done(job)
            for _ in range(len(found) or 1):
                self._jobs.popleft()
        if self._dirty and time.monotonic() >= self._merge_at:
            self._merge_at = time.monotonic() + MERGE_EVERY_S
            self._dirty = await self._merge_all()

    def _found_next(self, most: int) -> list[GapFound]:
        """The gaps at the head of the queue; empty if something else is there."""
        head = islice(self._jobs, min(most, FOUND_AT_ONCE))
        return [one for one in takewhile(lambda job: isinstance(job, GapFound), head) if isinstance(one, GapFound)]

    async def _found(self, found: Sequence[GapFound]) -> list[GapFound]:
        """Returns those whose flights have no row yet. The others have a row now, or need none."""
        files = {one.sink.file for one in found if isinstance(one.sink, FlightFile)}
        waiting: list[GapFound] = []
        rows: list[tuple[GapFound, str, FlightGapRow]] = []
        async with self._database.writing() as session:
            flights = await catalogue.ids_by_file(session, files)
            for one in found:
                if not isinstance(one.sink, FlightFile):
                    continue
                flight_id = flights.get(one.sink.file)
                if flight_id is not None:
                    rows.append((one, one.sink.file, _row_of(one, flight_id)))
                elif not one.sink.closed:
                    waiting.append(one)
            session.add_all(row for _, _, row in rows)
            await session.flush()
            gaps = [Gap(row.id, one.drone_id, file, one.from_us, one.to_us) for one, file, row in rows]
        for gap in gaps:
            self._fetcher.add(gap)
        return waiting

    def _append(self, piece: _Piece) -> None:
        with self._part(piece.gap).open("ab") as file:
            file.write(piece.entries)

    async def _done(self, done: _Done) -> None:
        has_some = await asyncio.to_thread(self._part(done.gap).exists)
        async with self._database.writing() as session:
            row = await session.get(FlightGapRow, done.gap.id)
            if row is not None:
                row.state, row.words = FETCHED if has_some else MISSING, done.words[:200]
                row.shift_us = self._shifts.pop(done.gap.id, 0)
            is_known = row is not None
        if not is_known:  # its flight was deleted meanwhile
            await asyncio.to_thread(self._part(done.gap).unlink, missing_ok=True)
            return
        _log.info("flight_gap_fetched", drone_id=done.gap.drone_id, bytes=done.gap.got_bytes, words=done.words)
        self._dirty = True

    async def _merge_all(self) -> bool:
        """Whether something waits for the end of its flight."""
        async with self._database.reading() as session:
            query = select(FlightGapRow, FlightRow)
            query = query.join(FlightRow, FlightRow.id == FlightGapRow.flight_id)
            query = query.where(FlightRow.store == self._files.id, FlightGapRow.state == FETCHED)
            waiting = (await session.execute(query.order_by(FlightGapRow.id))).all()
        left = False
        for row, flight in waiting:
            if flight.state == catalogue.READY:
                await self._merge(row, flight.id, flight.drone_id, flight.file)
            else:
                left = left or flight.state == catalogue.RUNNING
        return left

    async def _merge(self, gap: FlightGapRow, flight_id: int, drone_id: int, file: str) -> None:
        part = self._part_of(drone_id, file, gap.id)
        tlog = self._files.path(drone_id, file, TLOG)
        try:
            lines = await asyncio.to_thread(self._files.read_index, drone_id, file)
            until_us = min(index_end_us(lines), gap.to_us + NEAR_US)
            span = {"shift_us": gap.shift_us, "since_us": gap.from_us - NEAR_US, "until_us": until_us}
            frames = await asyncio.to_thread(partial(merge, tlog, part, **span))
            await asyncio.to_thread(self._note, drone_id, file, gap.id, frames)
            facts = await asyncio.to_thread(self._files.close_unfinished, drone_id, file)
        except NoIndex:
            return
        async with self._database.writing() as session:
            row = await session.get(FlightRow, flight_id)
            if row is not None:
                await catalogue.finish(session, row, facts, words=row.words, lost_frames=row.lost_frames)
                merged = await session.get(FlightGapRow, gap.id)
                if merged is not None:
                    merged.state, merged.frames = MERGED, frames
        await asyncio.to_thread(part.unlink, missing_ok=True)
        self.frames += frames
        _log.info("flight_gap_merged", drone_id=drone_id, flight=flight_id, frames=frames)

    def _note(self, drone_id: int, file: str, gap_id: int, frames: int) -> None:
        at_us = round(self._clock().timestamp() * 1e6)
        line = f'{{"at_us":{at_us},"kind":"black_box","gap":{gap_id},"frames":{frames}}}\n'
        with self._files.path(drone_id, file, INDEX).open("ab") as index:
            index.write(line.encode())

    def _part(self, gap: Gap) -> Path:
        return self._part_of(gap.drone_id, gap.file, gap.id)

    def _part_of(self, drone_id: int, file: str, gap_id: int) -> Path:
        return self._files.path(drone_id, file, f".{gap_id}.part")


def _row_of(found: GapFound, flight_id: int) -> FlightGapRow:
    return FlightGapRow(
        flight_id=flight_id, from_us=found.from_us, to_us=found.to_us, state=WANTED, words="", frames=0, shift_us=0
    )
