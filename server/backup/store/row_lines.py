"""Rows as lines of JSON, gzipped: how an archive holds a table. A moment is in UTC, bytes are in base64.

A line is an object with the names of the columns, so that a table of an older version can be filled from it.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Final

import msgspec
from sqlalchemy import DateTime, LargeBinary, Table

from server.backup.store.table_rows import ROWS_AT_ONCE, Row

COMPRESSION: Final = 3


class RowWriter:
    """Writes the rows of one table to a file."""

    def __init__(self, path: Path) -> None:
        self._file = gzip.open(path, "wb", compresslevel=COMPRESSION)  # noqa: SIM115 - closed by __exit__
        self.rows = 0

    def write(self, rows: Sequence[Row]) -> None:
        encode = msgspec.json.encode
        self._file.write(b"".join(encode(row) + b"\n" for row in rows))
        self.rows += len(rows)

    def __enter__(self) -> RowWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._file.close()


def read_lines(file: IO[bytes], table: Table, *, naive: bool) -> Iterator[list[dict[str, Any]]]:
    """Yields rows of this table, some at a time. `naive`: the database stores no time zones (SQLite)."""
    moments = [column.name for column in table.columns if isinstance(column.type, DateTime)]
    binaries = [column.name for column in table.columns if isinstance(column.type, LargeBinary)]
    names = {column.name for column in table.columns}
    some: list[dict[str, Any]] = []
    with gzip.open(file, "rb") as lines:
        for line in lines:
            row = {name: value for name, value in msgspec.json.decode(line).items() if name in names}
            for name in moments:
                row[name] = None if row[name] is None else _moment(row[name], naive=naive)
            for name in binaries:
                row[name] = None if row[name] is None else base64.b64decode(row[name])
            some.append(row)
            if len(some) == ROWS_AT_ONCE:
                yield some
                some = []
    if some:
        yield some


def _moment(words: str, *, naive: bool) -> datetime:
    moment = datetime.fromisoformat(words).astimezone(UTC)
    return moment.replace(tzinfo=None) if naive else moment
