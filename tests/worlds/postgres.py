"""A PostgreSQL server of the tests' own: a temporary cluster on a Unix socket's port of loopback, gone afterwards."""

import os
import pwd
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from worlds.free_ports import free_tcp_port

START_WITHIN_S = 60.0


def postgres_programs() -> Path | None:
    """The folder with initdb and postgres, newest version first."""
    places = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    found = shutil.which("initdb")
    return next((place for place in places if (place / "initdb").exists()), Path(found).parent if found else None)


@contextmanager
def temporary_postgres(programs: Path, folder: Path) -> Iterator[str]:
    """A `postgresql://` address at which databases can be created.

    PostgreSQL refuses to run as root, so root lends it to the user `postgres`.
    """
    account = {"user": pwd.getpwnam("postgres").pw_uid} if os.geteuid() == 0 else {}
    cluster = folder / "cluster"
    cluster.mkdir(mode=0o700)
    if account:
        for place in (folder, *folder.parents):
            # pytest's folders are readable by their owner only; the server has to pass through.
            if place.stat().st_uid == 0 and str(place).startswith("/tmp/"):
                place.chmod(place.stat().st_mode | 0o011)
        os.chown(cluster, account["user"], -1)
    port = free_tcp_port()
    subprocess.run(
        [programs / "initdb", "-D", cluster, "-U", "tower", "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C"],
        check=True,
        stdout=subprocess.DEVNULL,
        cwd="/",
        **account,
    )
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
