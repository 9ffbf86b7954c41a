"""PostgreSQL that a benchmark may kill, freeze, lock and start again; its disk can be small and full."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pwd
import signal
import subprocess
from pathlib import Path
from typing import Final

import asyncpg  # type: ignore[import-untyped]

READY_WITHIN_S: Final = 60.0
DISK_MIB: Final = 260
MAX_LOG_FILES: Final = 40
_ACCOUNT: Final = "postgres"


class FaultyPostgres:
    """A cluster in `folder`, on one port for its whole life."""

    def __init__(self, programs: Path, folder: Path, port: int) -> None:
        self._programs = programs
        self._folder = folder
        self._port = port
        self._user = pwd.getpwnam(_ACCOUNT).pw_uid if os.geteuid() == 0 else None
        self._server: subprocess.Popen[bytes] | None = None
        self._frozen: list[int] = []
        self._locks: asyncpg.Connection | None = None
        self.has_small_disk = False

    @property
    def url(self) -> str:
        return self._at("tower")

    def _at(self, database: str) -> str:
        return f"postgresql://tower@127.0.0.1:{self._port}/{database}"

    async def make(self, *, small_disk: bool) -> None:
        """Creates the cluster and starts it. `small_disk`: on a disk of its own (root only)."""
        self._folder.mkdir(mode=0o755, parents=True)
        if small_disk and os.geteuid() == 0:
            mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", str(self._folder)]
            mounted = await asyncio.to_thread(subprocess.run, mount, check=False, capture_output=True)
            self.has_small_disk = mounted.returncode == 0
        cluster = self._folder / "cluster"
        cluster.mkdir()
        if self._user is not None:
            os.chown(cluster, self._user, -1)
        made = await asyncio.to_thread(self._initialise, cluster)
        if made.returncode:
            raise RuntimeError(made.stderr.decode()[-500:])
        await self.start()
        connection = await asyncpg.connect(self._at("postgres"))
        try:
            await connection.execute("CREATE DATABASE tower")
        finally:
            await connection.close()

    def _initialise(self, cluster: Path) -> subprocess.CompletedProcess[bytes]:
        words = ["-D", str(cluster), "-U", "tower", "-A", "trust", "-E", "UTF8", "--locale=C"]
        program = str(self._programs / "initdb")
        return subprocess.run([program, *words], check=False, capture_output=True, cwd="/", user=self._user)

    async def start(self) -> None:
        """Also after a kill. Returns when it answers."""
        cluster = self._folder / "cluster"
        deadline = asyncio.get_running_loop().time() + READY_WITHIN_S
        while True:
            if self._server is None or self._server.poll() is not None:
                # A killed server leaves its file, and the number may belong to another process by now.
                (cluster / "postmaster.pid").unlink(missing_ok=True)
                self._server = subprocess.Popen(  # noqa: ASYNC220  # polled without the loop, too
                    [
                        *(self._programs / "postgres", "-D", cluster, "-p", str(self._port)),
                        *("-c", "listen_addresses=127.0.0.1", "-c", f"unix_socket_directories={cluster}"),
                        *("-c", "min_wal_size=32MB", "-c", "max_wal_size=64MB"),
                    ],
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    cwd="/",
                    user=self._user,
                )
            with contextlib.suppress(OSError, asyncpg.PostgresError, TimeoutError):
                connection = await asyncpg.connect(self._at("postgres"), timeout=2)
                await connection.close()
                return
            if asyncio.get_running_loop().time() > deadline:
                raise TimeoutError("PostgreSQL did not get ready")
            await asyncio.sleep(0.05)

    def _pids(self) -> list[int]:
        assert self._server is not None
        pid = self._server.pid
        with contextlib.suppress(OSError):
            return [pid, *map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())]
        return []

    def kill(self) -> None:
        """Kills all its processes."""
        assert self._server is not None
        _send(self._pids(), signal.SIGKILL)
        self._server.wait()

    def freeze(self) -> None:
        self._frozen = self._pids()
        _send(self._frozen, signal.SIGSTOP)

    def thaw(self) -> None:
        _send(self._frozen, signal.SIGCONT)
        self._frozen = []

    async def lock(self, table: str) -> None:
        """Holds an exclusive lock on the table until `unlock`."""
        self._locks = await asyncpg.connect(self.url)
        await self._locks.execute("BEGIN")
        await self._locks.execute(f"LOCK TABLE {table} IN ACCESS EXCLUSIVE MODE")

    async def unlock(self) -> None:
        if self._locks is not None:
            await self._locks.execute("ROLLBACK")
            await self._locks.close()
            self._locks = None

    def fill_disk(self) -> None:
        """Leaves no byte of the small disk."""
        with (self._folder / "filler").open("wb", buffering=0) as file, contextlib.suppress(OSError):
            while True:
                file.write(b"\0" * 65_536)

    async def spend_log(self) -> None:
        """Lets it begin new files of its write-ahead log until it cannot: then it ends itself."""
        with contextlib.suppress(OSError, asyncpg.PostgresError, asyncpg.InterfaceError):
            connection = await asyncpg.connect(self.url, timeout=2, command_timeout=5)
            for _ in range(MAX_LOG_FILES):
                await connection.execute("SELECT pg_logical_emit_message(true, 'bench', 'full')")
                await connection.execute("SELECT pg_switch_wal()")

    def empty_disk(self) -> None:
        (self._folder / "filler").unlink(missing_ok=True)

    def close(self) -> None:
        self.thaw()
        if self._server is not None and self._server.poll() is None:
            self.kill()
        if self.has_small_disk:
            subprocess.run(["umount", "-l", str(self._folder)], check=False, capture_output=True)


def _send(pids: list[int], number: signal.Signals) -> None:
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)
