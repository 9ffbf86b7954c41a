"""A NATS server for the tests, on a loopback port."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from socket import create_connection

from worlds.free_ports import free_tcp_port

START_WITHIN_S = 20.0


def nats_program() -> str | None:
    """Where Debian's package or `deploy/install_test_parts.sh` has put it."""
    ours = Path(sys.prefix, "programs/usr/sbin")
    return shutil.which("nats-server") or shutil.which("nats-server", path=f"/usr/sbin:/usr/local/sbin:{ours}")


class TemporaryNats:
    """One server, which a test may stop, continue, kill and start again on its port."""

    def __init__(
        self, program: str, *options: str, folder: Path | None = None, environment: Mapping[str, str] | None = None
    ) -> None:
        self._program = program
        self._options = options
        self._folder = folder
        self._environment = {**os.environ, **(environment or {})}
        self._port = free_tcp_port()
        self.url = f"nats://127.0.0.1:{self._port}"
        self._process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        self._process = subprocess.Popen(
            [self._program, "-a", "127.0.0.1", "-p", str(self._port), *self._options],
            cwd=self._folder,
            env=self._environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        deadline = time.monotonic() + START_WITHIN_S
        while True:
            with suppress(OSError), create_connection(("127.0.0.1", self._port), timeout=1):
                return
            assert time.monotonic() < deadline, "NATS did not get ready"
            time.sleep(0.02)

    def signal(self, number: signal.Signals) -> None:
        assert self._process is not None
        self._process.send_signal(number)

    def kill(self) -> None:
        assert self._process is not None
        self._process.kill()
        self._process.wait(10)


@contextmanager
def temporary_nats(
    program: str, *options: str, folder: Path | None = None, environment: Mapping[str, str] | None = None
) -> Iterator[TemporaryNats]:
    """`options`: of the program; it runs in `folder`, with `environment` besides ours."""
    server = TemporaryNats(program, *options, folder=folder, environment=environment)
    try:
        yield server
    finally:
        with suppress(ProcessLookupError):
            server.signal(signal.SIGCONT)
        server.kill()
