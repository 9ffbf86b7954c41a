"""A PostgreSQL for one test, which can be frozen and killed."""

import asyncio
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import asyncpg
from worlds.postgres import postgres_programs, temporary_postgres


class OwnPostgres:
    """A cluster for one test, which may stop and kill it."""

    def __init__(self, url: str, postmaster: int) -> None:
        self.url = url
        self._postmaster = postmaster
        self._frozen: list[int] = []

    def of(self, database: str) -> "OwnPostgres":
        """The same server with another of its databases."""
        return OwnPostgres(self.url.rpartition("/")[0] + f"/{database}", self._postmaster)

    def _pids(self) -> list[int]:
        children = Path(f"/proc/{self._postmaster}/task/{self._postmaster}/children").read_text().split()
        return [self._postmaster, *map(int, children)]

    def freeze(self) -> None:
        self._frozen = self._pids()
        self._send(signal.SIGSTOP)

    def thaw(self) -> None:
        self._send(signal.SIGCONT)
        self._frozen = []

    def kill(self) -> None:
        """Kills all its processes, as if the machine had failed."""
        self._frozen = self._pids()
        self._send(signal.SIGKILL)
        self._frozen = []

    def _send(self, number: signal.Signals) -> None:
        for pid in self._frozen:
            with suppress(ProcessLookupError):  # the others end by themselves as soon as the first is killed
                os.kill(pid, number)


@contextmanager
def own_postgres(missing: Callable[[str], None]) -> Iterator[OwnPostgres]:
    programs = postgres_programs()
    if programs is None:
        missing("PostgreSQL (Debian: apt-get install postgresql)")
    assert programs is not None
    with temporary_postgres(programs) as address:

        async def prepare() -> int:
            connection = await asyncpg.connect(f"{address}/postgres")
            try:
                await connection.execute("CREATE DATABASE tower")
                folder = await connection.fetchval("SHOW data_directory")
                lines = await asyncio.to_thread(Path(folder, "postmaster.pid").read_text)
                return int(lines.split()[0])
            finally:
                await connection.close()

        postgres = OwnPostgres(f"{address}/tower", asyncio.run(prepare()))
        try:
            yield postgres
        finally:
            postgres.thaw()
