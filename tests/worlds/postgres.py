"""A temporary PostgreSQL cluster for the tests, on a loopback port. It is removed afterwards."""

import os
import pwd
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from worlds.free_ports import free_tcp_port

START_WITHIN_S = 60.0


def postgres_programs() -> Path | None:
    """Returns the folder with initdb and postgres, of the newest version."""
    places = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    found = shutil.which("initdb")
    return next((place for place in places if (place / "initdb").exists()), Path(found).parent if found else None)


@contextmanager
def temporary_postgres(programs: Path) -> Iterator[str]:
    """Yields a `postgresql://` address at which databases can be created.

    PostgreSQL refuses to run as root, so root gives the cluster to the user `postgres`. The cluster has a folder of its
    own, because each pytest, when it starts, closes the folder above all its own folders to everybody but the owner.
    """
    account = {"user": pwd.getpwnam("postgres").pw_uid} if os.geteuid() == 0 else {}
    with tempfile.TemporaryDirectory(prefix="tower-postgres-") as folder:
        if account:
            os.chown(folder, account["user"], -1)
        with _server_in(Path(folder), programs, account) as address:
            yield address


@contextmanager
def _server_in(cluster: Path, programs: Path, account: dict[str, int]) -> Iterator[str]:
    made = subprocess.run(
        [programs / "initdb", "-D", cluster, "-U", "tower", "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C"],
        check=False,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd="/",
        **account,
    )
    assert made.returncode == 0, f"initdb ended with {made.returncode}:\n{made.stdout}"
    port = free_tcp_port()
    server = subprocess.Popen(
        [
            *(programs / "postgres", "-D", cluster, "-p", str(port), "-c", "listen_addresses=127.0.0.1"),
            *("-c", f"unix_socket_directories={cluster}", "-c", "fsync=off"),
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        cwd="/",
        **account,
    )
    try:
        deadline = time.monotonic() + START_WITHIN_S
        while subprocess.run(
            [programs / "pg_isready", "-q", "-h", "127.0.0.1", "-p", str(port)], check=False
        ).returncode:
            assert server.poll() is None, "PostgreSQL ended at once"
            assert time.monotonic() < deadline, "PostgreSQL did not get ready"
            time.sleep(0.05)
        yield f"postgresql://tower@127.0.0.1:{port}"
    finally:
        server.terminate()
        server.wait(30)
