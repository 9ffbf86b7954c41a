"""Streams an export of a flight while it reads the file: in memory is one piece of it, whatever its length.

A thread reads in turns of about a millisecond, so that the tower's loop has the interpreter in between, and few exports
read at a time: the others wait.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final, Literal
from urllib.parse import quote

from fastapi.responses import StreamingResponse

from server.flights.core import exports
from server.flights.core.tlog import Entry, of_one_vehicle, read_entries
from server.flights.core.track import fixes_in

FormatName = Literal["csv", "kml", "gpx"]
PIECE_LINES: Final = 500
ENTRIES_A_TURN: Final = 500
TURN_S: Final = 0.001


@dataclass(frozen=True)
class Format:
    media_type: str
    export: exports.Export


FORMATS: Final[dict[FormatName, Format]] = {
    "csv": Format("text/csv", exports.csv),
    "kml": Format("application/vnd.google-earth.kml+xml", exports.kml),
    "gpx": Format("application/gpx+xml", exports.gpx),
}


def export_stream(
    path: Path, format_name: FormatName, *, title: str, file_name: str, turns: asyncio.Semaphore
) -> StreamingResponse:
    """The file exists."""
    chosen = FORMATS[format_name]
    headers = {
        "Content-Disposition": f"attachment; filename*=utf-8''{quote(file_name, safe='')}",
        "Cache-Control": "private, no-cache",
    }
    return StreamingResponse(_pieces(path, chosen.export, title, turns), media_type=chosen.media_type, headers=headers)


async def _pieces(path: Path, export: exports.Export, title: str, turns: asyncio.Semaphore) -> AsyncIterator[bytes]:
    file = await asyncio.to_thread(path.open, "rb")
    try:
        lines = export(title, fixes_in(of_one_vehicle(_in_turns(read_entries(file)))))
        while True:
            async with turns:  # not while the piece is sent: a slow reader keeps nobody waiting
                piece = await asyncio.to_thread(lambda: "".join(islice(lines, PIECE_LINES)))
            if not piece:
                return
            yield piece.encode()
    finally:
        file.close()


def _in_turns(entries: Iterator[Entry]) -> Iterator[Entry]:
    for number, entry in enumerate(entries):
        if number % ENTRIES_A_TURN == ENTRIES_A_TURN - 1:
            time.sleep(TURN_S)
        yield entry
